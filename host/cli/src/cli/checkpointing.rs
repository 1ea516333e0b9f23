//! Options of checkpoints and of the end of a render, and the arguments of `trisect resume` and
//! `trisect merge`.

use super::time::parse_positive_time;
use clap::{Args, ValueEnum};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;
use trisect::checkpoint::SaveInterval;
use trisect::device::Choice;

/// Options of checkpoints and of the end of a render.
#[derive(Clone, Debug, Default, Args)]
pub struct CheckpointArgs {
    /// Write all samples to this file at intervals and at the end; `trisect resume FILE` continues
    /// from it, to the same bits (default: no checkpoint).
    #[arg(help_heading = "Checkpoints and time", long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// With --checkpoint: interval between writes, as a time (30s, 5m, 2h) or in samples per pixel
    /// (1024spp) (default: 30s).
    #[arg(help_heading = "Checkpoints and time", long, value_name = "TIME|Nspp", requires = "checkpoint")]
    pub every: Option<SaveInterval>,

    /// With --checkpoint: render only the samples from FIRST to END - 1. FIRST is a multiple of
    /// 256; END is one, too, or equals --spp. `trisect merge` combines the parts (default: all
    /// samples).
    #[arg(help_heading = "Checkpoints and time", long = "sample-range", alias = "samples", value_name = "FIRST..END", value_parser = parse_samples, requires = "checkpoint")]
    pub samples: Option<Samples>,

    /// Stop after this time, such as 30s, 5m or 2h, write what was rendered, and exit with code 7
    /// (default: no limit).
    #[arg(help_heading = "Checkpoints and time", long, value_name = "TIME", value_parser = parse_positive_time)]
    pub time_limit: Option<Duration>,

    /// Device that takes over if the chosen one is not available, is too small or fails (default:
    /// none).
    #[arg(help_heading = "Checkpoints and time", long, value_enum)]
    pub fallback: Option<FallbackArg>,
}

/// Values of `--fallback`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FallbackArg {
    /// Threads of this machine.
    Cpu,
}

#[cfg(feature = "mpi")]
impl CheckpointArgs {
    /// Returns the first given option for which the root of several ranks keeps a film.
    pub fn given(&self) -> Option<&'static str> {
        let given =
            [("--checkpoint", self.checkpoint.is_some()), ("--time-limit", self.time_limit.is_some())];
        given.into_iter().find(|given| given.1).map(|given| given.0)
    }
}

/// Value of `--sample-range`: range of sample indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Samples(pub Range<u32>);

fn parse_samples(text: &str) -> Result<Samples, String> {
    let hint = "write it as FIRST..END, such as 0..256; for a number of samples use --spp";
    let (first, end) = text.split_once("..").ok_or(hint)?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|error| format!("{text}: {error}"));
    let (first, end) = (number(first)?, number(end)?);
    if first >= end { Err(format!("{first} is not before {end}")) } else { Ok(Samples(first..end)) }
}

/// Arguments of `trisect resume`.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// Checkpoint to continue; the render keeps writing to it.
    pub file: PathBuf,

    /// Scene file, if it was moved (default: that of the first command).
    #[arg(help_heading = "Scene", long, value_name = "FILE")]
    pub scene: Option<PathBuf>,

    /// Permitted locations of files that the scene names, in addition to those of the first
    /// command.
    #[command(flatten)]
    pub includes: super::IncludeArgs,

    /// Image file (default: that of the first command, if it is in or below the checkpoint's folder
    /// or the current one).
    #[arg(help_heading = "Image file", short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Encoding of the image file; defaults are those of the first command.
    #[command(flatten)]
    pub image: super::ImageFileArgs,

    /// Backend to render on; it must round as the first one did (default: as the first command).
    #[arg(help_heading = "Device", long, value_enum)]
    pub backend: Option<Choice>,

    /// Index of the device in `trisect info`; needs --backend wgpu, cuda or cpu.
    #[arg(help_heading = "Device", long, value_name = "N", requires = "backend")]
    pub device: Option<usize>,

    /// Number of threads of the cpu backend (default: as the first command).
    #[arg(help_heading = "Device", long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Interval between writes of the checkpoint, as a time (30s, 5m, 2h) or in samples per pixel
    /// (1024spp) (default: as the first command).
    #[arg(help_heading = "Checkpoints and time", long, value_name = "TIME|Nspp")]
    pub every: Option<SaveInterval>,

    /// Stop after this time, such as 30s, 5m or 2h, write what was rendered, and exit with code 7
    /// (default: no limit).
    #[arg(help_heading = "Checkpoints and time", long, value_name = "TIME", value_parser = parse_positive_time)]
    pub time_limit: Option<Duration>,

    /// Device that takes over if the chosen one is not available, is too small or fails (default:
    /// as the first command).
    #[arg(help_heading = "Device", long, value_enum)]
    pub fallback: Option<FallbackArg>,

    /// Messages and statistics.
    #[command(flatten)]
    pub log: super::LogArgs,

    /// Options for several processes.
    #[command(flatten)]
    pub cluster: super::ClusterArgs,
}

/// Arguments of `trisect merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Checkpoints of one image, without samples in common.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,

    /// Output file, not one of FILES: an image for .png, .jpg, .tif, .exr, .hdr or .pfm, else a
    /// checkpoint.
    #[arg(help_heading = "Image file", short, long, value_name = "FILE")]
    pub output: PathBuf,

    /// Encoding of an image; defaults are those of the first checkpoint's command.
    #[command(flatten)]
    pub image: super::ImageFileArgs,
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
    }
}
