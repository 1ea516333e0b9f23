//! The command line.

mod bench;
mod cluster;
mod denoise;
mod goal;
mod keep;
mod render;
mod shell;
mod tradeoff;
mod view;

pub use bench::{BenchArgs, BenchCommand, ReportArgs};
#[cfg(feature = "mpi")]
pub use bench::{ClusterBenchArgs, SyncArg};
#[cfg(feature = "mpi")]
pub use cluster::DistributeArg;
pub use cluster::{ClusterArgs, RankArgs};
pub use denoise::{DenoiseArg, DenoiseArgs};
pub use goal::GoalArgs;
pub use keep::{FallbackArg, KeepArgs, MergeArgs, ResumeArgs, Samples};
pub use render::RenderArgs;
pub use shell::{CompletionsArgs, DoctorArgs, InfoArgs, ManArgs, TellArgs};
pub use tradeoff::{ConvergeArgs, ReferenceArgs, TradeoffArgs};
pub use view::ViewArgs;

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use trisect::backend::Choice;
use trisect::bvh::BvhQuality;
use trisect::render::{MathMode, Sampler, Schedule, Settings, Traversal};

/// A path tracer whose kernels are written once in Rust and run on the CPU, through wgpu and through CUDA.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    after_help = "Exit codes: 0 ok, 1 run time, 2 usage, 3 backend unavailable, 4 bad scene, 5 images differ, 6 outside the supported range, 7 --time-limit ended a render, 130 interrupted."
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

/// What and where to render.
#[derive(Clone, Debug, Args)]
pub struct JobArgs {
    /// Scene file; without one, the built-in hello world.
    pub scene: Option<PathBuf>,

    /// Where to render.
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,

    /// Index of the device, as `trisect info` lists it; needs --backend wgpu, cuda or cpu.
    #[arg(long, value_name = "N")]
    pub device: Option<usize>,

    /// Threads of the cpu backend; without it, one for each logical core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Pixels across; alone, the height follows the scene's aspect.
    #[arg(long, value_name = "PIXELS", value_parser = parse_count)]
    pub width: Option<u32>,

    /// Pixels down; alone, the width follows the scene's aspect.
    #[arg(long, value_name = "PIXELS", value_parser = parse_count)]
    pub height: Option<u32>,

    /// Pixels across and down.
    #[arg(long, value_name = "WxH", value_parser = parse_resolution, conflicts_with_all = ["width", "height"])]
    pub resolution: Option<(u32, u32)>,

    /// Samples a pixel.
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub spp: Option<u32>,

    /// Segments a path, at most.
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub depth: Option<u32>,

    /// Of the random numbers.
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,

    /// End paths at random by their throughput, from --roulette-depth on: the same mean, fewer segments, more noise. Without it, off; with
    /// --budget, what is better.
    #[arg(long, value_enum)]
    pub roulette: Option<Switch>,

    /// With --roulette on: from which segment of a path; 1 is the one from the camera.
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub roulette_depth: Option<u32>,

    /// Where random numbers come from. Without it, independent; with --budget, what is better.
    #[arg(long, value_enum)]
    pub sampler: Option<SamplerArg>,

    /// Connect paths to lights (next-event estimation with multiple importance sampling); off finds lights by chance, and lights
    /// without extent never.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub light_sampling: Switch,

    /// The most that a channel of a sample is: less noise from rare bright paths, and a darker image.
    #[arg(long, value_name = "X")]
    pub clamp: Option<f32>,

    /// How much work goes into the BVH; without it, high up to 100,000 primitives, else medium.
    #[arg(long, value_enum)]
    pub bvh_quality: Option<QualityArg>,

    /// How the closest hit is found, of which the image does not depend; without it, by what is fastest on the backend.
    #[arg(long, value_enum)]
    pub traversal: Option<TraversalArg>,

    /// What a lane of the device works on, of which the image does not depend; without it, what is fastest on the backend.
    #[arg(long, value_enum)]
    pub schedule: Option<ScheduleArg>,

    /// Edge of the tiles for whose camera rays the tree is pruned, of which the image does not depend: a power of two from 4 to 1024, or
    /// 0 for none; without it, 8 from 64 samples on, else 16, and none where there are lights.
    #[arg(long, value_name = "PIXELS")]
    pub tile: Option<u32>,

    /// The kernel, by name; without it, the cheapest that the scene can do with (--stats names it).
    #[arg(long, value_name = "NAME", value_parser = parse_variant)]
    pub variant: Option<&'static str>,

    /// Which build of the kernels; fast exists for cuda and wgpu.
    #[arg(long, value_enum, default_value_t = MathArg::Precise)]
    pub math: MathArg,
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

    /// Exit with code 5 if relMSE is greater.
    #[arg(long, value_name = "X")]
    pub max_rel_mse: Option<f64>,
}

/// `trisect check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 nothing found, 4 bad scene, 6 something is outside the supported range."
)]
pub struct CheckArgs {
    /// Scene file or model.
    pub scene: PathBuf,

    /// Print JSON.
    #[arg(long)]
    pub json: bool,

    /// Write a copy of the scene that is computed where it has the most digits: recentred and rescaled by the field `space`, the same
    /// image. Of a model, a scene that shows it.
    #[arg(long, value_name = "FILE.ron")]
    pub write: Option<PathBuf>,
}

/// `--backend`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendArg {
    /// cuda, else a hardware wgpu adapter, else cpu.
    Auto,
    /// This machine's threads.
    Cpu,
    /// Vulkan, Metal or Direct3D 12.
    Wgpu,
    /// NVIDIA's driver.
    Cuda,
}

/// `on` or `off`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Yes.
    On,
    /// No.
    Off,
}

/// `--sampler`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SamplerArg {
    /// A hash: each number independent of each other.
    Independent,
    /// The Owen-scrambled Sobol sequence.
    Sobol,
}

/// `--bvh-quality`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QualityArg {
    /// Built soon.
    Fast,
    /// Between.
    Medium,
    /// Traced soon.
    High,
}

impl QualityArg {
    /// For the library.
    pub fn quality(self) -> BvhQuality {
        match self {
            Self::Fast => BvhQuality::Fast,
            Self::Medium => BvhQuality::Medium,
            Self::High => BvhQuality::High,
        }
    }
}

/// `--traversal`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TraversalArg {
    /// By a test of each primitive.
    Linear,
    /// In a binary tree, with a stack a ray.
    Stack,
    /// In a wide tree.
    Wide,
}

/// `--schedule`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScheduleArg {
    /// A pixel, one sample after the other.
    Pixel,
    /// A pixel; the next sample starts as soon as a path ends.
    Regenerate,
    /// The device is filled once; each lane takes pixels from a queue.
    Persistent,
}

impl TraversalArg {
    /// For the library.
    pub fn traversal(self) -> Traversal {
        match self {
            Self::Linear => Traversal::Linear,
            Self::Stack => Traversal::Stack,
            Self::Wide => Traversal::Wide,
        }
    }
}

impl ScheduleArg {
    /// For the library.
    pub fn schedule(self) -> Schedule {
        match self {
            Self::Pixel => Schedule::Pixel,
            Self::Regenerate => Schedule::Regenerate,
            Self::Persistent => Schedule::Persistent,
        }
    }
}

/// `--math`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MathArg {
    /// Each operation rounded by itself; the CPU's bits on cuda.
    Precise,
    /// Fused and approximate.
    Fast,
}

impl MathArg {
    /// For the library.
    pub fn mode(self) -> MathMode {
        match self {
            Self::Precise => MathMode::Precise,
            Self::Fast => MathMode::Fast,
        }
    }
}

impl BackendArg {
    /// For the library.
    pub fn choice(self) -> Choice {
        match self {
            Self::Auto => Choice::Auto,
            Self::Cpu => Choice::Cpu,
            Self::Wgpu => Choice::Wgpu,
            Self::Cuda => Choice::Cuda,
        }
    }
}

impl JobArgs {
    /// The scene's settings with what the command line says instead.
    pub fn settings(&self, scene: Settings) -> Settings {
        let follow = |given: u32, from: u32, to: u32| {
            let scaled = f64::from(given) * f64::from(to) / f64::from(from);
            scaled.round().clamp(1.0, f64::from(u32::MAX)) as u32
        };
        let (width, height) = match (self.resolution, self.width, self.height) {
            (Some(resolution), _, _) => resolution,
            (None, Some(width), Some(height)) => (width, height),
            (None, Some(width), None) => (width, follow(width, scene.width, scene.height)),
            (None, None, Some(height)) => (follow(height, scene.height, scene.width), height),
            (None, None, None) => (scene.width, scene.height),
        };
        Settings {
            width,
            height,
            samples: self.spp.unwrap_or(scene.samples),
            depth: self.depth.unwrap_or(scene.depth),
            seed: self.seed.unwrap_or(scene.seed),
            roulette: self.roulette == Some(Switch::On),
            roulette_depth: self.roulette_depth.unwrap_or(scene.roulette_depth),
            sampler: match self.sampler.unwrap_or(SamplerArg::Independent) {
                SamplerArg::Independent => Sampler::Independent,
                SamplerArg::Sobol => Sampler::Sobol,
            },
            light_sampling: self.light_sampling == Switch::On,
            clamp: self.clamp,
            math: self.math.mode(),
            traversal: self.traversal.map(TraversalArg::traversal),
            schedule: self.schedule.map(ScheduleArg::schedule),
            tile: self.tile,
            variant: self.variant,
            ..scene
        }
    }
}

fn parse_count(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(0) => Err("must be 1 or more".to_owned()),
        Ok(count) => Ok(count),
        Err(error) => Err(error.to_string()),
    }
}

fn parse_variant(text: &str) -> Result<&'static str, String> {
    trisect_kernels::variant_by_name(text).map(|variant| variant.name).ok_or_else(|| {
        let names: Vec<&str> = trisect_kernels::VARIANTS.iter().map(|variant| variant.name).collect();
        format!("there are {}", names.join(", "))
    })
}

fn parse_resolution(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, such as 1280x720")?;
    Ok((parse_count(width)?, parse_count(height)?))
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
    fn resolutions() {
        assert_eq!(parse_resolution("1280x720"), Ok((1280, 720)));
        for bad in ["", "x", "1280", "0x720", "1280x-1", "1x2x3"] {
            assert!(parse_resolution(bad).is_err(), "{bad}");
        }
    }
}
