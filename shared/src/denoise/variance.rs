//! Variances: of a pixel's neighbourhood.

use super::edge_stopping::{EdgeStopping, OPEN, biweight};
use super::{DenoiseParams, FilteredPixel, GBufferTexel};
use crate::buffer::load;
use crate::buffer_layout::Packed;
use glam::Vec3;

/// Greatest variance that passes compute with.
pub(super) const MAX_VARIANCE: f32 = 1e30;

/// Of all channels; what is not a number, or too great, is the greatest.
#[inline(always)]
pub(super) fn total_variance(of_channel: Vec3) -> f32 {
    let sum = positive(of_channel.x) + positive(of_channel.y) + positive(of_channel.z);
    if sum < MAX_VARIANCE { sum } else { MAX_VARIANCE }
}

#[inline(always)]
fn positive(x: f32) -> f32 {
    if x <= 0.0 { 0.0 } else { x }
}

/// Pixels to each side of a neighbourhood (Schied et al. 2017, section 4.2).
pub const NEIGHBOURHOOD_RADIUS: i32 = 3;

/// The pixel (`x`, `y`) with the variance that its neighbourhood shows, where it has fewer than
/// `params.trusted_samples` samples; neighbours count by how near their surface is.
///
/// # Safety
///
/// The pixel is of the image, and there is a record for each of it.
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
    if samples >= params.trusted_samples || !middle.is_known() {
        return middle;
    }
    // SAFETY: the caller's promise.
    let variance = unsafe { neighbourhood_stats(params, from, edges, middle, edge, x, y) }.total_variance();
    FilteredPixel { variance, ..middle }
}

/// What the neighbourhood of a pixel shows, by channel.
#[derive(Clone, Copy)]
pub(super) struct NeighbourhoodStats {
    pub(super) mean: Vec3,
    pub(super) variance: Vec3,
}

impl NeighbourhoodStats {
    /// Of all channels.
    #[inline(always)]
    pub(super) fn total_variance(&self) -> f32 {
        total_variance(self.variance)
    }
}

/// Mean and variance over the surface around the pixel (`x`, `y`), which has this colour and edge.
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
                // SAFETY: the tap is of the image.
                let (lit, edge) =
                    unsafe { (load::<FilteredPixel>(from, tap), load::<GBufferTexel>(edges, tap)) };
                let left = stops.remaining(OPEN, edge, i as f32, j as f32);
                let weight = if lit.is_known() { biweight(left) } else { 0.0 };
                // Behind a stop nothing counts, not even what is too great to be squared.
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

/// The variance around a pixel: the mean over 3 x 3 by a binomial filter, of what is known.
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
                // SAFETY: the tap is of the image.
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
