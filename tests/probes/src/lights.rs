//! Probe of next-event estimation: one sample of a light.

use crate::record::{Input, Output, ProbeParams, row, vector, words};
use glam::Vec3;
use trisect_shared::features::{FeatureSet, LIGHT_TREE, NEEDS, OF_SURFACES};
use trisect_shared::light::{ReferencePoint, sample};
use trisect_shared::rng::Words;
use trisect_shared::scene::Scene;

/// Samples a light. Row a: point and its primitive; row b: random words; row c: random word that
/// decides on the sky. Output a: direction and pdf; b: radiance and the shadow ray's
/// `t_max`.
///
/// # Safety
///
/// The scene must have been validated, as the kernels require.
#[inline(always)]
#[allow(unsafe_code, reason = "reads the scene without bounds checks, as the kernels do")]
pub unsafe fn lights(params: &ProbeParams, scene: Scene, input: Input) -> Output {
    let from = ReferencePoint { point: vector(input.a), primitive: input.a.w, normal: Vec3::ZERO };
    // SAFETY: the caller guarantees it.
    let light = unsafe {
        sample(
            FeatureSet::<{ NEEDS & !OF_SURFACES & !LIGHT_TREE }>::ALL,
            &params.render,
            scene,
            from,
            words(input.b),
            Words { x: input.c.x, y: input.c.x, z: 0, w: 0 },
        )
    };
    Output { a: row(light.direction, light.pdf.to_bits()), b: row(light.radiance, light.t_max.to_bits()) }
}
