//! Intersection of a ray with one primitive of any kind, and the order of hits. Traversals call it.

use crate::buffer::load_record;
#[cfg(doc)]
use crate::bvh::NO_PRIMITIVE;
use crate::features::{FeatureSet, Features, PLANAR, SPHERES, TRIANGLES};
use crate::params::RenderParams;
use crate::planar::Planar;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::sphere::{MISS, Sphere};
use crate::triangle::{Shear, Triangle};

/// Returns whether primitive `index` is a triangle.
#[inline(always)]
pub(crate) fn is_triangle<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    index: u32,
) -> bool {
    features.has::<TRIANGLES>() && (!features.has::<{ SPHERES | PLANAR }>() || index >= params.first_triangle)
}

/// Returns whether primitive `index`, which is no triangle, is a planar shape, not a sphere.
#[inline(always)]
pub(crate) fn is_planar<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    index: u32,
) -> bool {
    features.has::<PLANAR>() && (!features.has::<SPHERES>() || index >= params.first_planar)
}

/// Returns the distance along `ray` to primitive `index`, or [`MISS`]; `shear` is that of the ray's
/// direction.
///
/// # Safety
///
/// `index` is below the number of the scene's primitives, and `params` belongs to this scene.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn distance<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    shear: &Shear,
    index: u32,
) -> f32 {
    let is_origin = ray.origin_primitive.is_on(index);
    if is_triangle(features, params, index) {
        // SAFETY: the caller's promise for each child's index.
        let triangle = unsafe { load_record::<Triangle>(scene.triangles, index - params.first_triangle) };
        let t = triangle.hit(ray.origin, shear).distance;
        return if is_origin { MISS } else { t };
    }
    if is_planar(features, params, index) {
        // SAFETY: as above.
        let planar = unsafe { load_record::<Planar>(scene.planars, index - params.first_planar) };
        let t = planar.distance(ray.origin, ray.direction);
        return if is_origin { MISS } else { t };
    }
    // SAFETY: as above.
    let sphere = unsafe { load_record::<Sphere>(scene.spheres, index) };
    sphere.distance(ray.origin, ray.direction, is_origin, ray.origin_primitive)
}

/// Returns whether a hit of `primitive` at `t` comes before the hit of `closest` at `best`. At
/// equal distances the lower number comes first. ([`NO_PRIMITIVE`] is -1 here, so nothing ties with
/// it.)
#[inline(always)]
pub(crate) fn is_closer(t: f32, primitive: u32, best: f32, closest: u32) -> bool {
    (t < best) | ((t == best) & ((primitive as i32) < closest as i32))
}
