//! Arguments of `trisect render`.

use super::background::{Background, parse_background};
use super::{CheckpointArgs, ClusterArgs, DenoiseArgs, GoalArgs, JobArgs, LogArgs, MotionArgs, parse_stops};
use clap::Args;
use std::path::PathBuf;
use trisect::adaptive::Request;
use trisect::denoise::DenoiseError;
use trisect::layers::Aov;
use trisect::output::ToneMap;
use trisect::output::exposure::Exposure;

/// Arguments of `trisect render`.
#[derive(Clone, Debug, Args)]
pub struct RenderArgs {
    /// Scene, settings and device.
    #[command(flatten)]
    pub job: JobArgs,

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

    /// Additional layers of an .exr, separated by commas: normal, position, albedo, depth, id,
    /// variance, samples. Position and depth are in scene units (default: none).
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', value_parser = parse_aov)]
    pub aov: Vec<Aov>,

    /// Background where camera rays reach the sky, which lights the scene in any case: sky,
    /// transparent (.png and .exr), or a colour, linear R,G,B or #rrggbb in sRGB.
    #[arg(long, value_name = "sky|transparent|COLOUR", default_value = "sky", value_parser = parse_background)]
    pub background: Background,

    /// Image file: .png (sRGB), .exr, .hdr or .pfm (linear).
    #[arg(short, long, value_name = "FILE", default_value = "out.png")]
    pub output: PathBuf,

    /// Exposure of the image file in stops; each doubles the radiance (default: 0; for a model
    /// without a scene file, in a .png, by the median luminance).
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_stops)]
    pub exposure: Option<f32>,

    /// Curve from exposed radiance to the range of a display, for a .png: none (clipped at 1),
    /// filmic, agx or aces.
    #[arg(long, value_name = "CURVE", default_value = "none", value_parser = parse_tone_map)]
    pub tonemap: ToneMap,

    /// Messages and statistics.
    #[command(flatten)]
    pub log: LogArgs,

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
        self.job.exposure(self.exposure)
    }
}

/// Parses the name of a tone map.
pub fn parse_tone_map(text: &str) -> Result<ToneMap, String> {
    ToneMap::ALL.into_iter().find(|(name, _)| *name == text).map(|(_, of)| of).ok_or_else(|| {
        let names: Vec<&str> = ToneMap::ALL.into_iter().map(|(name, _)| name).collect();
        format!("unknown curve; available: {}", names.join(", "))
    })
}

fn parse_aov(text: &str) -> Result<Aov, String> {
    Aov::ALL.into_iter().find(|(name, _)| *name == text).map(|(_, aov)| aov).ok_or_else(|| {
        let names: Vec<&str> = Aov::ALL.into_iter().map(|(name, _)| name).collect();
        format!("unknown layer; available: {}", names.join(", "))
    })
}
