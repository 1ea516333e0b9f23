//! Denoising: filters with their parameters, the passes (kernel launches) that they consist of, and
//! Open Image Denoise.
//!
//! A [`Renderer`](crate::render::Renderer) runs the passes on a device, over a film or over live
//! frames. The kernels are in [`trisect_shared::denoise`].

mod denoiser;
mod error;
pub mod oidn;
mod passes;
mod temporal;
mod view;

pub use denoiser::Denoiser;
pub use error::DenoiseError;
pub use passes::{Kernel, Pass};
pub(crate) use passes::{history_passes, passes, reach, store_pass};
pub use temporal::TemporalSettings;
pub(crate) use temporal::{FrameSums, HistoryUse, TemporalInputs};
pub(crate) use view::{FrameView, MIN_VARIANCE_SAMPLES};

use crate::film::{Film, TASK};
use rayon::prelude::*;
use serde::Serialize;
use std::ops::RangeInclusive;
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{DenoiseParams, FilteredPixel, STOP_FACTORS};
use trisect_shared::film::PixelSums;

/// Numbers of levels that a filter can have; the tenth has taps 512 pixels apart.
pub const LEVELS: RangeInclusive<u32> = 1..=10;

/// Filter of the denoiser. The filters differ in how they separate noise from edges of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Filter {
    /// À-trous filter with a fixed maximum difference of colours, halved from level to level
    /// (Dammertz et al. 2010).
    Atrous,
    /// Spatial part of SVGF: a maximum difference relative to the standard deviation of the pixel
    /// (Schied et al. 2017).
    Svgf,
}

/// Filter and its parameters. `color`, `normal` and `depth` are distances for edge stopping: a
/// neighbour at this distance keeps a quarter of its weight, and none beyond 1.4 times that.
/// With 0 only equal neighbours count, with infinity all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DenoiseSettings {
    /// Filter.
    pub filter: Filter,
    /// Number of levels. Taps are 1 pixel apart in the first level, and twice as far in each
    /// further one.
    pub levels: u32,
    /// Distance of the colour, which is reflected radiance over albedo: absolute
    /// ([`Filter::Atrous`], first level), or in standard deviations ([`Filter::Svgf`]).
    #[serde(serialize_with = "number_or_inf")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "number_or_inf_schema"))]
    pub color: f32,
    /// Angle between the normals, in degrees.
    #[serde(serialize_with = "number_or_inf")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "number_or_inf_schema"))]
    pub normal: f32,
    /// Distance from the tangent plane, relative to the depth; in a parallel projection, relative
    /// to the height of the view.
    #[serde(serialize_with = "number_or_inf")]
    #[cfg_attr(feature = "schema", schemars(schema_with = "number_or_inf_schema"))]
    pub depth: f32,
}

/// A filter with its default parameters.
impl From<Filter> for DenoiseSettings {
    fn from(filter: Filter) -> Self {
        Self::new(filter)
    }
}

impl DenoiseSettings {
    /// Returns a filter with its default parameters (docs/notebook/denoising.md).
    pub const fn new(filter: Filter) -> Self {
        match filter {
            Filter::Atrous => Self { filter, levels: 5, color: 2.0, normal: 20.0, depth: 0.02 },
            Filter::Svgf => Self { filter, levels: 5, color: 6.0, normal: 30.0, depth: 0.02 },
        }
    }

    /// Checks that the parameters are in range.
    ///
    /// # Errors
    ///
    /// [`DenoiseError`] names the one that is not.
    pub fn check(&self) -> Result<(), DenoiseError> {
        if !LEVELS.contains(&self.levels) {
            return Err(DenoiseError::Levels { levels: self.levels });
        }
        let parameters =
            [("denoise_color", self.color), ("denoise_normal", self.normal), ("denoise_depth", self.depth)];
        match parameters.into_iter().find(|(_, value)| value.is_nan() || *value < 0.0) {
            Some((name, value)) => Err(DenoiseError::Parameter { name, value: value.to_string() }),
            None => Ok(()),
        }
    }

    /// Returns launch parameters of an image, with this edge stopping.
    fn params(&self, image: &FrameView) -> DenoiseParams {
        let cosine = f64::from(self.normal.min(180.0)).to_radians().cos();
        DenoiseParams {
            color_factor: stop_factor(f64::from(self.color).powi(2)),
            normal_factor: stop_factor(if self.normal.is_finite() { 1.0 - cosine } else { f64::INFINITY }),
            depth_factor: image.depth_factor(self.depth),
            ..image.params()
        }
    }
}

/// Serialises a number, or "inf", because JSON has no infinity.
fn number_or_inf<S: serde::Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { serializer.serialize_f32(*value) } else { serializer.serialize_str("inf") }
}

/// Returns the schema of a number, or "inf".
#[cfg(feature = "schema")]
fn number_or_inf_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schemars::json_schema!({ "anyOf": [{ "type": "number" }, { "const": "inf" }] })
}

/// Returns the factor of a squared distance in edge stopping, in range for the kernels: 0.5 over
/// `through`, the squared distance at which a quarter of the weight is left.
fn stop_factor(through: f64) -> f32 {
    ((0.5 / through) as f32).clamp(STOP_FACTORS.0, STOP_FACTORS.1)
}

/// Checks that a film can be denoised.
///
/// # Errors
///
/// [`DenoiseError::NoAovs`] for a film without AOV sums.
pub fn check_has_aovs(film: &Film) -> Result<(), DenoiseError> {
    if film.aovs.len() == film.pixels.len() { Ok(()) } else { Err(DenoiseError::NoAovs) }
}

/// Writes the sums and AOV sums of each pixel of a film in the kernels' format, over all its
/// chunks.
pub fn sums(film: &Film, sums: &mut [PixelSums], guides: &mut [AovSums]) {
    film.pixels.for_each_with(sums, |sums, pixel| *sums = pixel.sums());
    film.aovs.for_each_with(guides, |sums, guides| *sums = guides.sums());
}

/// Converts the last pass's pixels to an image; NaN where neither the pixel nor any within reach of
/// the filter has a colour.
pub fn image(width: u32, height: u32, pixels: &[FilteredPixel]) -> Image {
    let color = |pixel: &FilteredPixel| if pixel.is_known() { pixel.color.to_array() } else { [f32::NAN; 3] };
    Image { width, height, pixels: pixels.par_iter().with_min_len(TASK).map(color).collect() }
}

#[cfg(test)]
mod tests;
