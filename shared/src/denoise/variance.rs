//! Variance of a pixel's neighbourhood, for SVGF and reprojection.

use super::edge_stopping::{EdgeStopping, OPEN, biweight};
use super::{DenoiseParams, FilteredPixel, GBufferTexel};
use crate::buffer::load;
use crate::buffer_layout::Packed;
use glam::Vec3;

/// Maximum variance that passes compute with.
pub(super) const MAX_VARIANCE: f32 = 1e30;

/// Returns the sum of the channels' variances, at most [`MAX_VARIANCE`], which also replaces NaN.
#[inline(always)]
pub(super) fn total_variance(of_channel: Vec3) -> f32 {
    let sum = positive(of_channel.x) + positive(of_channel.y) + positive(of_channel.z);
    if sum < MAX_VARIANCE { sum } else { MAX_VARIANCE }
}

#[inline(always)]
fn positive(x: f32) -> f32 {
    if x <= 0.0 { 0.0 } else { x }
}

/// Radius of a neighbourhood in pixels (Schied et al. 2017, section 4.2).
pub const NEIGHBOURHOOD_RADIUS: i32 = 3;

/// Returns pixel (`x`, `y`); if it has fewer than `params.trusted_samples` samples, with the
/// variance of its neighbourhood. Neighbours are weighted by how near their surface is.
///
/// # Safety
///
/// The pixel lies inside the image, and each slice has a record for each pixel.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn estimate_variance(
    params: &DenoiseParams,
    from: &[Packed<FilteredPixel>],
    edges: &[Packed<GBufferTexel>],
    samples: u32,
    x: u32,
    y: u32,
) -> FilteredPixel {
    let pixel = y * params.width + x;
    // SAFETY: the caller's promise.
    let (middle, edge) = unsafe { (load::<FilteredPixel>(from, pixel), load::<GBufferTexel>(edges, pixel)) };
    if has_variance(params, middle, samples) {
        return middle;
    }
    // SAFETY: the caller's promise.
    let variance = unsafe { neighbourhood_stats(params, from, edges, middle, edge, x, y) }.total_variance();
    FilteredPixel { variance, ..middle }
}

/// Returns whether a pixel keeps its own variance: it has enough samples for one, or no colour.
#[inline(always)]
pub fn has_variance(params: &DenoiseParams, pixel: FilteredPixel, samples: u32) -> bool {
    samples >= params.trusted_samples || !pixel.is_known()
}

/// Mean and variance of a pixel's neighbourhood, by channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourhoodStats {
    /// Mean.
    pub mean: Vec3,
    /// Variance of one pixel.
    pub variance: Vec3,
}

impl NeighbourhoodStats {
    /// Statistics of no pixel.
    pub const NONE: Self = Self { mean: Vec3::ZERO, variance: Vec3::ZERO };

    /// Returns the variance summed over all channels.
    #[inline(always)]
    pub fn total_variance(&self) -> f32 {
        total_variance(self.variance)
    }
}

/// Returns mean and variance over the surface around pixel (`x`, `y`), which has the colour
/// `middle` and the surface `edge`.
///
/// # Safety
///
/// As [`estimate_variance`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn neighbourhood_stats(
    params: &DenoiseParams,
    from: &[Packed<FilteredPixel>],
    edges: &[Packed<GBufferTexel>],
    middle: FilteredPixel,
    edge: GBufferTexel,
    x: u32,
    y: u32,
) -> NeighbourhoodStats {
    let stops = EdgeStopping::new(params, edge, x, y, 1.0);
    let (mut sum, mut squares, mut total) = (middle.color, middle.color * middle.color, 1.0);
    let mut j = -NEIGHBOURHOOD_RADIUS;
    while j <= NEIGHBOURHOOD_RADIUS {
        let down = y.wrapping_add(j as u32);
        let mut i = -NEIGHBOURHOOD_RADIUS;
        while i <= NEIGHBOURHOOD_RADIUS {
            let across = x.wrapping_add(i as u32);
            if across < params.width && down < params.height && (i != 0 || j != 0) {
                let tap = down * params.width + across;
                // SAFETY: the tap lies inside the image.
                let (lit, edge) =
                    unsafe { (load::<FilteredPixel>(from, tap), load::<GBufferTexel>(edges, tap)) };
                let left = stops.remaining(OPEN, edge, i as f32, j as f32);
                let weight = if lit.is_known() { biweight(left) } else { 0.0 };
                // A neighbour without weight must not count, even if its colour is too large to be
                // squared.
                let color = if weight > 0.0 { lit.color } else { Vec3::ZERO };
                sum += color * weight;
                squares += color * color * weight;
                total += weight;
            }
            i += 1;
        }
        j += 1;
    }
    let mean = sum / total;
    NeighbourhoodStats { mean, variance: squares / total - mean * mean }
}

/// Returns the variance around a pixel: the mean of the known variances in 3 x 3 pixels, by a
/// binomial filter.
///
/// # Safety
///
/// As [`estimate_variance`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn smoothed_variance(
    params: &DenoiseParams,
    from: &[Packed<FilteredPixel>],
    x: u32,
    y: u32,
) -> f32 {
    let (mut sum, mut total) = (0.0, 0.0);
    macro_rules! taps {
        ($(($i:literal, $j:literal, $weight:literal))*) => {$(
            let (across, down) = (x.wrapping_add($i as i32 as u32), y.wrapping_add($j as i32 as u32));
            if across < params.width && down < params.height {
                // SAFETY: the tap lies inside the image.
                let variance = unsafe { load::<FilteredPixel>(from, down * params.width + across) }.variance;
                let weight: f32 = if variance >= 0.0 { $weight } else { 0.0 };
                sum += variance * weight;
                total += weight;
            }
        )*};
    }
    taps! {
        (-1, -1, 1.0) (0, -1, 2.0) (1, -1, 1.0)
        (-1, 0, 2.0) (0, 0, 4.0) (1, 0, 2.0)
        (-1, 1, 1.0) (0, 1, 2.0) (1, 1, 1.0)
    }
    if total > 0.0 { sum / total } else { 0.0 }
}
