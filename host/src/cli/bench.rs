//! `trisect bench` and `trisect bench report`.

use super::{
    BackendArg, DenoiseArgs, IncludeArgs, JobArgs, MathArg, RankArgs, parse_count, parse_resolution,
};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `trisect bench`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct BenchArgs {
    /// Something else than a scene's frames.
    #[command(subcommand)]
    pub command: Option<BenchCommand>,

    /// What and where.
    #[command(flatten)]
    pub job: JobArgs,

    /// Denoising, of frames that stay on the device: trace and each pass.
    #[command(flatten)]
    pub denoise: DenoiseArgs,

    /// Frames to measure, after two, on a GPU those of half a second, that are not.
    #[arg(long, value_name = "N", default_value = "10", value_parser = parse_count)]
    pub frames: u32,

    /// Write what was measured as JSON, too; `-` prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// What `trisect bench` does beside measuring a scene's frames.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Measure this machine and draw charts: time against spp, methods against the number of spheres, device against one CPU thread.
    Report(ReportArgs),
    /// Measure, under mpirun, what ranks bring, and draw charts: frames by rows and averaged images against the number of ranks, beside an
    /// all-reduce of the whole image.
    Cluster(Box<ClusterBenchArgs>),
}

/// `trisect bench cluster`.
#[derive(Clone, Debug, Args)]
pub struct ClusterBenchArgs {
    /// What and where.
    #[command(flatten)]
    pub job: JobArgs,

    /// How ranks work.
    #[command(flatten)]
    pub ranks: RankArgs,

    /// How many ranks, in turn, with commas between; without it, 1, 2, 4 and so on, and all.
    #[arg(long, value_name = "N,N", value_delimiter = ',', value_parser = parse_count)]
    pub counts: Vec<u32>,

    /// Samples a pixel of frames by rows, with commas between; at most 256.
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_value = "1,100", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub frame_spp: Vec<u32>,

    /// Samples a pixel of an averaged image, over all ranks.
    #[arg(long, value_name = "N", default_value = "256", value_parser = parse_count)]
    pub average_spp: u32,

    /// Samples a pixel that each rank adds where the noise is measured.
    #[arg(long, value_name = "N", default_value = "4", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub noise_spp: u32,

    /// How pixels come together, with commas between.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "gather,allreduce")]
    pub sync: Vec<SyncArg>,

    /// Frames to measure, after five that are not.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub frames: u32,

    /// Folder for charts and data; made if need be.
    #[arg(short, long, value_name = "DIR", default_value = "cluster")]
    pub out: PathBuf,
}

/// How pixels of several ranks come together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SyncArg {
    /// What this program does: what each rank has, to the root.
    Gather,
    /// The report's way, for comparison: an all-reduce of the whole image in f32 over all ranks.
    Allreduce,
}

/// `trisect bench report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Scenes to render on the device and on one CPU thread, beside the built-in ones.
    pub scenes: Vec<PathBuf>,

    /// Files that the scenes may name.
    #[command(flatten)]
    pub includes: IncludeArgs,

    /// What to measure.
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,

    /// Index of the device, as `trisect info` lists it; needs --backend wgpu, cuda or cpu.
    #[arg(long, value_name = "N")]
    pub device: Option<usize>,

    /// Number of threads of the cpu backend, and of what else is computed on the CPU (default:
    /// RAYON_NUM_THREADS, else one a logical core).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Which build of the kernels; fast exists for cuda and wgpu.
    #[arg(long, value_enum, default_value_t = MathArg::Precise)]
    pub math: MathArg,

    /// Folder for charts and data; made if need be.
    #[arg(short, long, value_name = "DIR", default_value = "report")]
    pub out: PathBuf,

    /// Smaller images and fewer frames: minutes on two cores.
    #[arg(long)]
    pub quick: bool,

    /// Pixels across and down; without it, 1280x720 on a GPU and fewer on a CPU.
    #[arg(long, value_name = "WxH", value_parser = parse_resolution)]
    pub resolution: Option<(u32, u32)>,

    /// The most spheres of a scene.
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = parse_count)]
    pub spheres: u32,

    /// Seconds that a point without a BVH may take, all its frames together; it gets fewer samples and frames, and is left out, by
    /// name, where even one takes longer.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub time_limit: Option<f64>,
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err("must be a positive number of seconds".to_owned()),
    }
}
