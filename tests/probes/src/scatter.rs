//! Probe of BSDFs: samples and evaluates a material, given by its index in the scene.

use crate::record::{Input, Output, ProbeParams, row, vector, words};
use glam::UVec4;
use trisect_shared::bsdf::Bsdf;
use trisect_shared::buffer::load;
use trisect_shared::features::{ALL, TEXTURES};
use trisect_shared::material::Material;
use trisect_shared::scene::Scene;

/// Samples a material. Rows: a incoming direction and material; b normal, and whether the front is
/// hit; c random words. Output: a direction, and bits (1 transmitted, 2 absorbed); b weight and
/// pdf.
pub const SAMPLE: u32 = 0;
/// [`SAMPLE`] with Schlick's approximation.
pub const SAMPLE_SCHLICK: u32 = 1;
/// Evaluates a material. Rows: a incoming direction and material; b normal, and whether the front
/// is hit; c outgoing direction. Output a: value times cosine, and pdf.
pub const EVALUATE: u32 = 2;

/// Runs the operation that `params.operation` names; the constants above state rows and output.
///
/// # Safety
///
/// The material's index must be below the scene's number of materials.
#[inline(always)]
#[allow(unsafe_code, reason = "reads the scene without bounds checks, as the kernels do")]
pub unsafe fn scatter(params: &ProbeParams, scene: Scene, input: Input) -> Output {
    // SAFETY: the caller guarantees it; no texture is read.
    let bsdf = unsafe {
        let material = load::<Material>(scene.materials, input.a.w);
        let (incoming, normal) = (vector(input.a), vector(input.b));
        Bsdf::new::<{ ALL & !TEXTURES }>(scene, material, incoming, normal, input.b.w != 0, (0.0, 0.0))
    };
    let mut out = Output { a: UVec4::ZERO, b: UVec4::ZERO };
    if params.operation == EVALUATE {
        let evaluation = bsdf.evaluate::<{ ALL & !TEXTURES }>(vector(input.c));
        out.a = row(evaluation.value, evaluation.pdf.to_bits());
    } else {
        let schlick = params.operation == SAMPLE_SCHLICK;
        let sample = bsdf.sample::<{ ALL & !TEXTURES }>(schlick, words(input.c));
        out.a = row(sample.direction, sample.transmitted as u32 | (sample.absorbed as u32) << 1);
        out.b = row(sample.weight, sample.pdf.to_bits());
    }
    out
}
