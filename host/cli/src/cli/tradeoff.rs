//! Arguments of `trisect tradeoff` and `trisect converge`.

use super::{JobArgs, JsonArgs};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Options of the reference that errors are measured against.
#[derive(Clone, Debug, Args)]
pub struct ReferenceArgs {
    /// Maximum mean samples per pixel of the reference, which takes at most its share of
    /// --time-limit: 35 % for tradeoff, 20 % for converge (default: for tradeoff as many as fit,
    /// for converge eight times --last).
    #[arg(help_heading = "Reference", long, value_name = "N", value_parser = super::parse_count)]
    pub reference_spp: Option<u32>,

    /// Folder that keeps references, named by hash, for later measurements (default:
    /// trisect/references in the user's cache).
    #[arg(help_heading = "Reference", long, value_name = "FOLDER")]
    pub cache: Option<PathBuf>,
}

/// Arguments of `trisect tradeoff`.
#[derive(Clone, Debug, Args)]
pub struct TradeoffArgs {
    /// Scene, settings and device; `--spp` is the maximum of three levels.
    #[command(flatten)]
    pub job: JobArgs,

    /// Settings to vary, separated by commas, see docs/how-to/samples-and-budgets.md (default: all
    /// that apply to the scene and the device).
    #[arg(help_heading = "Measurement", long, value_name = "KNOBS", value_delimiter = ',')]
    pub knobs: Vec<String>,

    /// Number of repetitions of each point, with different seeds.
    #[arg(help_heading = "Measurement", long, value_name = "N", value_parser = super::parse_seeds, default_value_t = 8)]
    pub seeds: usize,

    /// Samples per pixel of the points, separated by commas (default: three levels, up to --spp or
    /// as fit --time-limit).
    #[arg(help_heading = "Measurement", long, value_name = "N,N", value_delimiter = ',', value_parser = super::parse_count)]
    pub levels: Vec<u32>,

    /// Maximum time of the whole measurement, such as 60s. Where it is too short for the scene's
    /// own size, images are smaller, unless a size, --spp or --levels is given. If it ends the
    /// measurement, the report names what is missing, and the exit code is 7.
    #[arg(help_heading = "Measurement", long, value_name = "TIME", value_parser = super::time::parse_positive_time, default_value = "8m")]
    pub time_limit: Duration,

    /// Reference that errors are measured against.
    #[command(flatten)]
    pub reference: ReferenceArgs,

    /// Folder of images of other renderers, as for `trisect evaluate` but without a reference: they
    /// are measured against the same reference, and are in the report and on its charts. Images
    /// have the scene's size, or that of --resolution.
    #[arg(help_heading = "Measurement", long, value_name = "FOLDER")]
    pub against: Option<PathBuf>,

    /// Folder for report.html, tradeoff.json, tradeoff.csv and charts; created if it does not
    /// exist.
    #[arg(help_heading = "Result", short, long, value_name = "FOLDER", default_value = "tradeoff")]
    pub output: PathBuf,

    /// Print the summary without progress and intermediate results; warnings about the scene and
    /// errors are printed.
    #[arg(help_heading = "Result", short, long)]
    pub quiet: bool,

    /// Form of the result: JSON is the content of tradeoff.json, text the summary.
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Arguments of `trisect converge`.
#[derive(Clone, Debug, Args)]
pub struct ConvergeArgs {
    /// Scene, settings and device.
    #[command(flatten)]
    pub job: JobArgs,

    /// Settings to vary, separated by commas; each configuration is compared with the base.
    #[arg(
        help_heading = "Measurement",
        long,
        value_name = "KNOBS",
        value_delimiter = ',',
        default_value = "sampler,roulette,lights,denoiser,depth,clamp"
    )]
    pub knobs: Vec<String>,

    /// Number of repetitions, with different seeds.
    #[arg(help_heading = "Measurement", long, value_name = "N", value_parser = super::parse_seeds, default_value_t = 8)]
    pub seeds: usize,

    /// Samples per pixel of the first point; each further point has twice as many.
    #[arg(help_heading = "Measurement", long, value_name = "N", value_parser = super::parse_count, default_value_t = 16)]
    pub first: u32,

    /// Maximum samples per pixel; fewer if --time-limit ends the measurement.
    #[arg(help_heading = "Measurement", long, value_name = "N", value_parser = super::parse_count, default_value_t = 4096)]
    pub last: u32,

    /// Maximum time of the whole measurement, such as 60s, shared equally among the configurations.
    /// If it ends the measurement, what is missing is named, and the exit code is 7.
    #[arg(help_heading = "Measurement", long, value_name = "TIME", value_parser = super::time::parse_positive_time, default_value = "8m")]
    pub time_limit: Duration,

    /// Reference that errors are measured against.
    #[command(flatten)]
    pub reference: ReferenceArgs,

    /// Also write the results as JSON to this file (default: none).
    #[arg(help_heading = "Result", short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Form of the result.
    #[command(flatten)]
    pub json: JsonArgs,
}
