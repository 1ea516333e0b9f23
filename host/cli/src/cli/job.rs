//! Scene, settings and device: the options of all commands that render.

#[cfg(feature = "window")]
use super::load::ModelArgs;
use super::switch::Switch;
use super::{CameraArgs, CropWindow, LoadArgs, parse_count, parse_resolution};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use trisect::bvh::BvhQuality;
use trisect::device::Choice;
use trisect::output::exposure::Exposure;
use trisect::render::{
    KernelFeatures, MathMode, Sampler, Schedule, Settings, SettingsError, Summation, Traversal,
};
use trisect::scene::Sharing;
use trisect::scene::import::is_model;

/// Scene, settings and device of a render.
#[derive(Clone, Debug, Args)]
pub struct JobArgs {
    /// Scene file or model (default: the built-in scene with three spheres).
    pub scene: Option<PathBuf>,

    /// Choices with which the scene is read.
    #[command(flatten)]
    pub load: LoadArgs,

    /// Camera in place of the scene's own.
    #[command(flatten)]
    pub camera: CameraArgs,

    /// Backend to render on.
    #[arg(help_heading = "Device", long, value_enum, default_value_t = Choice::Auto)]
    pub backend: Choice,

    /// Index of the device in `trisect info`; needs --backend wgpu, cuda or cpu (default: the
    /// first, for wgpu the best GPU).
    #[arg(help_heading = "Device", long, value_name = "N")]
    pub device: Option<usize>,

    /// Number of threads of the cpu backend and of other work on the CPU (default:
    /// RAYON_NUM_THREADS, else one per logical core).
    #[arg(help_heading = "Device", long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,

    /// Image width in pixels; without --height, the height follows the scene's aspect ratio
    /// (default: the scene's).
    #[arg(help_heading = "Image", long, value_name = "PIXELS", value_parser = parse_count)]
    pub width: Option<u32>,

    /// Image height in pixels; without --width, the width follows the scene's aspect ratio
    /// (default: the scene's).
    #[arg(help_heading = "Image", long, value_name = "PIXELS", value_parser = parse_count)]
    pub height: Option<u32>,

    /// Image width and height in pixels (default: the scene's; in a window of view, the window's).
    #[arg(help_heading = "Image", long, value_name = "WxH", value_parser = parse_resolution, conflicts_with_all = ["width", "height"])]
    pub resolution: Option<(u32, u32)>,

    /// Samples per pixel (default: the scene's). For view: of one frame (default: 1). For tradeoff:
    /// the highest of three levels, unless --levels is given.
    #[arg(help_heading = "Samples", long, value_name = "N", value_parser = parse_count)]
    pub spp: Option<u32>,

    /// Maximum segments per path; the camera ray is the first (default: the scene's).
    #[arg(help_heading = "Samples", long, value_name = "N", value_parser = parse_count)]
    pub depth: Option<u32>,

    /// Random seed; images with different seeds have independent noise (default: 0).
    #[arg(help_heading = "Samples", long, value_name = "N")]
    pub seed: Option<u32>,

    /// End paths at random by their throughput, from segment --roulette-depth on: the same mean,
    /// fewer segments, more noise (default: off; with a goal such as --budget: the better one).
    #[arg(help_heading = "Samples", long, value_enum)]
    pub roulette: Option<Switch>,

    /// First segment at which a path may end by roulette, which this option turns on; the camera
    /// ray is segment 1 (default: 1; with a goal such as --budget: chosen).
    #[arg(help_heading = "Samples", long, value_name = "N", value_parser = parse_count)]
    pub roulette_depth: Option<u32>,

    /// Part of the image. Set by the program.
    #[arg(skip)]
    pub crop: Option<CropWindow>,

    /// True if a goal, such as that of `--budget`, may turn roulette on. Set by the program.
    #[arg(skip)]
    pub may_roulette: bool,

    /// True if the names of objects are needed. Set by the program.
    #[arg(skip)]
    pub needs_names: bool,

    /// True if layers need the surfaces of the scene. Set by the program.
    #[arg(skip)]
    pub needs_surfaces: bool,

    /// Source of random numbers (default: sobol; with a goal such as --budget: the better one).
    #[arg(help_heading = "Samples", long, value_enum)]
    pub sampler: Option<Sampler>,

    /// Connect paths to lights (next-event estimation with multiple importance sampling). Off,
    /// paths find lights by chance, and lights without extent stay dark.
    #[arg(help_heading = "Samples", long, value_enum, default_value_t = Switch::On)]
    pub light_sampling: Switch,

    /// Maximum radiance of a sample per channel, above 0: less noise from rare bright paths, but a
    /// darker image (biased; default: none).
    #[arg(help_heading = "Samples", long, value_name = "X")]
    pub clamp: Option<f32>,

    /// Effort of building the BVH (default: high up to 100,000 primitives, else medium).
    #[arg(help_heading = "Kernels and trees", long, value_enum)]
    pub bvh_quality: Option<BvhQuality>,

    /// Meshes that several objects place: stored once and traced through their transforms, or
    /// copied for each object, which is faster; affects the image by rounding only. Auto shares a
    /// mesh if its copies would have a million triangles more.
    #[arg(help_heading = "Kernels and trees", long, value_enum, default_value_t = SharingArg::Auto)]
    pub instances: SharingArg,

    /// Method of finding the closest hit; does not affect the image (default: the fastest on the
    /// backend).
    #[arg(help_heading = "Kernels and trees", long, value_enum)]
    pub traversal: Option<Traversal>,

    /// Assignment of samples to the lanes of the device; does not affect the image (default: the
    /// fastest on the backend).
    #[arg(help_heading = "Kernels and trees", long, value_enum)]
    pub schedule: Option<Schedule>,

    /// Tile size in pixels for camera-ray BVH pruning: a power of two from 4 to 1024, or 0 for
    /// none; does not affect the image (default: 8 from 64 samples per pixel on, else 16; none with
    /// planar shapes, triangles, lights, environment maps or textures, and none while the camera
    /// moves).
    #[arg(help_heading = "Kernels and trees", long, value_name = "PIXELS")]
    pub tile: Option<u32>,

    /// Place where chunks of 256 samples add up; does not affect the image. Auto is the device, for
    /// several chunks on a GPU with enough memory.
    #[arg(help_heading = "Kernels and trees", long, value_enum, default_value_t = Summation::Auto)]
    pub sums: Summation,

    /// Features of the kernel, to measure what they cost: names as --stats has them, with commas
    /// between them; after a `+`, in addition to those needed; `all`; does not affect the image
    /// (default: those that scene and options need).
    #[arg(help_heading = "Kernels and trees", long, value_name = "NAMES")]
    pub features: Option<KernelFeatures>,

    /// Build of the kernels; fast is available on cuda and wgpu.
    #[arg(help_heading = "Kernels and trees", long, value_enum, default_value_t = MathMode::Precise)]
    pub math: MathMode,

    /// Exit with code 4 before rendering if there are warnings about the scene or the options.
    #[arg(help_heading = "Messages", long)]
    pub deny_warnings: bool,
}

/// Values of `--instances`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SharingArg {
    /// Share large meshes.
    Auto,
    /// Share each mesh that can be shared, even with one instance. Meshes that emit are copied.
    Share,
    /// Copy all meshes.
    Copy,
}

impl From<SharingArg> for Sharing {
    fn from(sharing: SharingArg) -> Self {
        match sharing {
            SharingArg::Auto => Self::Auto,
            SharingArg::Share => Self::Always,
            SharingArg::Copy => Self::Never,
        }
    }
}

impl JobArgs {
    /// Returns whether the scene is a model without a scene file.
    pub fn shows_model(&self) -> bool {
        self.scene.as_deref().is_some_and(is_model)
    }

    /// Returns these options for another scene: without those that are for a scene's own camera,
    /// fields and animations.
    #[cfg(feature = "window")]
    pub fn of_scene(&self, scene: PathBuf) -> Self {
        let load = LoadArgs { set: Vec::new(), model: ModelArgs::default(), ..self.load.clone() };
        Self { scene: Some(scene), load, camera: CameraArgs::default(), ..self.clone() }
    }

    /// Returns the choice of the exposure; `given` is the value of `--exposure`, in stops.
    pub fn exposure(&self, given: Option<f32>) -> Exposure {
        match given {
            Some(stops) => Exposure::Stops(stops),
            None if self.shows_model() => Exposure::Automatic(self.load.surroundings.light_level()),
            None => Exposure::Stops(0.0),
        }
    }

    /// Returns whether the options turn roulette on: a segment at which it begins does.
    pub fn uses_roulette(&self) -> bool {
        self.roulette.map_or(self.roulette_depth.is_some(), |switch| switch == Switch::On)
    }

    /// Returns the settings of the part of an image that is to be rendered.
    ///
    /// # Errors
    ///
    /// [`SettingsError::NoSuchCrop`] for a part that is empty or beyond the image.
    pub fn cropped(&self, whole: Settings) -> Result<Settings, SettingsError> {
        self.crop.map_or(Ok(whole.clone()), |crop| crop.of(whole))
    }

    /// Returns the settings of the render: those of the command line, and the scene's for the rest.
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
            crop: None,
            samples: self.spp.unwrap_or(scene.samples),
            depth: self.depth.unwrap_or(scene.depth),
            seed: self.seed.unwrap_or(scene.seed),
            roulette: self.uses_roulette(),
            roulette_depth: self.roulette_depth.unwrap_or(scene.roulette_depth),
            sampler: self.sampler.unwrap_or(scene.sampler),
            light_sampling: self.light_sampling == Switch::On,
            clamp: self.clamp,
            math: self.math,
            traversal: self.traversal,
            schedule: self.schedule,
            sums: self.sums,
            tile: self.tile,
            features: self.features.unwrap_or_default(),
            ..scene
        }
    }
}
