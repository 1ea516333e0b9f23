//! The closest hit: by the binary tree with a stack a ray, near child first; and by a test of each primitive.

#[cfg(not(target_arch = "nvptx64"))]
mod binary;
#[cfg(target_arch = "nvptx64")]
mod binary_cuda;

#[cfg(not(target_arch = "nvptx64"))]
use binary::closest_in_tree;
#[cfg(target_arch = "nvptx64")]
use binary_cuda::closest_in_tree;

use crate::buffer::load;
use crate::bvh::{Child, Hit, NO_PRIMITIVE, Reach, Visits};
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use crate::features::WIDE;
use crate::features::{COUNTED, FLATS, Features, LARGE, LINEAR, TRIANGLES, has, has_any};
use crate::flat::Flat;
use crate::params::{FLAG_ROOM, RenderParams};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::sphere::{MISS, Sphere};
use crate::triangle::{Shear, Triangle};

/// Distance to primitive `index`, or [`MISS`]; `shear` is of the ray's direction.
///
/// # Safety
///
/// `index` is below the number of the scene's primitives, and `params` of this scene.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn distance<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    shear: &Shear,
    index: u32,
) -> f32 {
    let leaves = ray.departure.is_on(index);
    if const { has(FEATURES, TRIANGLES) } && index >= params.first_triangle {
        // SAFETY: the caller's promise for each child's index.
        let triangle = unsafe { load::<Triangle>(scene.triangles, index - params.first_triangle) };
        let t = triangle.hit(ray.origin, shear).distance;
        return if leaves { MISS } else { t };
    }
    if const { has(FEATURES, FLATS) } && index >= params.first_flat {
        // SAFETY: as above.
        let flat = unsafe { load::<Flat>(scene.flats, index - params.first_flat) };
        let t = flat.distance(ray.origin, ray.direction);
        return if leaves { MISS } else { t };
    }
    // SAFETY: as above.
    let sphere = unsafe { load::<Sphere>(scene.spheres, index) };
    sphere.distance(ray.origin, ray.direction, leaves, ray.departure)
}

/// Whether a hit of `primitive` at `t` comes before that of `closest` at `best`. ([`NO_PRIMITIVE`] is -1: nothing ties with it.)
#[inline(always)]
pub(crate) fn is_closer(t: f32, primitive: u32, best: f32, closest: u32) -> bool {
    (t < best) | ((t == best) & ((primitive as i32) < closest as i32))
}

/// What a ray knows before it looks: where it meets the target, so that what is behind that does not end the search of a shadow ray, whichever
/// is met first.
///
/// # Safety
///
/// As [`closest_hit`]; the target is a primitive of the scene, or [`NO_PRIMITIVE`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn start<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    shear: &Shear,
    reach: Reach,
) -> Hit {
    let mut hit = Hit { distance: reach.limit, primitive: NO_PRIMITIVE };
    if reach.any && reach.target != NO_PRIMITIVE {
        // SAFETY: the caller's promise.
        let t = unsafe { distance::<FEATURES>(params, scene, ray, shear, reach.target) };
        if t < hit.distance {
            hit = Hit { distance: t, primitive: reach.target };
        }
    }
    hit
}

/// Tests each primitive.
///
/// # Safety
///
/// As [`closest_hit`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn closest_of_all<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    reach: Reach,
) -> (Hit, Visits) {
    let shear = Shear::new(ray.direction);
    // SAFETY: the caller's promise.
    let mut hit = unsafe { start::<FEATURES>(params, scene, ray, &shear, reach) };
    let mut primitive = 0;
    let mut visits = Visits::NONE;
    while primitive < params.primitives {
        if const { has(FEATURES, COUNTED) } {
            visits.leaves += 1;
        }
        // SAFETY: the caller's promise for the number of primitives.
        let t = unsafe { distance::<FEATURES>(params, scene, ray, &shear, primitive) };
        if is_closer(t, primitive, hit.distance, hit.primitive) {
            hit = Hit { distance: t, primitive };
            if reach.any && primitive != reach.target {
                break;
            }
        }
        primitive += 1;
    }
    (hit, visits)
}

/// The closest primitive in front of `ray`, within `reach`; of several at the same distance the first by index, so that the hit does not
/// depend on the order in which they are met.
///
/// # Safety
///
/// `params.root`, `params.primitives` and the scene's indices were proven as [`crate::buffer`] says; the CPU has the instruction set
/// that `FEATURES` names, if it names one.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    reach: Reach,
) -> Hit {
    // SAFETY: the caller's promise.
    unsafe { closest_hit_below::<FEATURES>(params, scene, ray, reach, Child(params.root)) }
}

/// The same for a ray that meets nothing beside the subtree at `root`. Only a search of the binary tree makes use of that.
///
/// # Safety
///
/// As [`closest_hit`]; `root` is its root, or the [entry](crate::view::entry) of the ray's tile.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit_below<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    reach: Reach,
    root: Child,
) -> Hit {
    // SAFETY: the caller's promise.
    unsafe { search::<FEATURES>(params, scene, ray, reach, root).0 }
}

/// Returns the closest hit, as [`closest_hit`], and what the search visited, if `FEATURES` has
/// [`COUNTED`].
///
/// # Safety
///
/// As [`closest_hit`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit_counted<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    reach: Reach,
) -> (Hit, Visits) {
    // SAFETY: the caller's promise.
    unsafe { search::<FEATURES>(params, scene, ray, reach, Child(params.root)) }
}

/// Searches by the traversal that `FEATURES` names.
///
/// # Safety
///
/// As [`closest_hit_below`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn search<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    reach: Reach,
    root: Child,
) -> (Hit, Visits) {
    if const { has(FEATURES, LINEAR) } {
        // SAFETY: the caller's promise.
        return unsafe { closest_of_all::<FEATURES>(params, scene, ray, reach) };
    }
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    if const { has(FEATURES, WIDE) } {
        // SAFETY: the caller's promise for the wide tree, and for the instruction sets that FEATURES names.
        return unsafe { crate::wide::dispatch::<FEATURES>(params, scene, ray, reach) };
    }
    // Large kernels gain -1 to 8 % on Vulkan. By how a choice is written ptxas places the loops, and an H100 is 2 % faster with the one
    // below in small kernels, and up to 8 % with the other one in large ones.
    if const { cfg!(target_arch = "nvptx64") && has_any(FEATURES, LARGE) } && params.flags & FLAG_ROOM != 0 {
        // SAFETY: the caller's promise.
        return unsafe { closest_in_tree::<FEATURES, true>(params, scene, ray, reach, root) };
    }
    if const { cfg!(any(target_arch = "nvptx64", target_arch = "spirv")) && !has_any(FEATURES, LARGE) } {
        return match params.flags & FLAG_ROOM != 0 {
            // SAFETY: the caller's promise.
            true => unsafe { closest_in_tree::<FEATURES, true>(params, scene, ray, reach, root) },
            // SAFETY: the caller's promise.
            false => unsafe { closest_in_tree::<FEATURES, false>(params, scene, ray, reach, root) },
        };
    }
    // SAFETY: the caller's promise.
    unsafe { closest_in_tree::<FEATURES, false>(params, scene, ray, reach, root) }
}
