//! Arguments of `trisect view`.

use super::{ClusterArgs, DenoiseArgs, JobArgs, parse_count, parse_stops};
use clap::Args;
use std::path::PathBuf;
use trisect::denoise::TemporalSettings;
use trisect::render::DisplayOptions;

/// Arguments of `trisect view`.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// Scene, settings and device; `--spp` is that of one frame, 1 by default.
    #[command(flatten)]
    pub job: JobArgs,

    /// Filter of the frames.
    #[command(flatten)]
    pub denoise: DenoiseArgs,

    /// Maximum number of frames that earlier frames count for while the camera moves; 0 discards
    /// them.
    #[arg(help_heading = "Frames", long, value_name = "N", default_value_t = TemporalSettings::DEFAULT.frames)]
    pub history: u32,

    /// Clamp the light of earlier frames to within X standard deviations of a pixel's neighbourhood
    /// in the current frame; inf disables the clamp.
    #[arg(help_heading = "Frames", long, value_name = "X", default_value_t = TemporalSettings::DEFAULT.clamp)]
    pub history_clamp: f32,

    /// Scale of width and height of the rendered frame; the window enlarges it, files of --headless
    /// are smaller.
    #[arg(help_heading = "Frames", long, value_name = "X", default_value_t = 1.0, value_parser = parse_scale)]
    pub scale: f64,

    /// Frames a second to keep while the camera moves, by a lower resolution; 0 keeps the full one
    /// (default: 10 in a window, 0 with --headless). A camera at rest has the full resolution.
    #[arg(help_heading = "Frames", long, value_name = "FPS", value_parser = parse_fps, conflicts_with = "output")]
    pub moving_fps: Option<f64>,

    /// In a window: samples per pixel at which an image at rest is finished.
    #[arg(help_heading = "Frames", long, value_name = "N", default_value = "4096", value_parser = parse_count)]
    pub enough: u32,

    /// Share of the width, from the left, that shows the image without the filter: 0 to 1.
    #[arg(help_heading = "Frames", long, value_name = "X", default_value_t = 0.0, value_parser = parse_share)]
    pub split: f64,

    /// Exposure in stops; each doubles the radiance (default: 0; for a model without a scene file,
    /// by the median luminance).
    #[arg(help_heading = "Frames", long, value_name = "STOPS", allow_negative_numbers = true, value_parser = parse_stops)]
    pub exposure: Option<f32>,

    /// Render frames without a window and print their times.
    #[arg(help_heading = "Frames", long)]
    pub headless: bool,

    /// With --headless: number of frames (default: up to the last key of --camera-path, else 10).
    #[arg(help_heading = "Frames", long, value_name = "N", requires = "headless", value_parser = parse_count)]
    pub frames: Option<u32>,

    /// With --headless: file of camera poses at frames, see docs/how-to/camera-paths.md (default:
    /// the camera rests).
    #[arg(help_heading = "Frames", long, value_name = "FILE", requires = "headless")]
    pub camera_path: Option<PathBuf>,

    /// With --headless: folder for the frames, 0000.png, 0001.png and so on; created if it does not
    /// exist (default: none are written).
    #[arg(help_heading = "Frames", short, long, value_name = "DIR", requires = "headless")]
    pub output: Option<PathBuf>,

    /// With --headless: print the times as JSON instead of the table; --json=FILE writes them to a
    /// file, beside the table.
    #[arg(
        help_heading = "Frames",
        long,
        value_name = "FILE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "-",
        requires = "headless"
    )]
    pub json: Option<PathBuf>,

    /// Options for several processes, each of which renders a band of rows; with `--headless`.
    #[command(flatten)]
    pub cluster: ClusterArgs,
}

impl ViewArgs {
    /// Returns the settings of the history.
    pub fn history(&self) -> TemporalSettings {
        TemporalSettings { frames: self.history, clamp: self.history_clamp }
    }

    /// Returns the display options, with 0 stops if no exposure is given.
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

fn parse_fps(text: &str) -> Result<f64, String> {
    let fps: f64 = text.parse().unwrap_or(f64::NAN);
    if (0.0..=1000.0).contains(&fps) {
        Ok(fps)
    } else {
        Err("must be a number between 0 and 1000".to_owned())
    }
}

fn parse_scale(text: &str) -> Result<f64, String> {
    let least = trisect::view::MIN_SCALE;
    match text.parse::<f64>() {
        Ok(scale) if (least..=1.0).contains(&scale) => Ok(scale),
        _ => Err(format!("must be a number between {least} and 1")),
    }
}
