//! Probe of random numbers: the words of both samplers, and the camera ray and the point of the
//! unit sphere that given words produce.

use crate::record::{Input, Output, ProbeParams, row, words};
use glam::UVec4;
use trisect_shared::features::{FeatureSet, SOBOL};
use trisect_shared::math::{unit_f32, unit_sphere};
use trisect_shared::rng::{PathKey, Words};
use trisect_shared::sampler;
use trisect_shared::scene::Scene;

/// Independent sampler. Row a: seed, pixel, sample, block. Output: a words; b the words as numbers.
pub const INDEPENDENT: u32 = 0;
/// Sobol sequence; rows and output of [`INDEPENDENT`].
pub const SEQUENCE: u32 = 1;
/// Point on the unit sphere. Row a: words, of which the first two matter. Output a: the point.
pub const UNIT_SPHERE: u32 = 2;
/// Camera ray. Rows: a words; b pixel x and y. Output: a direction; b origin.
pub const CAMERA: u32 = 3;
/// [`INDEPENDENT`] with numbers that can be 1: a negative control.
pub const INDEPENDENT_TO_ONE: u32 = 4;

#[inline(always)]
fn numbers(w: Words) -> UVec4 {
    let [x, y, z, w] = [unit_f32(w.x), unit_f32(w.y), unit_f32(w.z), unit_f32(w.w)];
    UVec4::new(x.to_bits(), y.to_bits(), z.to_bits(), w.to_bits())
}

/// Runs the operation that `params.operation` names; the constants above state the rows. Returns
/// zeros for any other number.
#[inline(always)]
pub fn sampling(params: &ProbeParams, _: Scene, input: Input) -> Output {
    let key = PathKey { seed: input.a.x, pixel: input.a.y, sample: input.a.z };
    let operation = params.operation;
    let mut out = Output { a: UVec4::ZERO, b: UVec4::ZERO };
    if operation == INDEPENDENT {
        let w = sampler::words(FeatureSet::<0>::ALL, key, input.a.w);
        out = Output { a: UVec4::new(w.x, w.y, w.z, w.w), b: numbers(w) };
    } else if operation == SEQUENCE {
        let w = sampler::words(FeatureSet::<SOBOL>::ALL, key, input.a.w);
        out = Output { a: UVec4::new(w.x, w.y, w.z, w.w), b: numbers(w) };
    } else if operation == UNIT_SPHERE {
        out.a = row(unit_sphere(input.a.x, input.a.y), 0);
    } else if operation == CAMERA {
        let ray = params.render.camera.ray(input.b.x, input.b.y, words(input.a));
        out = Output { a: row(ray.direction, 0), b: row(ray.origin, 0) };
    } else if operation == INDEPENDENT_TO_ONE {
        let w = sampler::words(FeatureSet::<0>::ALL, key, input.a.w);
        let number = |bits: u32| (bits as f32 * (1.0 / 4_294_967_296.0)).to_bits();
        out.a = UVec4::new(w.x, w.y, w.z, w.w);
        out.b = UVec4::new(number(w.x), number(w.y), number(w.z), number(w.w));
    }
    out
}
