//! GGX distribution of facets, for [`crate::bsdf`]. Vectors are in the facets' frame: z is the
//! surface's normal.
//!
//! Sources: Walter et al., EGSR 2007, with Smith's shadowing; sampling by visible normals: Heitz,
//! "Sampling the GGX Distribution of Visible Normals", JCGT 7(4), 2018.

use crate::math::{max, normalize, sqrt, unit_circle, unit_f32};
use core::f32::consts::PI;
use glam::Vec3;

/// Minimum alpha of a rough surface; below it, the surface is a perfect mirror. A lobe of this
/// alpha, a tenth of a degree wide, is at f32's resolution of half vectors.
pub const MIN_ROUGH_ALPHA: f32 = 1e-3;

/// Returns D(h): the area of facets with normal `h`, per steradian and per unit of surface area.
#[inline(always)]
pub fn distribution(h: Vec3, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // As a sum of squares: 1 - cos² cancels where the lobe is narrow.
    let s = h.x * h.x + h.y * h.y + a2 * (h.z * h.z);
    a2 * (1.0 / (PI * s * s))
}

/// Returns z (1 + Λ(z)): the projected area of all facets, visible or masked, that face a direction
/// with height `z`, 0 < z ≤ 1, per unit of surface area. Λ is Smith's ratio of masked to visible
/// facets (Heitz, JCGT 3(2), 2014).
#[inline(always)]
pub fn facing_area(z: f32, alpha: f32) -> f32 {
    0.5 * (z + sqrt(z * z + alpha * alpha * max(1.0 - z * z, 0.0)))
}

/// Samples a facet normal seen from `v` (v.z > 0), in proportion to the area seen: pdf D(h) G1(v)
/// (v·h) / v.z.
///
/// It stretches the hemisphere to a sphere's cap (Dupuy and Benyoub, "Sampling Visible GGX Normals
/// with Spherical Caps", HPG 2023); the distribution is Heitz's.
#[inline(always)]
pub fn sample_visible_normal(v: Vec3, alpha: f32, height: u32, azimuth: u32) -> Vec3 {
    let stretched = normalize(Vec3::new(v.x * alpha, v.y * alpha, v.z));
    let z = (1.0 - unit_f32(height)) * (1.0 + stretched.z) - stretched.z;
    let (cos, sin) = unit_circle(azimuth);
    let radius = sqrt(max(1.0 - z * z, 0.0));
    let cap = Vec3::new(radius * cos, radius * sin, z) + stretched;
    normalize(Vec3::new(cap.x * alpha, cap.y * alpha, max(cap.z, 1e-9)))
}

/// Returns what [`distribution`] does, for facets stretched by `x` and `y` along the axes.
#[inline(always)]
pub fn distribution_along(h: Vec3, x: f32, y: f32) -> f32 {
    // As a sum of squares over the product of the alphas, which is not 0.
    let (a, b) = (h.x * h.x * y * (1.0 / x), h.y * h.y * x * (1.0 / y));
    let s = a + b + x * y * (h.z * h.z);
    x * y * (1.0 / (PI * s * s))
}

/// Returns what [`facing_area`] does, for facets stretched by `x` and `y` along the axes; `v` is on
/// either side.
#[inline(always)]
pub fn facing_area_along(v: Vec3, x: f32, y: f32) -> f32 {
    let (z, a, b) = (v.z.abs(), v.x * x, v.y * y);
    0.5 * (z + sqrt(z * z + a * a + b * b))
}

/// Returns the height of the direction `v`, on either side, where facets that are stretched by `x`
/// and `y` along the axes become a hemisphere.
#[inline(always)]
pub fn stretched_height(v: Vec3, x: f32, y: f32) -> f32 {
    let (z, a, b) = (v.z.abs(), v.x * x, v.y * y);
    z * (1.0 / sqrt(max(z * z + a * a + b * b, 1e-12)))
}

/// Samples what [`sample_visible_normal`] does, for facets stretched by `x` and `y` along the axes.
#[inline(always)]
pub fn sample_visible_normal_along(v: Vec3, x: f32, y: f32, height: u32, azimuth: u32) -> Vec3 {
    let stretched = normalize(Vec3::new(v.x * x, v.y * y, v.z));
    let z = (1.0 - unit_f32(height)) * (1.0 + stretched.z) - stretched.z;
    let (cos, sin) = unit_circle(azimuth);
    let radius = sqrt(max(1.0 - z * z, 0.0));
    let cap = Vec3::new(radius * cos, radius * sin, z) + stretched;
    normalize(Vec3::new(cap.x * x, cap.y * y, max(cap.z, 1e-9)))
}
