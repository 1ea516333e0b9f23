//! The command line.

mod bench;
mod checkpointing;
mod cluster;
mod denoise;
mod goal;
mod job;
mod render;
mod shell;
mod tradeoff;
mod view;

pub use bench::{BenchArgs, BenchCommand, ReportArgs};
#[cfg(feature = "mpi")]
pub use bench::{ClusterBenchArgs, SyncArg};
pub use checkpointing::{CheckpointArgs, FallbackArg, MergeArgs, ResumeArgs, Samples};
#[cfg(feature = "mpi")]
pub use cluster::DistributeArg;
pub use cluster::{ClusterArgs, RankArgs};
pub use denoise::{DenoiseArg, DenoiseArgs};
pub use goal::GoalArgs;
pub use job::{BackendArg, IncludeArgs, JobArgs, MathArg, QualityArg};
pub use render::RenderArgs;
pub use shell::{CompletionsArgs, DoctorArgs, InfoArgs, LogArgs, ManArgs};
pub use tradeoff::{ConvergeArgs, ReferenceArgs, TradeoffArgs};
pub use view::ViewArgs;

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use trisect::output::exposure::MAX_STOPS;

/// A path tracer whose kernels are written once in Rust and run on the CPU, through wgpu and through CUDA.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    after_help = "Exit codes: 0 ok, 1 run time, 2 usage, 3 backend unavailable, 4 bad scene, 5 images differ, 6 outside the supported range, 7 ended by --time-limit, 130 interrupted."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to an image file.
    Render(RenderArgs),
    /// Go on with a render where its checkpoint ended: to the same bits as if it had never been interrupted.
    Resume(ResumeArgs),
    /// Add checkpoints of one image that were rendered apart: to the same bits as if they had been rendered together.
    Merge(MergeArgs),
    /// Render a scene several times and print phases, device time, samples and segments a second; or draw a report of charts.
    Bench(BenchArgs),
    /// Turn each knob that trades accuracy for speed, and measure what it costs: a report with error, bias and time.
    Tradeoff(TradeoffArgs),
    /// Follow how errors fall with samples: noise by its slope, bias by its plateau, and whether two ways render the same image.
    Converge(ConvergeArgs),
    /// Look around in a scene: a window, or with --headless the same frames without one.
    View(ViewArgs),
    /// Compare two images: RMSE, relMSE, PSNR, FLIP, greatest difference and its pixel.
    Compare(CompareArgs),
    /// Say what in a scene is outside the range that single precision supports, by how much, and what helps.
    Check(CheckArgs),
    /// List backends and devices, and for a missing one why.
    Info(InfoArgs),
    /// Try what works here: each device by an image, processes, window, folders; and say what mends the rest.
    Doctor(DoctorArgs),
    /// Print what makes a shell complete commands and options.
    Completions(CompletionsArgs),
    /// Write manual pages.
    Man(ManArgs),
}

/// `trisect compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The image.
    pub image: PathBuf,

    /// What it should be.
    pub reference: PathBuf,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,

    /// Exit with code 5 if relMSE is greater than X (0 or more), or a pixel is NaN or infinite.
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub max_rel_mse: Option<f64>,
}

/// `trisect check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 nothing found but notes, 4 bad scene, 6 something is outside the supported range."
)]
pub struct CheckArgs {
    /// Scene file or model.
    pub scene: PathBuf,

    /// Files that the scene may name.
    #[command(flatten)]
    pub includes: IncludeArgs,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,

    /// Write a copy of the scene that is computed where it has the most digits: recentred and rescaled by the field `space`, the same
    /// image. Of a model, a scene that shows it.
    #[arg(long, value_name = "FILE.ron")]
    pub write: Option<PathBuf>,
}

fn parse_count(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(0) => Err("must be 1 or more".to_owned()),
        Ok(count) => Ok(count),
        Err(error) => Err(error.to_string()),
    }
}

fn parse_limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(limit) if limit >= 0.0 => Ok(limit),
        _ => Err("must be a number of 0 or more, such as 1e-3".to_owned()),
    }
}

fn parse_resolution(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, such as 1280x720")?;
    Ok((parse_count(width)?, parse_count(height)?))
}

fn parse_stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if stops.abs() <= MAX_STOPS => Ok(stops),
        _ => Err(format!("must be a number of stops between -{MAX_STOPS} and {MAX_STOPS}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn limits() {
        assert_eq!((parse_limit("0"), parse_limit("1e-3")), (Ok(0.0), Ok(1e-3)));
        for bad in ["NaN", "nan", "-NaN", "-1", "", "x"] {
            assert!(parse_limit(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn stops() {
        assert_eq!((parse_stops("-14.2"), parse_stops("0")), (Ok(-14.2), Ok(0.0)));
        for bad in ["", "nan", "inf", "-65", "1e9", "EV"] {
            assert!(parse_stops(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn resolutions() {
        assert_eq!(parse_resolution("1280x720"), Ok((1280, 720)));
        for bad in ["", "x", "1280", "0x720", "1280x-1", "1x2x3"] {
            assert!(parse_resolution(bad).is_err(), "{bad}");
        }
    }
}
