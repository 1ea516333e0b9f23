//! GGX distribution of facets, for [`crate::bsdf`]. Vectors are in the facets' frame: z is the
//! surface's normal.
//!
//! Sources: Walter et al., EGSR 2007, with Smith's shadowing; sampling by visible normals: Heitz,
//! "Sampling the GGX Distribution of Visible Normals", JCGT 7(4), 2018.

use crate::math::{max, min, normalize, sqrt, unit_circle, unit_f32};
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

/// Returns the grazing part g of a rough boundary's reflectance: with reflectance f at normal
/// incidence, the boundary reflects at most f + (1 - f) g. It is the boundary's albedo, seen at
/// `cos`, for the reflectance (1 - v·h)⁵: the part of Schlick's form that depends on the angle.
///
/// g is a fit, 0 to 0.06 above the integral over GGX's visible normals with single scattering
/// (sampled for 0.03 ≤ `roughness` ≤ 1 and 0.005 ≤ `cos` ≤ 1). The error is a margin, so that no
/// more than all light is reflected.
#[inline(always)]
pub fn grazing_share(cos: f32, roughness: f32) -> f32 {
    let x = max(1.0 - cos, 0.0);
    let (x2, c) = (x * x, coefficients(roughness));
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    min(max(c.0 * x2 + c.1 * (x4 * x) + c.2 * (x8 * x) + c.3 * (x8 * x4 * x2) + MARGIN * x, 0.0), 1.0)
}

/// Returns the mean of [`grazing_share`] over the hemisphere, weighted by the cosine.
#[inline(always)]
pub fn mean_grazing_share(roughness: f32) -> f32 {
    let c = coefficients(roughness);
    c.0 * (1.0 / 6.0) + c.1 * (1.0 / 21.0) + c.2 * (1.0 / 55.0) + c.3 * (1.0 / 120.0) + MARGIN * (1.0 / 3.0)
}

const MARGIN: f32 = 0.034;

/// Returns the coefficients of (1 - cos) to the powers 2, 5, 9 and 14.
#[inline(always)]
fn coefficients(roughness: f32) -> (f32, f32, f32, f32) {
    let r = roughness;
    let (p, q) = (1.0 / (1.0 + 10.0 * r * r), 1.0 / (1.0 + 100.0 * r * r));
    (
        -0.506_99 + 0.564_1 * r + 0.537_53 * p + 0.219_89 * q,
        4.064_3 - 4.351_7 * r - 3.176_2 * p - 1.223_7 * q,
        -8.559_9 + 8.718_4 * r + 9.892_3 * p + 0.927_9 * q,
        5.138_5 - 5.110_7 * r - 6.652 * p + 0.304_25 * q,
    )
}
