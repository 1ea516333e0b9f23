//! Sheen of fibres (KHR_materials_sheen): Charlie's distribution (Estevez and Kulla, "Production
//! Friendly Microfacet Sheen BRDF", 2017) with its masking.

use crate::math::{exp2, log2, max, min, sqrt};
use core::f32::consts::{FRAC_1_PI, LOG2_E};

/// Minimum roughness; below it, fibres are seen from the side alone.
const MIN_ROUGHNESS: f32 = 0.1;

/// Returns the value of white sheen times the cosine of `i`, for the cosines of the directions to
/// the viewer `o` and the light `i` and of their half vector `h` with the normal.
///
/// Where the distribution would reflect more light than arrives, from the side, it is scaled down
/// by the greater albedo of both directions, so that it stays reciprocal.
#[inline(always)]
pub(super) fn value(o: f32, i: f32, h: f32, roughness: f32) -> f32 {
    let alpha = alpha(roughness);
    let sharpness = 1.0 / alpha;
    let sine2 = max(1.0 - h * h, 1e-9);
    let facing = (2.0 + sharpness) * exp2(0.5 * sharpness * log2(sine2)) * (0.5 * FRAC_1_PI);
    let masking = 1.0 / ((1.0 + lambda(o, alpha) + lambda(i, alpha)) * 4.0 * o);
    let excess = max(max(albedo_fit(o, roughness), albedo_fit(i, roughness)), 1.0);
    facing * masking * (1.0 / excess)
}

/// Returns the albedo of white sheen seen at cosine `cos`, at most 1: a fit, up to 0.05 above it.
#[inline(always)]
pub(super) fn albedo(cos: f32, roughness: f32) -> f32 {
    min(albedo_fit(cos, roughness) + 0.023, 1.0)
}

#[inline(always)]
fn alpha(roughness: f32) -> f32 {
    let roughness = max(roughness, MIN_ROUGHNESS);
    roughness * roughness
}

/// Returns the albedo before it is limited.
#[inline(always)]
fn albedo_fit(cos: f32, roughness: f32) -> f32 {
    let c = cos;
    let r = 1.0 / (max(roughness, MIN_ROUGHNESS) + 0.05);
    let constant = -3.738_58 + r * (2.674_86 + r * (-0.399_327 + r * 0.016_466));
    let first = 2.281_02 + r * (-4.809_87 + r * (-0.388_555 + r * 0.145_303));
    let second = -9.647_62 + r * (9.168_48 + r * (2.300_04 - r * 0.718_051));
    let third = 3.804_26 + r * (0.946_676 + r * (-6.640_69 + r * 1.152_33));
    exp2(constant + c * (first + c * (second + c * third)))
}

/// Returns the ratio of masked to visible fibres for a direction with cosine `cos`.
#[inline(always)]
fn lambda(cos: f32, alpha: f32) -> f32 {
    let sharp = (1.0 - alpha) * (1.0 - alpha);
    let power = if cos < 0.5 { curve(cos, sharp) } else { 2.0 * curve(0.5, sharp) - curve(1.0 - cos, sharp) };
    exp2(power * LOG2_E)
}

/// Returns the fit of the logarithm of [`lambda`] up to cosine 1/2, between those of sharp and wide
/// distributions.
#[inline(always)]
fn curve(x: f32, sharp: f32) -> f32 {
    let wide = 1.0 - sharp;
    let a = sharp * 21.547_3 + wide * 25.324_5;
    let b = sharp * 3.829_87 + wide * 3.324_35;
    let c = sharp * 0.198_23 + wide * 0.168_01;
    let d = sharp * -1.977_6 + wide * -1.273_93;
    let e = sharp * -4.320_54 + wide * -4.859_67;
    a * (1.0 / (1.0 + b * exp2(c * log2(max(x, 1e-6))))) + d * x + e
}

/// Returns the cosine of the half vector of two directions of the frame with the normal.
#[inline(always)]
pub(super) fn half_cosine(o: glam::Vec3, i: glam::Vec3) -> f32 {
    let h = o + i;
    let length2 = h.dot(h);
    if length2 > 0.0 { min(h.z * (1.0 / sqrt(length2)), 1.0) } else { 0.0 }
}
