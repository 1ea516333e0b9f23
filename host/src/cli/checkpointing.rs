//! What keeps a render from being lost.

use clap::{Args, ValueEnum};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;
use trisect::checkpoint::SaveInterval;

/// Checkpoints, and when to end.
#[derive(Clone, Debug, Default, Args)]
pub struct CheckpointArgs {
    /// Write all samples to this file now and then, and at the end: `trisect resume FILE` goes on from there, to the same bits.
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// With --checkpoint: how often, as 30s, 5m, 2h or 1024spp; without it 30s.
    #[arg(long, value_name = "TIME|Nspp", requires = "checkpoint")]
    pub every: Option<SaveInterval>,

    /// Render some samples of --spp only, as FIRST..END, both multiples of 256 or the end: `trisect merge` adds those of others.
    #[arg(long, value_name = "FIRST..END", value_parser = parse_samples, requires = "checkpoint")]
    pub samples: Option<Samples>,

    /// End after so long, as 30s, 5m or 2h, with what there is then: exit code 7.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub time_limit: Option<Duration>,

    /// Who goes on where the device is not there, is too small or fails.
    #[arg(long, value_enum)]
    pub fallback: Option<FallbackArg>,
}

/// `--fallback`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FallbackArg {
    /// This machine's threads.
    Cpu,
}

#[cfg(feature = "mpi")]
impl CheckpointArgs {
    /// The first of them that is given: then the root keeps a film.
    pub fn given(&self) -> Option<&'static str> {
        let given =
            [("--checkpoint", self.checkpoint.is_some()), ("--time-limit", self.time_limit.is_some())];
        given.into_iter().find(|given| given.1).map(|given| given.0)
    }
}

/// `--samples`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Samples(pub Range<u32>);

fn parse_samples(text: &str) -> Result<Samples, String> {
    let (first, end) = text.split_once("..").ok_or("write it as FIRST..END, such as 0..256")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|error| format!("{text}: {error}"));
    let (first, end) = (number(first)?, number(end)?);
    if first >= end { Err(format!("{first} is not before {end}")) } else { Ok(Samples(first..end)) }
}

fn parse_time(text: &str) -> Result<Duration, String> {
    match text.parse::<SaveInterval>() {
        Ok(SaveInterval::Time(time)) => Ok(time),
        _ => Err("write it as 500ms, 30s, 5m or 2h".to_owned()),
    }
}

/// `trisect resume`.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// The checkpoint.
    pub file: PathBuf,

    /// The scene, if it is elsewhere now.
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,

    /// Which files the scene may name: more than the first command said.
    #[command(flatten)]
    pub includes: super::IncludeArgs,

    /// Image file; without it, that of the first command, if that is in or below the checkpoint's
    /// folder or the current one.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Exposure of the image file: each stop doubles the light; without it, as the first command.
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = super::parse_stops)]
    pub exposure: Option<f32>,

    /// Where to render; without it, where the first command did.
    #[arg(long, value_enum)]
    pub backend: Option<super::BackendArg>,

    /// Index of the device; needs --backend wgpu, cuda or cpu.
    #[arg(long, value_name = "N", requires = "backend")]
    pub device: Option<usize>,

    /// Threads of the cpu backend; without it, as the first command.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// How often the checkpoint is written, as 30s, 5m, 2h or 1024spp; without it, as the first command.
    #[arg(long, value_name = "TIME|Nspp")]
    pub every: Option<SaveInterval>,

    /// End after so long, as 30s, 5m or 2h, with what there is then: exit code 7.
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub time_limit: Option<Duration>,

    /// Who goes on where the device is not there, is too small or fails.
    #[arg(long, value_enum)]
    pub fallback: Option<FallbackArg>,

    /// What is said of it.
    #[command(flatten)]
    pub log: super::LogArgs,

    /// Over several processes.
    #[command(flatten)]
    pub cluster: super::ClusterArgs,
}

/// `trisect merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Checkpoints of one image, none with samples of another.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,

    /// A checkpoint of all of them, or an image: .png (sRGB), .exr, .hdr or .pfm (linear). Not one
    /// of FILES.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Exposure of an image: each stop doubles the light; without it, as the command of the first
    /// checkpoint.
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = super::parse_stops)]
    pub exposure: Option<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_times() {
        assert_eq!(parse_samples("0..256"), Ok(Samples(0..256)));
        for bad in ["", "..", "0", "256..0", "5..5", "-1..2", "0..x"] {
            assert!(parse_samples(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_time("2h"), Ok(Duration::from_secs(7200)));
        assert!(parse_time("256spp").is_err());
    }
}
