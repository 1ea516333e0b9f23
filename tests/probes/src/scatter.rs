//! Probe of BSDFs: samples and evaluates a material, given by its index in the scene.

use crate::record::{Input, Output, ProbeParams, row, vector, words};
use glam::UVec4;
use trisect_shared::bsdf::{Bsdf, BsdfNormals};
use trisect_shared::buffer::load;
use trisect_shared::features::{BOOK, FeatureSet, MICROFACETS, SCHLICK, to_words};
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
    const { assert!(to_words(BOOK | MICROFACETS | SCHLICK)[1] == 0) };
    let schlick = if params.operation == SAMPLE_SCHLICK { const { to_words(SCHLICK)[0] } } else { 0 };
    let materials = const { to_words(BOOK | MICROFACETS)[0] };
    let features = FeatureSet::<{ BOOK | MICROFACETS | SCHLICK }>::of_words(materials | schlick, 0);
    // SAFETY: the caller guarantees it.
    let material = unsafe { load::<Material>(scene.materials, input.a.w) };
    let bsdf =
        Bsdf::new(features, material, vector(input.a), BsdfNormals::plain(vector(input.b)), input.b.w != 0);
    let mut out = Output { a: UVec4::ZERO, b: UVec4::ZERO };
    if params.operation == EVALUATE {
        let evaluation = bsdf.evaluate(features, vector(input.c));
        out.a = row(evaluation.value, evaluation.pdf.to_bits());
    } else {
        let sample = bsdf.sample(features, words(input.c));
        out.a = row(sample.direction, sample.transmitted as u32 | (sample.absorbed as u32) << 1);
        out.b = row(sample.weight, sample.pdf.to_bits());
    }
    out
}
