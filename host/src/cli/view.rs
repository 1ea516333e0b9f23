//! `trisect view`.

use super::{ClusterArgs, DenoiseArgs, JobArgs, parse_count, parse_stops};
use clap::Args;
use std::path::PathBuf;
use trisect::denoise::TemporalSettings;
use trisect::render::DisplayOptions;

/// `trisect view`.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// What and where; --spp are those of one frame, without it 1.
    #[command(flatten)]
    pub job: JobArgs,

    /// Denoising.
    #[command(flatten)]
    pub denoise: DenoiseArgs,

    /// Frames that what was seen before counts for, at most, while the camera moves; 0 forgets it.
    #[arg(long, value_name = "N", default_value_t = TemporalSettings::DEFAULT.frames)]
    pub history: u32,

    /// Take what was seen before within so many standard deviations of what a pixel's neighbours show now; inf takes it as it is.
    #[arg(long, value_name = "X", default_value_t = TemporalSettings::DEFAULT.clamp)]
    pub history_clamp: f32,

    /// Render a smaller image, this share of both sides, and enlarge it.
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = parse_scale)]
    pub scale: f64,

    /// Samples a pixel from which on an image that rests is finished.
    #[arg(long, value_name = "N", default_value = "4096", value_parser = parse_count)]
    pub enough: u32,

    /// Share of the width, from the left, that shows the image without denoising.
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = parse_share)]
    pub split: f64,

    /// Exposure: each stop doubles the light (default: 0; for a model by itself by its median
    /// luminance).
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_stops)]
    pub exposure: Option<f32>,

    /// No window: render --frames frames and print what they take.
    #[arg(long)]
    pub headless: bool,

    /// With --headless: how many; without it, as many as the camera's path has, or 10.
    #[arg(long, value_name = "N", requires = "headless", value_parser = parse_count)]
    pub frames: Option<u32>,

    /// With --headless: poses at frames (docs/viewer.md); without it, the camera rests.
    #[arg(long, value_name = "FILE", requires = "headless")]
    pub camera_path: Option<PathBuf>,

    /// With --headless: write the frames into this folder as 0000.png, 0001.png and so on.
    #[arg(short, long, value_name = "DIR", requires = "headless")]
    pub output: Option<PathBuf>,

    /// With --headless: write what was measured as JSON, too; `-` prints it in place of the table.
    #[arg(long, value_name = "FILE", requires = "headless")]
    pub json: Option<PathBuf>,

    /// With --headless: several processes, each a band of rows.
    #[command(flatten)]
    pub cluster: ClusterArgs,
}

impl ViewArgs {
    /// For the library.
    pub fn history(&self) -> TemporalSettings {
        TemporalSettings { frames: self.history, clamp: self.history_clamp }
    }

    /// For the library; without an automatic exposure.
    pub fn screen(&self) -> DisplayOptions {
        DisplayOptions { split: self.split, stops: self.exposure.unwrap_or(0.0) }
    }
}

fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("must be a number between 0 and 1".to_owned()),
    }
}

fn parse_scale(text: &str) -> Result<f64, String> {
    let least = trisect::view::MIN_SCALE;
    match text.parse::<f64>() {
        Ok(scale) if (least..=1.0).contains(&scale) => Ok(scale),
        _ => Err(format!("must be a number between {least} and 1")),
    }
}
