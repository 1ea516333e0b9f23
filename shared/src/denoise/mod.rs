//! Edge-avoiding filters for images of few samples.
//!
//! [`demodulate`] takes what render kernels summed ([`PixelSums`](crate::film::PixelSums) and
//! [`Guides`](crate::aovs::AovSums)), divides by the albedo, and finds the edges;
//! [`estimate_variance`] tells the variance from a pixel's neighbours where its own samples do not;
//! each [`atrous_level`] is a pass of the à-trous wavelet transform (Dammertz et al.,
//! "Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination Filtering", HPG 2010),
//! with fixed stops or with those of Schied et al., "Spatiotemporal Variance-Guided Filtering" (HPG
//! 2017); [`remodulate`] multiplies by the albedo again.
//!
//! Stops let (1 - x/2)² of a neighbour through, and nothing from x = 2 on, where x is the sum of
//! their squared distances: Tukey's biweight (Black et al., "Robust Anisotropic Diffusion", IEEE
//! Transactions on Image Processing 7(3), 1998) in place of both papers' exponential, for which it
//! takes a few operations that round the same everywhere. Depth is kept as its inverse, which is
//! linear in the image over a plane: so the distance of a point from the tangent plane of another,
//! relative to its depth, takes a multiplication and two additions. Neither scale nor position of a
//! scene matter.

mod atrous;
mod demodulation;
mod edge_stopping;
mod temporal;
mod variance;

pub use atrous::{PIXELS_PER_THREAD, atrous_level, atrous_levels};
pub use demodulation::{demodulate, remodulate};
pub use edge_stopping::{GBufferTexel, PinholeView};
pub use temporal::{HistoryPixel, accumulate, reproject};
pub use variance::{NEIGHBOURHOOD_RADIUS, estimate_variance};

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A pixel of the image between passes: radiance over albedo. 16 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FilteredPixel {
    /// Finite.
    pub color: Vec3,
    /// Of the colour, summed over its channels; [`UNKNOWN_VARIANCE`] where there is no colour: no
    /// sample, or none that is a number.
    pub variance: f32,
}

const _: () = assert!(size_of::<FilteredPixel>() == 16 && align_of::<FilteredPixel>() == 16);

/// In place of a variance.
pub const UNKNOWN_VARIANCE: f32 = -1.0;

impl FilteredPixel {
    /// A pixel without a colour.
    pub const UNKNOWN: Self = Self { color: Vec3::ZERO, variance: UNKNOWN_VARIANCE };

    /// Whether there is a colour.
    #[inline(always)]
    pub fn is_known(&self) -> bool {
        self.variance >= 0.0
    }
}

/// One launch of a pass. 208 bytes, 13 rows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DenoiseParams {
    /// Where the image was seen from. Bytes 0 to 79.
    pub view: PinholeView,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Pixels between the taps of a level: 1, 2, 4, ...
    pub step: u32,
    /// Row that the launch's first threads serve; for a level, of its sets of rows.
    pub first_row: u32,
    /// Half the factor of its squared distance; with stops by variance, times that.
    pub color_factor: f32,
    /// Half the factor of 1 minus the cosine of two normals.
    pub normal_factor: f32,
    /// Root of half the factor of the squared distance from the tangent plane, relative to the
    /// depth.
    pub depth_factor: f32,
    /// Samples a pixel below which its variance is told from its neighbours.
    pub trusted_samples: u32,
    /// Where the frame before was seen from. Bytes 112 to 191.
    pub previous_view: PinholeView,
    /// Samples that the past counts for, at most.
    pub max_history: f32,
    /// Of them, those that it no longer counts for, since the camera rests.
    pub expired_history: f32,
    /// Standard deviations of the neighbourhood within which the past is taken.
    pub clamp_deviations: f32,
    /// Whether a frame is added to those before it, or takes their place.
    pub accumulate: u32,
}

const _: () = assert!(size_of::<DenoiseParams>() == 208 && align_of::<DenoiseParams>() == 16);

/// The least and the greatest factor of a stop: neither 0 nor infinite, so that no product is NaN.
pub const STOP_FACTORS: (f32, f32) = (1e-36, 1e36);

/// The least albedo that is divided by.
pub const MIN_ALBEDO: f32 = 1e-3;
