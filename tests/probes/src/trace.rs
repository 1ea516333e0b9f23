//! Probe of rays through a scene: closest hits, and rays that leave them.

use crate::record::{Input, Output, ProbeParams, row, vector};
use glam::UVec4;
use trisect_shared::bvh::{Hit, NO_PRIMITIVE, RayQuery};
use trisect_shared::features::{FeatureSet, Features, INSTANCES, SHAPES};
use trisect_shared::primitive::distance;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::MISS;
use trisect_shared::surface;
use trisect_shared::traversal::closest_hit;
use trisect_shared::triangle::Shear;

/// Features of the traversal: all that decide what is hit.
const HIT: Features = SHAPES | INSTANCES;

/// Closest hit. Rows: a origin, and the primitive that the ray leaves or [`NO_PRIMITIVE`]; b
/// direction, and whether inward. Output: a normal and primitive; b distance and
/// instance.
pub const CLOSEST: u32 = 0;
/// Closest hit by a test of each primitive, without the BVH; rows and output of [`CLOSEST`].
pub const LINEAR: u32 = 1;
/// Closest hit, and the closest hit of a ray that leaves it along row c. Rows: a origin; b
/// direction; c outgoing direction. Output: a origin of the second ray, and the primitive it hits;
/// b first and second distance, the primitive of the first hit, and the instance of the second.
pub const LEAVE_SURFACE: u32 = 2;
/// [`LEAVE_SURFACE`] with a second ray that starts at the end of the first one, in free space and
/// without an offset: a negative control.
pub const LEAVE_WITHOUT_OFFSET: u32 = 3;

/// Runs the operation that `params.operation` names; the constants above state rows and output.
///
/// # Safety
///
/// The scene must have been validated, as the kernels require.
#[inline(always)]
#[allow(unsafe_code, reason = "reads the scene without bounds checks, as the kernels do")]
pub unsafe fn trace(params: &ProbeParams, scene: Scene, input: Input) -> Output {
    let mut origin_primitive = OriginPrimitive::NONE;
    if input.a.w != NO_PRIMITIVE {
        origin_primitive = OriginPrimitive::new(input.a.w, input.b.w != 0);
    }
    let ray = Ray::in_world(vector(input.a), vector(input.b), origin_primitive);
    let mut out = Output { a: UVec4::ZERO, b: UVec4::ZERO };
    // SAFETY: the caller guarantees it.
    let hit = unsafe {
        if params.operation == LINEAR {
            closest_by_linear_search(params, scene, ray)
        } else {
            closest_hit(FeatureSet::<HIT>::ALL, &params.render, scene, ray, RayQuery::CLOSEST)
        }
    };
    out.a.w = hit.primitive;
    (out.b.x, out.b.y) = (hit.distance.to_bits(), hit.instance);
    if hit.primitive != NO_PRIMITIVE {
        // SAFETY: traversal returns a primitive of the scene.
        let surface = unsafe { surface::at(FeatureSet::<HIT>::ALL, &params.render, scene, ray, hit) };
        out.a = row(surface.normal, hit.primitive);
        if params.operation >= LEAVE_SURFACE {
            let direction = vector(input.c);
            let inside = direction.dot(surface.normal) < 0.0;
            let mut next = Ray {
                origin: surface::offset_ray_origin(
                    surface.point,
                    surface.normal,
                    surface.error_bound,
                    !inside,
                ),
                direction,
                origin_primitive: OriginPrimitive::new(hit.primitive, inside),
                origin_instance: hit.instance,
            };
            if params.operation == LEAVE_WITHOUT_OFFSET {
                next.origin = ray.origin + ray.direction * hit.distance;
                next.origin_primitive = OriginPrimitive::NONE;
            }
            // SAFETY: the caller guarantees it.
            let second = unsafe {
                closest_hit(FeatureSet::<HIT>::ALL, &params.render, scene, next, RayQuery::CLOSEST)
            };
            out.a = row(next.origin, second.primitive);
            out.b =
                UVec4::new(hit.distance.to_bits(), second.distance.to_bits(), hit.primitive, second.instance);
        }
    }
    out
}

/// Returns the closest hit among all primitives; of hits at equal distances, the first.
#[inline(always)]
#[allow(unsafe_code, reason = "as above")]
unsafe fn closest_by_linear_search(params: &ProbeParams, scene: Scene, ray: Ray) -> Hit {
    let shear = Shear::new(ray.direction);
    let count = params.render.primitive_count;
    let mut best = Hit::in_world(MISS, NO_PRIMITIVE);
    let mut index = 0;
    while index < count {
        // SAFETY: the index is below the number of primitives.
        let t = unsafe { distance(FeatureSet::<HIT>::ALL, &params.render, scene, ray, &shear, index) };
        if t < best.distance {
            best = Hit::in_world(t, index);
        }
        index += 1;
    }
    best
}
