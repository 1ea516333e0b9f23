//! Command line of the program: the arguments of each command, parsed by clap.
//!
//! `main` parses them and hands them to the commands. The doc comments of commands, of their
//! fields and of the values of options are the text of `--help`.

mod background;
mod bench;
mod camera;
mod checkpointing;
mod cluster;
mod crop;
mod denoise;
mod evaluate;
mod goal;
mod image_file;
mod job;
mod load;
mod motion;
pub mod old_spellings;
pub mod parse;
mod preview;
mod render;
mod shell;
mod surroundings;
mod switch;
mod tradeoff;
mod view;

pub use background::Background;
#[cfg(feature = "mpi")]
pub use bench::ClusterBenchArgs;
pub use bench::{BenchArgs, BenchCommand, ReportArgs};
pub use camera::CameraArgs;
pub use checkpointing::{CheckpointArgs, FallbackArg, MergeArgs, ResumeArgs, Samples};
#[cfg(feature = "mpi")]
pub use cluster::DistributeArg;
pub use cluster::{ClusterArgs, RankArgs};
pub use crop::CropWindow;
pub use denoise::{DenoiseArg, DenoiseArgs};
pub use evaluate::EvaluateArgs;
pub use goal::GoalArgs;
pub use image_file::{ImageFileArgs, MetadataArg};
pub use job::JobArgs;
pub use load::{IncludeArgs, LoadArgs};
pub use motion::{Frames, MotionArgs};
pub use preview::{DisplayAddress, PreviewArgs};
pub use render::{DEFAULT_OUTPUT, RenderArgs};
pub use shell::{CompletionsArgs, DoctorArgs, InfoArgs, JsonArgs, LogArgs, ManArgs};
pub use surroundings::SurroundingsArgs;
pub use tradeoff::{ConvergeArgs, TradeoffArgs};
pub use view::ViewArgs;

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use trisect::output::exposure::MAX_STOPS;
use trisect::time;
use trisect_lab::tradeoff::MAX_SEEDS;

/// A path tracer whose kernels are written once in Rust and run on the CPU, through wgpu and
/// through CUDA.
#[derive(Debug, Parser)]
#[command(
    name = "trisect",
    version,
    about,
    after_help = "Exit codes: 0 success, 1 run-time error, 2 usage error, 3 backend unavailable, 4 bad scene, 5 images differ, 6 outside the supported range, 7 ended by --time-limit, 130 interrupted."
)]
pub struct Cli {
    /// Command to run.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to an image file.
    Render(Box<RenderArgs>),
    /// Continue a render from its checkpoint, to the same bits as if it had not been interrupted.
    Resume(ResumeArgs),
    /// Combine checkpoints of one image that were rendered separately, to the same bits as one
    /// render.
    Merge(MergeArgs),
    /// Render a scene several times and print its phases, device time, samples and segments per
    /// second; or measure and draw charts.
    Bench(BenchArgs),
    /// Measure error, bias and time of each option that trades accuracy for speed, and write a
    /// report.
    Tradeoff(TradeoffArgs),
    /// Measure how errors fall with the number of samples: slope of the noise, remaining bias, and
    /// whether two configurations converge to the same image.
    Converge(ConvergeArgs),
    /// Move through a scene in a window, or with --headless render the same frames without one.
    View(ViewArgs),
    /// Evaluate images of any renderer against a reference: noise and bias apart, HDR-FLIP, and
    /// noise at equal time.
    Evaluate(EvaluateArgs),
    /// Compare two images: RMSE, relMSE, PSNR, FLIP, maximum difference and its pixel.
    Compare(CompareArgs),
    /// List what in a scene exceeds the range that single precision supports, by how much, and
    /// remedies.
    Check(CheckArgs),
    /// List backends and devices, with the reason if a backend is not available.
    Info(InfoArgs),
    /// Test what works on this machine (an image on each device, MPI, window, folders) and suggest
    /// remedies for the rest.
    Doctor(DoctorArgs),
    /// Print a script with which a shell completes commands and options.
    Completions(CompletionsArgs),
    /// Write manual pages.
    Man(ManArgs),
}

/// Arguments of `trisect compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Image file to compare: .png, .jpg or .tif (sRGB), .exr, .hdr or .pfm (linear).
    pub image: PathBuf,

    /// Image file of the reference, of the same size.
    pub reference: PathBuf,

    /// Form of the result.
    #[command(flatten)]
    pub json: JsonArgs,

    /// Also write a page with both images under a slider, their difference, FLIP errors, measures
    /// and statistics; it needs no other file (default: none).
    #[arg(long, value_name = "FILE.html", value_parser = parse_page)]
    pub html: Option<PathBuf>,

    /// Exit with code 5 if relMSE exceeds X, 0 or more, or a pixel of either image is NaN or
    /// infinite (default: no limit).
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    pub max_rel_mse: Option<f64>,
}

/// Arguments of `trisect check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 within the supported range (notes may be printed), 4 bad scene, 6 outside the supported range."
)]
pub struct CheckArgs {
    /// Scene file or model.
    pub scene: PathBuf,

    /// Choices with which the scene is read.
    #[command(flatten)]
    pub load: LoadArgs,

    /// Camera in place of the scene's own; a copy of the scene has it.
    #[command(flatten)]
    pub camera: CameraArgs,

    /// Form of the result.
    #[command(flatten)]
    pub json: JsonArgs,

    /// Write a copy of the scene whose field `space` moves and scales it to where single precision
    /// has the most digits; the image changes by rounding only. With an option of the camera, write
    /// a copy with this camera. For a model, write a scene that shows it.
    #[arg(short = 'o', long, visible_alias = "output", value_name = "FILE.ron", help_heading = "Result")]
    pub write: Option<PathBuf>,

    /// Exit with code 4 if there are warnings about the scene.
    #[arg(long, help_heading = "Result")]
    pub deny_warnings: bool,
}

fn parse_page(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_page = |of: &std::ffi::OsStr| ["html", "htm"].iter().any(|page| of.eq_ignore_ascii_case(page));
    match path.extension().is_some_and(is_page) {
        true => Ok(path),
        false => Err("the page is a file that ends in .html".to_owned()),
    }
}

fn parse_count(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(0) => Err("must be 1 or more".to_owned()),
        Ok(count) => Ok(count),
        Err(error) => Err(error.to_string()),
    }
}

/// Parses a number of repetitions.
fn parse_seeds(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(seeds) if seeds <= MAX_SEEDS => Ok(seeds),
        Ok(_) => Err(format!("must be at most {MAX_SEEDS}")),
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
