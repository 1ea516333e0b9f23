//! Arguments of `trisect bench`, `trisect bench report` and `trisect bench cluster`.

use super::time::parse_positive_time;
use super::{DenoiseArgs, IncludeArgs, JobArgs, RankArgs, parse_count, parse_resolution};
use clap::{Args, Subcommand};
use std::path::PathBuf;
use trisect::device::{Choice, MathMode};
use trisect_lab::bench::cluster::GatherMethod;

/// Arguments of `trisect bench`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct BenchArgs {
    /// Measurement other than the frames of one scene.
    #[command(subcommand)]
    pub command: Option<BenchCommand>,

    /// Scene, settings and device.
    #[command(flatten)]
    pub job: JobArgs,

    /// Filter: live frames with it are measured, too, with the time of each pass.
    #[command(flatten)]
    pub denoise: DenoiseArgs,

    /// Number of measured frames, after a warm-up of two frames, on a GPU of at least half a
    /// second.
    #[arg(help_heading = "Measurement", long, value_name = "N", default_value = "10", value_parser = parse_count)]
    pub frames: u32,

    /// Print the measurements as JSON instead of the table; --json=FILE writes them to a file,
    /// beside the table.
    #[arg(help_heading = "Measurement", long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<PathBuf>,
}

/// Measurements of `trisect bench` other than the frames of one scene.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Measure this machine and write a report with charts: time over samples per pixel, traversals
    /// and schedules over the number of spheres, device against one CPU thread.
    Report(ReportArgs),
    /// Measure how renders scale with the ranks of mpirun and draw charts: frames shared by rows
    /// and averaged images over the number of ranks, with an all-reduce of the whole image for
    /// comparison.
    #[command(hide = cfg!(not(feature = "mpi")))]
    Cluster(Box<ClusterBenchArgs>),
}

/// Arguments of `trisect bench cluster`.
#[derive(Clone, Debug, Args)]
pub struct ClusterBenchArgs {
    /// Scene, settings and device.
    #[command(flatten)]
    pub job: JobArgs,

    /// Options of each rank.
    #[command(flatten)]
    pub ranks: RankArgs,

    /// Numbers of ranks to measure, separated by commas (default: 1, 2, 4 and so on, and all
    /// ranks).
    #[arg(help_heading = "Measurement", long, value_name = "N,N", value_delimiter = ',', value_parser = parse_count)]
    pub counts: Vec<u32>,

    /// Samples per pixel of frames shared by rows, separated by commas; at most 256.
    #[arg(help_heading = "Measurement", long, value_name = "N,N", value_delimiter = ',', default_value = "1,100", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub frame_spp: Vec<u32>,

    /// Samples per pixel of an averaged image, over all ranks.
    #[arg(help_heading = "Measurement", long, value_name = "N", default_value = "256", value_parser = parse_count)]
    pub average_spp: u32,

    /// Samples per pixel that each rank adds in the measurement of noise over ranks.
    #[arg(help_heading = "Measurement", long, value_name = "N", default_value = "4", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub noise_spp: u32,

    /// Methods of gathering the pixels of all ranks, separated by commas.
    #[arg(
        help_heading = "Measurement",
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "gather,allreduce"
    )]
    pub sync: Vec<GatherMethod>,

    /// Number of measured frames, after a warm-up of five frames.
    #[arg(help_heading = "Measurement", long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub frames: u32,

    /// Folder for charts and data; created if it does not exist.
    #[arg(
        help_heading = "Measurement",
        short,
        long,
        alias = "out",
        value_name = "FOLDER",
        default_value = "cluster"
    )]
    pub output: PathBuf,
}

/// Arguments of `trisect bench report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Scenes to render on the device and on one CPU thread, in addition to the generated ones.
    pub scenes: Vec<PathBuf>,

    /// Permitted locations of files that the scenes name.
    #[command(flatten)]
    pub includes: IncludeArgs,

    /// Backend to measure.
    #[arg(long, value_enum, default_value_t = Choice::Auto)]
    pub backend: Choice,

    /// Index of the device in `trisect info`; needs --backend wgpu, cuda or cpu (default: the
    /// first, for wgpu the best GPU).
    #[arg(long, value_name = "N")]
    pub device: Option<usize>,

    /// Number of threads of the cpu backend and of other work on the CPU (default:
    /// RAYON_NUM_THREADS, else one per logical core).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Build of the kernels; fast is available on cuda and wgpu.
    #[arg(long, value_enum, default_value_t = MathMode::Precise)]
    pub math: MathMode,

    /// Folder for report.html, charts and data; created if it does not exist.
    #[arg(short, long, alias = "out", value_name = "FOLDER", default_value = "report")]
    pub output: PathBuf,

    /// Render smaller images and fewer frames: takes minutes on two cores.
    #[arg(long)]
    pub quick: bool,

    /// Size of the images in pixels (default: 1280x720 on a GPU, smaller on a CPU).
    #[arg(long, value_name = "WxH", value_parser = parse_resolution)]
    pub resolution: Option<(u32, u32)>,

    /// Maximum number of spheres of a generated scene.
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = parse_count)]
    pub spheres: u32,

    /// Maximum time of a point without a BVH, such as 30s, for all its frames (default: less with
    /// --quick). A slower point gets fewer samples and frames; if one frame of one sample takes
    /// longer, the point is left out and named.
    #[arg(long, value_name = "TIME", value_parser = parse_seconds)]
    pub time_limit: Option<f64>,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    parse_positive_time(text).map(|time| time.as_secs_f64())
}
