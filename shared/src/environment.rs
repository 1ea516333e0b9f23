//! Environment map: radiance from infinity, importance-sampled by an alias table over its texels.
//!
//! [`crate::light`] samples it; [`crate::path`] looks up rays that hit nothing.

use crate::buffer::load_record;
use crate::math::{atan2_turns, cos_sin_turns, floor, min, mul_high, sqrt, unit_f32};
use crate::params::RenderParams;
pub use crate::records::environment::EnvironmentTexel;
use crate::rng::Words;
use crate::scene::Scene;
use core::f32::consts::PI;
use glam::Vec3;

/// Direction with its radiance, and the pdf with which [`sample`] chooses it.
#[derive(Clone, Copy, Debug)]
pub struct EnvironmentSample {
    /// Unit vector, in world coordinates.
    pub direction: Vec3,
    /// Radiance from this direction.
    pub radiance: Vec3,
    /// pdf per steradian.
    pub pdf: f32,
}

/// Returns the position of direction `d` on the map, across and down, each in [0, 1], and the sine
/// of its angle with the vertical.
#[inline(always)]
fn project(params: &RenderParams, d: Vec3) -> (f32, f32, f32) {
    // Undo the map's rotation about y.
    let (c, s) = (params.environment_cos, params.environment_sin);
    let (x, z) = (d.x * c - d.z * s, d.x * s + d.z * c);
    let horizontal = sqrt(x * x + z * z);
    (0.5 + atan2_turns(x, -z), 2.0 * atan2_turns(horizontal, d.y), horizontal)
}

/// Returns the interpolated radiance at the fractional texel (`x`, `y`); texel centres are at half
/// integers.
///
/// # Safety
///
/// The environment map was proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn interpolate(params: &RenderParams, scene: Scene, x: f32, y: f32) -> Vec3 {
    let (x, y) = (x - 0.5, y - 0.5);
    let (i, j) = (floor(x), floor(y));
    let (fx, fy) = (x - i as f32, y - j as f32);
    // SAFETY: the caller's promise.
    unsafe {
        let top = texel(params, scene, i, j) * (1.0 - fx) + texel(params, scene, i + 1, j) * fx;
        let bottom = texel(params, scene, i, j + 1) * (1.0 - fx) + texel(params, scene, i + 1, j + 1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// Returns the radiance of a texel. Column `i`, at most one beyond the border, wraps; row `j` is
/// clamped.
///
/// # Safety
///
/// As [`interpolate`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn texel(params: &RenderParams, scene: Scene, i: i32, j: i32) -> Vec3 {
    let (width, height) = (params.environment_width as i32, params.environment_height as i32);
    let i = if i < 0 {
        width - 1
    } else if i >= width {
        0
    } else {
        i
    };
    let j = if j < 0 {
        0
    } else if j >= height {
        height - 1
    } else {
        j
    };
    // SAFETY: the texel is inside the map.
    unsafe { load_record::<EnvironmentTexel>(scene.environment, (j * width + i) as u32).radiance }
}

/// Returns the pdf per steradian for a texel's `pdf` over the map: latitude and longitude cover 2π²
/// sin θ.
#[inline(always)]
fn solid_angle_pdf(pdf: f32, sine: f32) -> f32 {
    pdf * (1.0 / (2.0 * PI * PI * crate::math::max(sine, 1e-7)))
}

/// Returns the radiance from the unit direction `d`, and the pdf with which [`sample`] chooses it.
///
/// # Safety
///
/// As [`sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn radiance(params: &RenderParams, scene: Scene, d: Vec3) -> EnvironmentSample {
    let (u, v, sine) = project(params, d);
    let (width, height) = (params.environment_width, params.environment_height);
    // Rounding may give exactly 1.
    let x = min(u, 0.999_999_94) * width as f32;
    let y = min(v, 0.999_999_94) * height as f32;
    let column = min(x, (width - 1) as f32) as u32;
    let row = min(y, (height - 1) as f32) as u32;
    // SAFETY: the caller's promise; column and row are inside.
    unsafe {
        let pdf = load_record::<EnvironmentTexel>(scene.environment, row * width + column).pdf;
        EnvironmentSample {
            direction: d,
            radiance: interpolate(params, scene, x, y),
            pdf: solid_angle_pdf(pdf, sine),
        }
    }
}

/// Samples a direction by the map's radiance: `random.z` and `random.w` choose the texel,
/// `random.x` and `random.y` the place in it.
///
/// # Safety
///
/// The environment map was proven as [`crate::buffer`] says, and has at least one texel.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn sample(params: &RenderParams, scene: Scene, random: Words) -> EnvironmentSample {
    let width = params.environment_width;
    let mut index = mul_high(random.z, width * params.environment_height);
    // SAFETY: the caller's promise for the index and the alias.
    let pdf = unsafe {
        let texel = load_record::<EnvironmentTexel>(scene.environment, index);
        if random.w >= texel.threshold {
            index = texel.alias;
        }
        load_record::<EnvironmentTexel>(scene.environment, index).pdf
    };
    let row = index / width.max(1); // spares a check for division by zero
    let column = index - row * width;
    let x = column as f32 + unit_f32(random.x);
    let y = row as f32 + unit_f32(random.y);
    let (c, s) = (params.environment_cos, params.environment_sin);
    let (across, around) = cos_sin_turns(x * (1.0 / width as f32) - 0.5);
    let (cosine, sine) = cos_sin_turns(0.5 * y * (1.0 / params.environment_height as f32));
    let (dx, dz) = (sine * around, -sine * across);
    let direction = Vec3::new(dx * c + dz * s, cosine, dz * c - dx * s);
    EnvironmentSample {
        direction,
        // SAFETY: the caller's promise.
        radiance: unsafe { interpolate(params, scene, x, y) },
        pdf: solid_angle_pdf(pdf, sine),
    }
}
