//! Denoising: which filter with what parameters, and the passes that it takes on a device.

mod error;
mod passes;
mod temporal;
mod view;

pub use error::DenoiseError;
pub use passes::{DisplayLaunch, Kernel, Pass};
pub(crate) use passes::{FrameView, passes, reach, store_pass};
pub(crate) use temporal::TemporalInputs;
pub use temporal::TemporalSettings;

use crate::film::{Film, TASK};
use crate::image::Image;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::RangeInclusive;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{DenoiseParams, FilteredPixel, STOP_FACTORS};
use trisect_shared::film::PixelSums;

/// Levels that a filter can have: the last of ten has taps 512 pixels apart.
pub const LEVELS: RangeInclusive<u32> = 1..=10;

/// What stops at noise, and what at edges in the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Filter {
    /// A fixed difference of colours, halved from level to level (Dammertz et al. 2010).
    Atrous,
    /// A difference relative to the standard deviation of the pixel (the spatial part of SVGF, Schied et al. 2017).
    Svgf,
}

/// A filter and its parameters. A stop lets a quarter of a neighbour through that is as different as the parameter says, and nothing beyond 1.4
/// times that; 0 lets only what is equal through, infinity everything.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DenoiseSettings {
    /// Which.
    pub filter: Filter,
    /// Passes, from taps next to each other on, each twice as far apart.
    pub levels: u32,
    /// Of the colour over the albedo: a distance in radiance ([`Filter::Atrous`]), or in standard deviations ([`Filter::Svgf`]).
    #[serde(serialize_with = "number_or_inf")]
    pub color: f32,
    /// Of the normals: an angle in degrees.
    #[serde(serialize_with = "number_or_inf")]
    pub normal: f32,
    /// Distance from the tangent plane, relative to the depth.
    #[serde(serialize_with = "number_or_inf")]
    pub depth: f32,
}

impl DenoiseSettings {
    /// With the parameters that docs/performance.md shows to be good.
    pub const fn new(filter: Filter) -> Self {
        match filter {
            Filter::Atrous => Self { filter, levels: 5, color: 2.0, normal: 20.0, depth: 0.02 },
            Filter::Svgf => Self { filter, levels: 5, color: 6.0, normal: 30.0, depth: 0.02 },
        }
    }

    /// Refuses what is no parameter.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] names it.
    pub fn check(&self) -> Result<(), DenoiseError> {
        if !LEVELS.contains(&self.levels) {
            return Err(DenoiseError::Levels { levels: self.levels });
        }
        let parameters = [("color", self.color), ("normal", self.normal), ("depth", self.depth)];
        match parameters.into_iter().find(|(_, value)| value.is_nan() || *value < 0.0) {
            Some((name, value)) => Err(DenoiseError::Parameter { name, value: value.to_string() }),
            None => Ok(()),
        }
    }

    /// The stops, for an image.
    fn params(&self, image: &FrameView) -> DenoiseParams {
        let cosine = f64::from(self.normal.min(180.0)).to_radians().cos();
        DenoiseParams {
            color_factor: stop_factor(f64::from(self.color).powi(2)),
            normal_factor: stop_factor(if self.normal.is_finite() { 1.0 - cosine } else { f64::INFINITY }),
            depth_factor: stop_factor(f64::from(self.depth).powi(2)).sqrt(),
            ..image.params()
        }
    }
}

/// JSON has no infinity.
fn number_or_inf<S: serde::Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { serializer.serialize_f32(*value) } else { serializer.serialize_str("inf") }
}

/// Half the factor of a stop: 1 over what counts as 1.
fn stop_factor(through: f64) -> f32 {
    ((0.5 / through) as f32).clamp(STOP_FACTORS.0, STOP_FACTORS.1)
}

/// Whether a film can be denoised.
///
/// # Errors
///
/// [`DenoiseError::NoAovs`] for a film that has none.
pub fn check_has_aovs(film: &Film) -> Result<(), DenoiseError> {
    if film.aovs.len() == film.pixels.len() { Ok(()) } else { Err(DenoiseError::NoAovs) }
}

/// Writes a film's sums as kernels do, but of all its chunks, pixel by pixel.
pub fn sums(film: &Film, sums: &mut [PixelSums], guides: &mut [AovSums]) {
    let pixels = sums.par_iter_mut().zip(&film.pixels).with_min_len(TASK);
    pixels.for_each(|(sums, pixel)| *sums = pixel.sums());
    let pixels = guides.par_iter_mut().zip(&film.aovs).with_min_len(TASK);
    pixels.for_each(|(sums, guides)| *sums = guides.sums());
}

/// The last pass's pixels as an image; NaN where neither a pixel nor any in reach of it has a colour.
pub fn image(width: u32, height: u32, pixels: &[FilteredPixel]) -> Image {
    let color = |pixel: &FilteredPixel| if pixel.is_known() { pixel.color.to_array() } else { [f32::NAN; 3] };
    Image { width, height, pixels: pixels.par_iter().with_min_len(TASK).map(color).collect() }
}

#[cfg(test)]
mod tests;
