//! What and where to render: the options of all commands that do.

use super::{parse_count, parse_resolution};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use trisect::backend::Choice;
use trisect::bvh::BvhQuality;
use trisect::output::exposure::Exposure;
use trisect::render::{MathMode, Sampler, Schedule, Settings, Traversal};
use trisect::scene::Includes;
use trisect::scene::import::is_model;

/// What and where to render.
#[derive(Clone, Debug, Args)]
pub struct JobArgs {
    /// Scene file; without one, the built-in hello world.
    pub scene: Option<PathBuf>,

    /// Files that the scene may name.
    #[command(flatten)]
    pub includes: IncludeArgs,

    /// Where to render.
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,

    /// Index of the device, as `trisect info` lists it; needs --backend wgpu, cuda or cpu.
    #[arg(long, value_name = "N")]
    pub device: Option<usize>,

    /// Number of threads of the cpu backend, and of what else is computed on the CPU (default:
    /// RAYON_NUM_THREADS, else one a logical core).
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

    /// Whether a goal (--budget and others) may turn roulette on.
    #[arg(skip)]
    pub may_roulette: bool,

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

/// `--allow-outside`.
#[derive(Clone, Copy, Debug, Args)]
pub struct IncludeArgs {
    /// Also read files outside the scene's folder if the scene or its models name them.
    #[arg(long)]
    pub allow_outside: bool,
}

impl IncludeArgs {
    /// For the library.
    pub fn includes(self) -> Includes {
        if self.allow_outside { Includes::Anywhere } else { Includes::Below }
    }
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
    /// Returns whether the scene is a model by itself.
    pub fn shows_model(&self) -> bool {
        self.scene.as_deref().is_some_and(is_model)
    }

    /// Returns how the exposure is chosen where `given` is what the command line says.
    pub fn exposure(&self, given: Option<f32>) -> Exposure {
        match given {
            Some(stops) => Exposure::Stops(stops),
            None if self.shows_model() => Exposure::Automatic,
            None => Exposure::Stops(0.0),
        }
    }

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

fn parse_variant(text: &str) -> Result<&'static str, String> {
    trisect_kernels::variant_by_name(text).map(|variant| variant.name).ok_or_else(|| {
        let names: Vec<&str> = trisect_kernels::VARIANTS.iter().map(|variant| variant.name).collect();
        format!("there are {}", names.join(", "))
    })
}
