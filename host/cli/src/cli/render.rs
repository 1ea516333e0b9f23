//! Arguments of `trisect render`.

use super::background::{Background, parse_background};
use super::crop::{CropWindow, parse_crop};
use super::{
    CheckpointArgs, ClusterArgs, DenoiseArgs, GoalArgs, ImageFileArgs, JobArgs, LogArgs, MotionArgs,
    PreviewArgs,
};
use clap::Args;
use std::path::PathBuf;
use trisect::adaptive::Request;
use trisect::denoise::DenoiseError;
use trisect::layers::Aov;
use trisect::output::exposure::Exposure;
use trisect::scene::LightGroup;

/// Image file, unless `--output` names one.
pub const DEFAULT_OUTPUT: &str = "out.png";

/// Arguments of `trisect render`.
#[derive(Clone, Debug, Args)]
pub struct RenderArgs {
    /// Scene, settings and device.
    #[command(flatten)]
    pub job: JobArgs,

    /// Further scenes, rendered one after another. In the names of --output and --stats, {scene}
    /// then stands for the name of the scene's file without its extension (default of --output:
    /// {scene}.png).
    #[arg(value_name = "SCENES")]
    pub more: Vec<PathBuf>,

    /// Numbered images, and motion blur.
    #[command(flatten)]
    pub motion: MotionArgs,

    /// Filter of the image.
    #[command(flatten)]
    pub denoise: DenoiseArgs,

    /// Goal in place of a number of samples.
    #[command(flatten)]
    pub goal: GoalArgs,

    /// Checkpoints, time limit and fallback.
    #[command(flatten)]
    pub checkpointing: CheckpointArgs,

    /// Render this part of the image alone, from its upper left to its lower right corner: shares
    /// of width and height, such as 0.25,0,0.75,0.5, or pixels. An .exr keeps its place in the
    /// whole (default: the whole image).
    #[arg(help_heading = "Image", long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true, value_parser = parse_crop)]
    pub crop: Option<CropWindow>,

    /// Additional layers of an .exr, separated by commas: normal (or shading-normal),
    /// geometric-normal, position, albedo, depth, id, variance, samples, uv (texture coordinates),
    /// motion (to the frames before and after, with --frames or --camera-path), cryptomatte (mattes
    /// of objects and materials). Position and depth are in scene units (default: none).
    #[arg(help_heading = "Image file", long, value_name = "LAYERS", value_delimiter = ',', value_parser = parse_aov)]
    pub aov: Vec<Aov>,

    /// Also render the light of a group of lights apart, as the layer light_NAME of an .exr; may be
    /// given several times, and lights in no group are the layer light_rest. Each layer takes as
    /// long as the image. LIGHT is the name of an object that emits, `lights[0]` and so on for
    /// lights without extent, or sky; a name may end in * (default: none).
    #[arg(help_heading = "Image file", long, value_name = "NAME=LIGHT,LIGHT")]
    pub light_group: Vec<LightGroup>,

    /// Background where camera rays reach the sky, which lights the scene in any case: sky,
    /// transparent (.png, .tif and .exr), or a colour, linear R,G,B or #rrggbb in sRGB.
    #[arg(help_heading = "Image file", long, value_name = "sky|transparent|COLOUR", default_value = "sky", value_parser = parse_background)]
    pub background: Background,

    /// Image file: .png, .jpg or .tif (for a display), .exr, .hdr or .pfm (linear); - writes a .png
    /// to standard output, exr:- an .exr.
    #[arg(help_heading = "Image file", short, long, value_name = "FILE", default_value = DEFAULT_OUTPUT)]
    pub output: PathBuf,

    /// Encoding of the image file.
    #[command(flatten)]
    pub file: ImageFileArgs,

    /// Messages and statistics.
    #[command(flatten)]
    pub log: LogArgs,

    /// Live preview.
    #[command(flatten)]
    pub preview: PreviewArgs,

    /// Options for several processes.
    #[command(flatten)]
    pub cluster: ClusterArgs,
}

impl RenderArgs {
    /// Returns the goal with the settings that it may choose, or `None` without a goal.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] for invalid parameters of the filter.
    pub fn request(&self) -> Result<Option<Request>, DenoiseError> {
        self.goal.request(&self.job, &self.denoise)
    }

    /// Returns the choice of the exposure of the image file.
    pub fn exposure(&self) -> Exposure {
        self.job.exposure(self.file.exposure)
    }
}

fn parse_aov(text: &str) -> Result<Aov, String> {
    Aov::ALL.into_iter().find(|(name, _)| *name == text).map(|(_, aov)| aov).ok_or_else(|| {
        let names: Vec<&str> = Aov::ALL.into_iter().map(|(name, _)| name).collect();
        format!("unknown layer; available: {}", names.join(", "))
    })
}
