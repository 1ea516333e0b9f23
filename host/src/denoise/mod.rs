//! Denoising: which filter with what parameters, and the passes that it takes on a device.

mod error;
mod view;

pub use error::DenoiseError;

use crate::backend::BackendError;
use crate::film::Film;
use crate::image::Image;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::RangeInclusive;
use trisect_kernels::workgroup;
use trisect_shared::camera::Camera;
use trisect_shared::denoise::{DenoiseParams, Lit, PIXELS, STOPS};
use trisect_shared::film::PixelSums;
use trisect_shared::guides::Guides;

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
pub struct Denoise {
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

impl Denoise {
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

    /// What a device does, one after the other, with an image of this size that `camera` sees.
    pub fn passes(&self, camera: &Camera, width: u32, height: u32) -> Vec<Pass> {
        let cosine = f64::from(self.normal.min(180.0)).to_radians().cos();
        let params = DenoiseParams {
            view: view::of(camera),
            width,
            height,
            step: 1,
            pad: 0,
            color: stop(f64::from(self.color).powi(2)),
            normal: stop(if self.normal.is_finite() { 1.0 - cosine } else { f64::INFINITY }),
            depth: stop(f64::from(self.depth).powi(2)).sqrt(),
            trusted: TRUSTED,
        };
        let mut passes = vec![Pass { kernel: Kernel::Gather, params, from: 1, to: 0 }];
        if self.filter == Filter::Svgf {
            passes.push(Pass { kernel: Kernel::Estimate, params, from: 0, to: 1 });
        }
        for level in 0..self.levels {
            let from = passes.last().map_or(0, |pass| pass.to);
            let step = 1 << level;
            let (kernel, color) = match self.filter {
                Filter::Atrous => {
                    let color = f64::from(self.color) / f64::from(step);
                    (Kernel::Atrous, stop(color * color))
                }
                Filter::Svgf => (Kernel::Svgf, params.color),
            };
            passes.push(Pass { kernel, params: DenoiseParams { step, color, ..params }, from, to: 1 - from });
        }
        let from = passes.last().map_or(0, |pass| pass.to);
        passes.push(Pass { kernel: Kernel::Finish, params, from, to: 1 - from });
        passes
    }
}

/// JSON has no infinity.
fn number_or_inf<S: serde::Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    if value.is_finite() { serializer.serialize_f32(*value) } else { serializer.serialize_str("inf") }
}

/// Samples from which on a pixel's own variance is used, as in SVGF.
const TRUSTED: u32 = 4;

/// Half the factor of a stop: 1 over what counts as 1.
fn stop(through: f64) -> f32 {
    ((0.5 / through) as f32).clamp(STOPS.0, STOPS.1)
}

/// A kernel of the denoiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// From sums to an image over its albedo, and edges.
    Gather,
    /// Variance from the neighbourhood.
    Estimate,
    /// A level with fixed stops.
    Atrous,
    /// A level with stops by variance.
    Svgf,
    /// The albedo again.
    Finish,
}

impl Kernel {
    /// All.
    pub const ALL: [Self; 5] = [Self::Gather, Self::Estimate, Self::Atrous, Self::Svgf, Self::Finish];

    /// Whether it is a level of the filter.
    pub fn is_level(self) -> bool {
        matches!(self, Self::Atrous | Self::Svgf)
    }

    /// The entry point.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gather => "denoise_gather",
            Self::Estimate => "denoise_estimate",
            Self::Atrous => "denoise_atrous",
            Self::Svgf => "denoise_svgf",
            Self::Finish => "denoise_finish",
        }
    }
}

/// A launch over all pixels: from one of two images to the other. Only [`Denoise::passes`] makes them, the first a gathering one: kernels trust
/// their sizes, and that what they read was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass {
    /// What.
    pub(crate) kernel: Kernel,
    /// With what.
    pub(crate) params: DenoiseParams,
    /// The image that it reads, 0 or 1.
    pub(crate) from: usize,
    /// The other.
    pub(crate) to: usize,
}

impl Pass {
    /// Threads across and down.
    pub fn threads(&self) -> (u32, u32) {
        let DenoiseParams { width, height, step, .. } = self.params;
        let rows = if self.kernel.is_level() { height.div_ceil(PIXELS * step) * step } else { height };
        (width, rows)
    }

    /// Refuses more work groups than a launch has.
    pub(crate) fn check_groups(&self, backend: &'static str, limit: u32) -> Result<(), BackendError> {
        let (across, down) = self.groups();
        if across.max(down) <= limit {
            return Ok(());
        }
        let DenoiseParams { width, height, .. } = self.params;
        Err(BackendError::TooLong { backend, width, rows: height, limit: u64::from(limit) })
    }

    /// Work groups across and down.
    pub fn groups(&self) -> (u32, u32) {
        let (threads, group) = (self.threads(), workgroup(self.kernel.name()));
        (threads.0.div_ceil(group.0), threads.1.div_ceil(group.1))
    }
}

/// A film's sums as kernels write them, but of all its chunks.
///
/// # Errors
///
/// [`DenoiseError::NoGuides`] for a film that has none.
pub fn sums(film: &Film) -> Result<(Vec<PixelSums>, Vec<Guides>), DenoiseError> {
    if film.guides.len() != film.pixels.len() {
        return Err(DenoiseError::NoGuides);
    }
    let sums = film.pixels.par_iter().map(|pixel| pixel.sums()).collect();
    Ok((sums, film.guides.par_iter().map(|guides| guides.sums()).collect()))
}

/// The last pass's pixels as an image; NaN where neither a pixel nor any in reach of it has a colour.
pub fn image(width: u32, height: u32, pixels: &[Lit]) -> Image {
    let color = |pixel: &Lit| if pixel.is_known() { pixel.color.to_array() } else { [f32::NAN; 3] };
    Image { width, height, pixels: pixels.iter().map(color).collect() }
}

#[cfg(test)]
mod tests;
