//! Iridescence by a thin film (KHR_materials_iridescence): the reflectance of Belcour and Barla,
//! "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence", 2017, with
//! Schlick's approximation at both boundaries and two orders of interference.

use crate::math::{cos_sin_turns, exp2, max, min, sqrt};
use core::f32::consts::{LOG2_E, TAU};
use glam::Vec3;

/// Returns the reflectance of a film of `thickness` nanometres over a base whose reflectance at
/// normal incidence is `base`, from outside at cosine `cos`.
#[inline(always)]
pub(super) fn reflectance(cos: f32, ior: f32, thickness: f32, base: Vec3) -> Vec3 {
    // Without a thickness there is no film.
    let fade = min(max(thickness * (1.0 / 0.03), 0.0), 1.0);
    let ior = 1.0 + (ior - 1.0) * (fade * fade * (3.0 - 2.0 * fade));
    let inverse = 1.0 / ior;
    let cos2 = 1.0 - inverse * inverse * (1.0 - cos * cos);
    if cos2 < 0.0 {
        return Vec3::ONE; // total reflection, if the film is thinner than air
    }
    let refracted = sqrt(cos2);
    let outer = schlick((ior - 1.0) * (1.0 / (ior + 1.0)), cos);
    let entered = 1.0 - outer;
    // Phases of reflection: half a turn at a boundary to what is optically denser.
    let back = if ior < 1.0 { 0.0 } else { 0.5 };
    let (base_x, base_y, base_z) = (index(base.x), index(base.y), index(base.z));
    let inner = Vec3::new(
        schlick((base_x - ior) * (1.0 / (base_x + ior)), refracted),
        schlick((base_y - ior) * (1.0 / (base_y + ior)), refracted),
        schlick((base_z - ior) * (1.0 / (base_z + ior)), refracted),
    );
    let phase = Vec3::new(
        back + half_turn(base_x, ior),
        back + half_turn(base_y, ior),
        back + half_turn(base_z, ior),
    );
    let path = 2.0 * ior * thickness * refracted;
    let both = (inner * outer).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
    let root = Vec3::new(sqrt(both.x), sqrt(both.y), sqrt(both.z));
    let rest = Vec3::ONE - both;
    let series = inner * (entered * entered) * Vec3::new(1.0 / rest.x, 1.0 / rest.y, 1.0 / rest.z);
    let first = (series - Vec3::splat(entered)) * root;
    let sum = Vec3::splat(outer)
        + series
        + first * (2.0 * sensitivity(path, phase))
        + first * root * (2.0 * sensitivity(2.0 * path, phase * 2.0));
    sum.clamp(Vec3::ZERO, Vec3::ONE)
}

/// Returns Schlick's reflectance from the amplitude at normal incidence.
#[inline(always)]
fn schlick(amplitude: f32, cos: f32) -> f32 {
    let f0 = amplitude * amplitude;
    let x = max(1.0 - cos, 0.0);
    let x2 = x * x;
    f0 + (1.0 - f0) * (x2 * x2 * x)
}

/// Returns the index of refraction of this reflectance at normal incidence.
#[inline(always)]
fn index(f0: f32) -> f32 {
    let root = sqrt(min(max(f0, 0.0), 0.9999));
    (1.0 + root) * (1.0 / (1.0 - root))
}

/// Returns the phase in turns of a reflection at the base.
#[inline(always)]
fn half_turn(base: f32, film: f32) -> f32 {
    if base < film { 0.5 } else { 0.0 }
}

/// Returns the transform of a Gaussian around `centre`.
#[inline(always)]
fn wave(frequency: f32, centre: f32, variance: f32, turns: f32) -> f32 {
    let (cos, _) = cos_sin_turns(centre * (1.0 / TAU) * frequency + turns);
    cos * exp2(-variance * LOG2_E * (frequency * frequency))
}

/// Returns the colour of interference by a difference of paths in nanometres and of phases in
/// turns: the Fourier transform of the eye's sensitivity, as linear Rec. 709.
#[inline(always)]
fn sensitivity(path: f32, phase: Vec3) -> Vec3 {
    let frequency = TAU * 1e-9 * path;
    // Gaussians of the colour matching functions: weights are areas over that of a white spectrum.
    let x = 0.846_59 * wave(frequency, 1.681_0e6, 4.327_8e9, phase.x)
        + 0.153_868 * wave(frequency, 2.239_9e6, 4.528_2e9, phase.x);
    let y = 1.000_222 * wave(frequency, 1.795_3e6, 9.304_6e9, phase.y);
    let z = 1.001_122 * wave(frequency, 2.208_4e6, 6.612_1e9, phase.z);
    Vec3::new(
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    )
}
