//! Probe of traversal's cost: the nodes and leaves that a ray visits.

use crate::record::{Input, Output, ProbeParams, vector};
use glam::UVec4;
use trisect_shared::bvh::{NO_PRIMITIVE, RayQuery};
use trisect_shared::features::{COUNTED, FeatureSet, SHAPES};
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene::Scene;
use trisect_shared::traversal::closest_hit_counted;

/// Closest hit. Rows: a origin, and the primitive that the ray leaves or [`NO_PRIMITIVE`]; b
/// direction. Output a: visited nodes, tested leaves, the primitive, the distance's bits.
pub const CLOSEST: u32 = 0;
/// Any hit, as for a shadow ray, which ends at the first one found; rows and output of [`CLOSEST`].
pub const SHADOW: u32 = 1;

/// Counts the visits of one ray.
///
/// # Safety
///
/// The scene must have been validated, as the kernels require.
#[inline(always)]
#[allow(unsafe_code, reason = "reads the scene without bounds checks, as the kernels do")]
pub unsafe fn visits(params: &ProbeParams, scene: Scene, input: Input) -> Output {
    let mut origin_primitive = OriginPrimitive::NONE;
    if input.a.w != NO_PRIMITIVE {
        origin_primitive = OriginPrimitive::new(input.a.w, false);
    }
    let ray = Ray::in_world(vector(input.a), vector(input.b), origin_primitive);
    let query = RayQuery { any_hit: params.operation == SHADOW, ..RayQuery::CLOSEST };
    // SAFETY: the caller guarantees it.
    let (hit, visits) = unsafe {
        closest_hit_counted(FeatureSet::<{ SHAPES | COUNTED }>::ALL, &params.render, scene, ray, query)
    };
    let answer = UVec4::new(visits.nodes, visits.leaves, hit.primitive, hit.distance.to_bits());
    Output { a: answer, b: UVec4::ZERO }
}
