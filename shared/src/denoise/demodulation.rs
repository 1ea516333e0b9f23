//! Demodulation: from sums to an image of the reflected light alone, without albedo and emission,
//! and back.

use super::variance::total_variance;
use super::{DenoiseParams, FilteredPixel, GBufferTexel, MIN_ALBEDO};
use crate::aovs::AovSums;
use crate::film::PixelSums;
use crate::math::{all_finite, max, normalize};
use glam::Vec3;

/// Range of depths that passes can compute with, in scene units.
const DEPTH_RANGE: (f32, f32) = (1e-15, 1e15);

/// Returns reflected radiance over albedo with the variance of its mean, and the surface, of a
/// pixel. Emission has no noise but at edges, and must not light neighbours: it is left out.
#[inline(always)]
pub fn demodulate(params: &DenoiseParams, sums: PixelSums, aovs: AovSums) -> (FilteredPixel, GBufferTexel) {
    let n = sums.samples as f32;
    let by = inverse_albedo(mean_per_sample(aovs, aovs.albedo));
    let whole = sums.radiance / n; // 0 / 0 without samples
    let color = (whole - mean_per_sample(aovs, aovs.emission)) * by;
    let mut pixel = FilteredPixel::UNKNOWN;
    if all_finite(color) {
        pixel = FilteredPixel { color, variance: 0.0 };
        if sums.samples > 1 {
            pixel.variance = total_variance((sums.squares / n - whole * whole) * (by * by)) / (n - 1.0);
        }
    }
    (pixel, gbuffer_texel(params, aovs))
}

/// Returns the mean surface of those of a pixel's samples that hit one, or none. Where a surface
/// fades out, or ends, its light is filtered with that of the surface, not with the sky's.
#[inline(always)]
fn gbuffer_texel(params: &DenoiseParams, aovs: AovSums) -> GBufferTexel {
    let length2 = aovs.normal.dot(aovs.normal);
    // Opposite normals may cancel; a sum may be NaN.
    if aovs.hits == 0 || !(length2 > 1e-12 && length2 < 1e12) {
        return GBufferTexel::NONE;
    }
    let to = aovs.position / aovs.hits as f32 - params.view.origin;
    let depth = to.dot(params.view.axis);
    if depth > DEPTH_RANGE.0 && depth < DEPTH_RANGE.1 {
        GBufferTexel { normal: normalize(aovs.normal), inverse_depth: 1.0 / depth }
    } else {
        GBufferTexel::NONE
    }
}

/// Returns the mean of `sum` over all samples; 0 if there are none or the mean is not finite.
#[inline(always)]
fn mean_per_sample(aovs: AovSums, sum: Vec3) -> Vec3 {
    let n = aovs.hits + aovs.misses;
    let mean = sum / n as f32;
    if n > 0 && all_finite(mean) { mean } else { Vec3::ZERO }
}

/// Returns the inverse of the albedo, with each channel at least [`MIN_ALBEDO`].
#[inline(always)]
fn inverse_albedo(albedo: Vec3) -> Vec3 {
    let one = |a| 1.0 / max(a, MIN_ALBEDO);
    Vec3::new(one(albedo.x), one(albedo.y), one(albedo.z))
}

/// Returns the radiance of a pixel: its colour times the albedo, plus the emission. The variance
/// stays that of the colour.
#[inline(always)]
pub fn remodulate(pixel: FilteredPixel, aovs: AovSums) -> FilteredPixel {
    let a = mean_per_sample(aovs, aovs.albedo);
    let by = Vec3::new(max(a.x, MIN_ALBEDO), max(a.y, MIN_ALBEDO), max(a.z, MIN_ALBEDO));
    FilteredPixel { color: pixel.color * by + mean_per_sample(aovs, aovs.emission), variance: pixel.variance }
}
