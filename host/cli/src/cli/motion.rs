//! Options of images of a scene that moves: numbered images, and motion blur.

use clap::Args;
use std::ops::Range;
use std::path::PathBuf;

/// Frames per second, unless `--fps` is given.
const DEFAULT_FPS: f64 = 24.0;

/// Maximum frames per second.
const MAX_FPS: f64 = 1e6;

/// Options of images of a scene that moves.
#[derive(Clone, Debug, Default, Args)]
pub struct MotionArgs {
    /// Render frames FIRST to END - 1 of the animation of glTF models to numbered images:
    /// out.0000.png for out.png, or where the file's name has %04d. Frame K shows the time --time +
    /// K / --fps (default: one image).
    #[arg(help_heading = "Animation", long, value_name = "FIRST..END", value_parser = parse_frames)]
    pub frames: Option<Frames>,

    /// Render numbered images along the camera path of this file, one for each of its frames or of
    /// --frames, in place of the scene's camera; see docs/how-to/camera-paths.md.
    #[arg(help_heading = "Animation", long, value_name = "FILE")]
    pub camera_path: Option<PathBuf>,

    /// Frames per second of --frames and --shutter, a number or a fraction such as 30000/1001
    /// (default: 24).
    #[arg(help_heading = "Animation", long, value_name = "N", value_parser = parse_fps)]
    pub fps: Option<f64>,

    /// Motion blur: share of a frame's duration, 1 / --fps, for which the shutter is open, from the
    /// time of the image on; 0 to 1 (default: 0, a sharp image).
    #[arg(help_heading = "Animation", long, value_name = "SHARE", value_parser = parse_share)]
    pub shutter: Option<f64>,

    /// With --shutter: number of moments over which the samples of a pixel are divided; the image
    /// is the mean of as many sharp ones (biased; default: 16, or --spp if that is less).
    #[arg(help_heading = "Animation", long, value_name = "N", value_parser = super::parse_count, requires = "shutter")]
    pub shutter_steps: Option<u32>,
}

/// Value of `--frames`: range of frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(pub Range<u32>);

impl MotionArgs {
    /// Returns whether the command renders images of a scene that moves.
    pub fn moves(&self) -> bool {
        self.option().is_some()
    }

    /// Returns the first given option for images of a scene or a camera that moves.
    pub fn option(&self) -> Option<&'static str> {
        let given = [
            ("--camera-path", self.camera_path.is_some()),
            ("--frames", self.frames.is_some()),
            ("--shutter", self.shutter.is_some()),
        ];
        given.into_iter().find(|given| given.1).map(|given| given.0)
    }

    /// Returns the number of frames per second.
    pub fn fps(&self) -> f64 {
        self.fps.unwrap_or(DEFAULT_FPS)
    }

    /// Returns a warning if `--fps` has no effect.
    pub fn without_effect(&self) -> Option<&'static str> {
        (self.fps.is_some() && !self.moves())
            .then_some("--fps has no effect without --frames or --shutter; add one of them")
    }
}

fn parse_frames(text: &str) -> Result<Frames, String> {
    let (first, end) = text.split_once("..").ok_or("write it as FIRST..END, such as 0..120")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|error| format!("{text}: {error}"));
    let (first, end) = (number(first)?, number(end)?);
    if first >= end { Err(format!("{first} is not before {end}")) } else { Ok(Frames(first..end)) }
}

fn parse_fps(text: &str) -> Result<f64, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let rate = match text.split_once('/') {
        Some((frames, seconds)) => number(frames).zip(number(seconds)).map(|(a, b)| a / b),
        None => number(text),
    };
    let rate = rate.filter(|rate| *rate > 0.0 && *rate <= MAX_FPS);
    rate.ok_or_else(|| format!("must be a number such as 30 or 30000/1001, above 0 and at most {MAX_FPS}"))
}

fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("must be a number from 0 to 1, such as 0.5".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_rates() {
        assert_eq!(parse_frames("0..120"), Ok(Frames(0..120)));
        for bad in ["", "120", "0", "5..5", "9..3", "-1..2", "0..=4", "0..x", "0.."] {
            assert!(parse_frames(bad).is_err(), "{bad}");
        }
        assert_eq!((parse_fps("30"), parse_fps("0.5")), (Ok(30.0), Ok(0.5)));
        assert_eq!(parse_fps("30000/1001"), Ok(30000.0 / 1001.0));
        for bad in ["", "0", "-24", "nan", "inf", "24/0", "0/1", "1e7", "24 fps"] {
            assert!(parse_fps(bad).is_err(), "{bad}");
        }
        assert_eq!((parse_share("0"), parse_share("0.5"), parse_share("1")), (Ok(0.0), Ok(0.5), Ok(1.0)));
        for bad in ["", "1.01", "-0.1", "nan", "180"] {
            assert!(parse_share(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_rate_without_motion_is_named() {
        let rate = MotionArgs { fps: Some(30.0), ..MotionArgs::default() };
        assert!(rate.without_effect().is_some_and(|line| line.starts_with("--fps has no effect")));
        let moving = MotionArgs { frames: Some(Frames(0..1)), ..rate };
        assert!(moving.without_effect().is_none() && moving.moves());
    }
}
