//! `trisect render`.

use super::{CheckpointArgs, ClusterArgs, DenoiseArgs, GoalArgs, JobArgs, LogArgs, parse_stops};
use clap::Args;
use std::path::PathBuf;
use trisect::output::exposure::Exposure;
use trisect::output::layers::Aov;

/// `trisect render`.
#[derive(Clone, Debug, Args)]
pub struct RenderArgs {
    /// What and where.
    #[command(flatten)]
    pub job: JobArgs,

    /// Denoising.
    #[command(flatten)]
    pub denoise: DenoiseArgs,

    /// When to stop.
    #[command(flatten)]
    pub goal: GoalArgs,

    /// Not to lose it.
    #[command(flatten)]
    pub checkpointing: CheckpointArgs,

    /// Layers of what the pixels see, beside the image, in an .exr: normal, position, albedo, depth, id, variance, samples; several
    /// with commas between.
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', value_parser = parse_aov)]
    pub aov: Vec<Aov>,

    /// Image file: .png (sRGB), .exr, .hdr or .pfm (linear).
    #[arg(short, long, value_name = "FILE", default_value = "out.png")]
    pub output: PathBuf,

    /// Exposure of the image file: each stop doubles the light (default: 0; for a model by itself,
    /// in a .png, by its median luminance).
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_stops)]
    pub exposure: Option<f32>,

    /// What is said of it.
    #[command(flatten)]
    pub log: LogArgs,

    /// Several processes.
    #[command(flatten)]
    pub cluster: ClusterArgs,
}

impl RenderArgs {
    /// Returns how the exposure of the image file is chosen.
    pub fn exposure(&self) -> Exposure {
        self.job.exposure(self.exposure)
    }
}

fn parse_aov(text: &str) -> Result<Aov, String> {
    Aov::ALL.into_iter().find(|(name, _)| *name == text).map(|(_, aov)| aov).ok_or_else(|| {
        let names: Vec<&str> = Aov::ALL.into_iter().map(|(name, _)| name).collect();
        format!("there are {}", names.join(", "))
    })
}
