//! Measures Open Image Denoise on a finished image.

use super::live::{Values, rows};
use super::{Row, WarmUp};
use crate::Error;
use std::time::Instant;
use trisect::denoise::Denoiser;
use trisect::render::{Renderer, Settings};

/// Names of the steps, in the order of their times.
const STEPS: [&str; 3] = ["denoise the albedo", "denoise the normal", "denoise the radiance"];

/// Denoises one image `frames` times. Returns one row per step, and the whole time with opening the
/// device and copying the images, in milliseconds by wall clock.
///
/// # Errors
///
/// Errors of [`Renderer::render`] and [`Renderer::denoise`].
pub fn measure_oidn(
    renderer: &mut Renderer,
    settings: &Settings,
    warm_up: WarmUp,
    frames: u32,
) -> Result<Vec<Row>, Error> {
    let settings = Settings { guides: true, denoise: None, ..settings.clone() };
    let film = renderer.render(&settings)?.film;
    let mut frame = || {
        let start = Instant::now();
        let (_, times) = renderer.denoise(&film, &settings, Denoiser::Oidn)?;
        let whole = start.elapsed();
        let steps = STEPS.into_iter().zip(times);
        Ok::<Values, Error>(
            steps
                .chain([("denoise", whole)])
                .map(|(name, time)| (name.to_owned(), "ms", time.as_secs_f64() * 1e3))
                .collect(),
        )
    };
    for _ in 0..warm_up.frames {
        frame()?;
    }
    Ok(rows(&(0..frames).map(|_| frame()).collect::<Result<Vec<_>, _>>()?))
}
