//! From sums to an image of the light alone, without textures and without what shines, and back.

use super::variance::total_variance;
use super::{DenoiseParams, Edge, LEAST_ALBEDO, Lit};
use crate::film::PixelSums;
use crate::guides::Guides;
use crate::math::{all_finite, max, normalize};
use glam::Vec3;

/// The range of depths that passes can compute with.
const DEPTHS: (f32, f32) = (1e-15, 1e15);

/// Reflected radiance over albedo with the variance of its mean, and the surface, of a pixel. What the pixel sees shining has no noise
/// but that of edges, and is no light that a neighbour should get: it stays out.
#[inline(always)]
pub fn gather(params: &DenoiseParams, sums: PixelSums, guides: Guides) -> (Lit, Edge) {
    let n = sums.samples as f32;
    let by = over(mean(guides, guides.albedo));
    let whole = sums.radiance / n; // 0 / 0 without samples
    let color = (whole - mean(guides, guides.emission)) * by;
    let mut lit = Lit::UNKNOWN;
    if all_finite(color) {
        lit = Lit { color, variance: 0.0 };
        if sums.samples > 1 {
            lit.variance = total_variance((sums.squares / n - whole * whole) * (by * by)) / (n - 1.0);
        }
    }
    (lit, surface(params, guides))
}

/// What most of the samples see.
#[inline(always)]
fn surface(params: &DenoiseParams, guides: Guides) -> Edge {
    let length2 = guides.normal.dot(guides.normal);
    // Not so where opposite normals cancel, or a number is none.
    if guides.hits < guides.misses || !(length2 > 1e-12 && length2 < 1e12) {
        return Edge::NONE;
    }
    let to = guides.position / guides.hits as f32 - params.view.origin;
    let depth = to.dot(params.view.axis);
    if depth > DEPTHS.0 && depth < DEPTHS.1 {
        Edge { normal: normalize(guides.normal), depth: 1.0 / depth }
    } else {
        Edge::NONE
    }
}

/// Of a sum over all samples; 0 without one, and for what is no number.
#[inline(always)]
fn mean(guides: Guides, sum: Vec3) -> Vec3 {
    let n = guides.hits + guides.misses;
    let mean = sum / n as f32;
    if n > 0 && all_finite(mean) { mean } else { Vec3::ZERO }
}

/// What is divided by, inverse.
#[inline(always)]
fn over(albedo: Vec3) -> Vec3 {
    let one = |a| 1.0 / max(a, LEAST_ALBEDO);
    Vec3::new(one(albedo.x), one(albedo.y), one(albedo.z))
}

/// The pixel with its albedo and what shines again: radiance.
#[inline(always)]
pub fn finish(lit: Lit, guides: Guides) -> Lit {
    let a = mean(guides, guides.albedo);
    let by = Vec3::new(max(a.x, LEAST_ALBEDO), max(a.y, LEAST_ALBEDO), max(a.z, LEAST_ALBEDO));
    Lit { color: lit.color * by + mean(guides, guides.emission), variance: lit.variance }
}
