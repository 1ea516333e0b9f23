//! One level of the wavelet transform.

use super::edges::{Stops, bounded, passes};
use super::variance::smoothed;
use super::{DenoiseParams, Edge, Lit, STOPS};
use crate::buffer::load;
use crate::rows::Stored;
use glam::Vec3;

/// Less than any variance of a picture: no division by 0 (what SVGF adds to the deviation, squared).
const LEAST_VARIANCE: f32 = 1e-10;

/// The B3 spline's coefficients at 0, 1 and 2.
const B3: [f32; 3] = [0.375, 0.25, 0.0625];

/// Sums over the taps.
struct Sums {
    /// Of weights times differences from the middle: a constant image comes out as it was.
    difference: Vec3,
    /// Of squared weights times variances.
    variance: f32,
    /// Of the weights.
    weight: f32,
}

/// The pixel (`x`, `y`) of the next level. With `BY_VARIANCE` the stop of the colour is relative to the variance around the pixel.
///
/// A pixel without a colour gets that of its neighbours, and none gets anything of it.
///
/// # Safety
///
/// The pixel is of the image, and there is a record for each of it.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn level<const BY_VARIANCE: bool>(
    params: &DenoiseParams,
    from: &[Stored<Lit>],
    edges: &[Stored<Edge>],
    x: u32,
    y: u32,
) -> Lit {
    let pixel = y * params.width + x;
    // SAFETY: the caller's promise.
    let (middle, edge) = unsafe { (load::<Lit>(from, pixel), load::<Edge>(edges, pixel)) };
    let mut color = params.color;
    if const { BY_VARIANCE } {
        // SAFETY: the caller's promise.
        let variance = unsafe { smoothed(params, from, x, y) };
        color = bounded(color / (variance + LEAST_VARIANCE));
    }
    let known = middle.is_known();
    if !known {
        color = STOPS.0;
    }
    let stops = Stops::new(params, edge, x, y, params.step as f32);
    let own = if known { B3[0] * B3[0] } else { 0.0 };
    let mut sums = Sums { difference: Vec3::ZERO, variance: own * own * middle.variance, weight: own };
    macro_rules! taps {
        ($(($i:literal, $j:literal))*) => {$(
            let (i, j): (i32, i32) = ($i, $j);
            // Beyond an edge of the image the coordinate is as large as none is.
            let across = x.wrapping_add((i * params.step as i32) as u32);
            let down = y.wrapping_add((j * params.step as i32) as u32);
            if across < params.width && down < params.height {
                let tap = down * params.width + across;
                // SAFETY: the tap is of the image.
                let (lit, edge) = unsafe { (load::<Lit>(from, tap), load::<Edge>(edges, tap)) };
                let difference = lit.color - middle.color;
                let x = difference.dot(difference) * color + stops.apart(edge, i as f32, j as f32);
                let kernel = const { B3[($i as i32).unsigned_abs() as usize] * B3[($j as i32).unsigned_abs() as usize] };
                let weight = if lit.is_known() { kernel * passes(x) } else { 0.0 };
                sums.difference += difference * weight;
                sums.weight += weight;
                if const { BY_VARIANCE } {
                    sums.variance += weight * weight * lit.variance;
                }
            }
        )*};
    }
    taps! {
        (-2, -2) (-1, -2) (0, -2) (1, -2) (2, -2)
        (-2, -1) (-1, -1) (0, -1) (1, -1) (2, -1)
        (-2, 0) (-1, 0) (1, 0) (2, 0)
        (-2, 1) (-1, 1) (0, 1) (1, 1) (2, 1)
        (-2, 2) (-1, 2) (0, 2) (1, 2) (2, 2)
    }
    if sums.weight <= 0.0 {
        return Lit::UNKNOWN;
    }
    let by = 1.0 / sums.weight;
    let variance = if const { BY_VARIANCE } { sums.variance * (by * by) } else { 0.0 };
    Lit { color: middle.color + sums.difference * by, variance }
}
