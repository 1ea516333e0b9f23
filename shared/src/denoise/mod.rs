//! Edge-avoiding filters for images of few samples, which the host's backends run pass by pass.
//!
//! [`demodulate`] divides sums of render kernels by the albedo; [`estimate_variance`] takes the
//! variance of pixels with few samples from their neighbours; [`accumulate`] and [`reproject`] add
//! earlier frames; [`atrous_level`] is a level of the à-trous wavelet transform (Dammertz et al.,
//! "Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination Filtering", HPG 2010),
//! with fixed edge stopping or SVGF's (Schied et al., "Spatiotemporal Variance-Guided Filtering",
//! HPG 2017); [`remodulate`] multiplies by the albedo again. `edge_stopping` defines the weights.

mod atrous;
mod demodulation;
mod edge_stopping;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod rows;
mod temporal;
mod variance;

pub use crate::records::denoise::{FilteredPixel, GBufferTexel, HistoryPixel, UNKNOWN_VARIANCE};
pub use atrous::{PIXELS_PER_THREAD, atrous_level, atrous_levels};
pub use demodulation::{demodulate, remodulate};
pub use edge_stopping::PinholeView;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub use rows::{NeighbourhoodRow, atrous_rows, level_numbers, neighbourhood_numbers};
pub use temporal::{Reprojection, accumulate, reproject};
pub use variance::{NEIGHBOURHOOD_RADIUS, NeighbourhoodStats, estimate_variance, has_variance};

use bytemuck::{Pod, Zeroable};

/// One launch of a denoising pass. 208 bytes, 13 rows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DenoiseParams {
    /// Camera of the image. Bytes 0 to 79.
    pub view: PinholeView,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Distance between the taps of a level, in pixels: 1, 2, 4, ...
    pub step: u32,
    /// First row of the launch; for a level, first set of rows.
    pub first_row: u32,
    /// 1 / (2 c²) for the colour parameter c: a distance in radiance over albedo or, with edge
    /// stopping by variance, in standard deviations.
    pub color_factor: f32,
    /// 1 / (2 n) for the normal parameter n: 1 minus the cosine of two normals.
    pub normal_factor: f32,
    /// 1 / (√2 d) for the depth parameter d: the distance from the tangent plane, relative to the
    /// depth.
    pub depth_factor: f32,
    /// Number of a pixel's samples below which its variance is estimated from its neighbours.
    pub trusted_samples: u32,
    /// Camera of the previous frame. Bytes 112 to 191.
    pub previous_view: PinholeView,
    /// Maximum number of samples that the history counts for.
    pub max_history: f32,
    /// Number of those samples that the history no longer counts for, because the camera has come
    /// to rest.
    pub expired_history: f32,
    /// Maximum distance of the history from the mean of the neighbourhood, in its standard
    /// deviations.
    pub clamp_deviations: f32,
    /// 1 if a frame is added to the frames before it; 0 if it replaces them.
    pub accumulate: u32,
}

const _: () = assert!(size_of::<DenoiseParams>() == 208 && align_of::<DenoiseParams>() == 16);

/// Minimum and maximum factor of edge stopping: neither 0 nor infinite, so that no product is NaN.
pub const STOP_FACTORS: (f32, f32) = (1e-36, 1e36);

/// Minimum albedo that radiance is divided by.
pub const MIN_ALBEDO: f32 = 1e-3;
