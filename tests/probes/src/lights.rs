//! Next-event estimation.

use crate::record::{Input, Output, ProbeParams, row, vector, words};
use trisect_shared::features::{ALL, TEXTURES};
use trisect_shared::light::{ReferencePoint, sample};
use trisect_shared::scene::Scene;

/// Rows: a point and its primitive; b words; c the panorama's word. Output: a direction and density; b radiance and limit.
///
/// # Safety
///
/// The scene is proven, as the kernels demand.
#[inline(always)]
#[allow(unsafe_code, reason = "reads the scene without bounds checks, as the kernels do")]
pub unsafe fn lights(params: &ProbeParams, scene: Scene, input: Input) -> Output {
    let from = ReferencePoint { point: vector(input.a), primitive: input.a.w };
    // SAFETY: the caller's promise.
    let light =
        unsafe { sample::<{ ALL & !TEXTURES }>(&params.render, scene, from, words(input.b), input.c.x) };
    Output { a: row(light.direction, light.pdf.to_bits()), b: row(light.radiance, light.t_max.to_bits()) }
}
