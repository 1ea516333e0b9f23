//! Phase function of Henyey and Greenstein ("Diffuse Radiation in the Galaxy", 1941).

use crate::math::{basis, max, min, normalize, sqrt, unit_circle, unit_f32};
use core::f32::consts::PI;
use glam::Vec3;

/// Returns the pdf, per steradian, that light turns by the angle with this cosine: 1 is straight
/// on. `g` is the mean cosine.
#[inline(always)]
pub fn phase_function(g: f32, cos: f32) -> f32 {
    // 1 + g² - 2 g cos, without cancellation near the peak.
    let size = g.abs();
    let off_peak = 1.0 - if g < 0.0 { -cos } else { cos };
    let base = max((1.0 - size) * (1.0 - size) + 2.0 * size * off_peak, 1e-7);
    (1.0 - g * g) * (1.0 / (4.0 * PI * base * sqrt(base)))
}

/// Samples the unit direction of light that went along the unit vector `incoming`, by
/// [`phase_function`].
#[inline(always)]
pub fn sample_phase_function(g: f32, incoming: Vec3, random_x: u32, random_y: u32) -> Vec3 {
    // The inverse of the cumulative distribution, expanded so that it does not divide by g.
    let s = 2.0 * unit_f32(random_x) - 1.0;
    let base = 1.0 + g * s;
    let square = s * s;
    let cos =
        (2.0 * s + g * (square + 3.0) + g * g * (2.0 * s + g * (square - 1.0))) * (1.0 / (2.0 * base * base));
    let cos = max(min(cos, 1.0), -1.0);
    let sin = sqrt(1.0 - cos * cos);
    let (x, y) = basis(incoming);
    let (c, s) = unit_circle(random_y);
    normalize(incoming * cos + (x * c + y * s) * sin)
}
