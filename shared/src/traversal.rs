//! Closest hit of a ray: by the binary BVH with a stack for each ray, near child first, or by a
//! test of each primitive. Paths call it; kernels with [`WIDE`] continue in
//! `wide`.

#[cfg(not(target_arch = "nvptx64"))]
mod binary;
#[cfg(target_arch = "nvptx64")]
mod binary_cuda;

#[cfg(not(target_arch = "nvptx64"))]
use binary::closest_in_tree;
#[cfg(target_arch = "nvptx64")]
use binary_cuda::closest_in_tree;

use crate::bvh::{Child, Hit, NO_PRIMITIVE, RayQuery, Visits};
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use crate::features::WIDE;
use crate::features::{COUNTED, Features, HEAVY, LINEAR, has, has_any};
use crate::params::{FLAG_PADDED_BOXES, RenderParams};
use crate::primitive::{distance, is_closer};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::triangle::Shear;

/// Returns the hit that the search starts with: that of a shadow ray on its light's primitive, if
/// there is one. A primitive behind the light then cannot end the search, whichever of the two is
/// tested first.
///
/// # Safety
///
/// As [`closest_hit`]; the light's primitive is a primitive of the scene, or [`NO_PRIMITIVE`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn initial_hit<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    shear: &Shear,
    query: RayQuery,
) -> Hit {
    let mut hit = Hit { distance: query.t_max, primitive: NO_PRIMITIVE };
    if query.any_hit && query.light_primitive != NO_PRIMITIVE {
        // SAFETY: the caller's promise.
        let t = unsafe { distance::<FEATURES>(params, scene, ray, shear, query.light_primitive) };
        if t < hit.distance {
            hit = Hit { distance: t, primitive: query.light_primitive };
        }
    }
    hit
}

/// Returns the closest hit by a test of each primitive.
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
    query: RayQuery,
) -> (Hit, Visits) {
    let shear = Shear::new(ray.direction);
    // SAFETY: the caller's promise.
    let mut hit = unsafe { initial_hit::<FEATURES>(params, scene, ray, &shear, query) };
    let mut primitive = 0;
    let mut visits = Visits::NONE;
    while primitive < params.primitive_count {
        if const { has(FEATURES, COUNTED) } {
            visits.leaves += 1;
        }
        // SAFETY: the caller's promise that there are `primitive_count` primitives.
        let t = unsafe { distance::<FEATURES>(params, scene, ray, &shear, primitive) };
        if is_closer(t, primitive, hit.distance, hit.primitive) {
            hit = Hit { distance: t, primitive };
            if query.any_hit && primitive != query.light_primitive {
                break;
            }
        }
        primitive += 1;
    }
    (hit, visits)
}

/// Returns the closest primitive in front of `ray`, as `query` limits it. Of several primitives at
/// one distance it returns the first by index, so the hit does not depend on the order of the
/// tests.
///
/// # Safety
///
/// `params.root`, `params.primitive_count` and the scene's indices were proven as [`crate::buffer`]
/// says, and the CPU has the instruction set that `FEATURES` names, if it names one.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> Hit {
    // SAFETY: the caller's promise.
    unsafe { closest_hit_below::<FEATURES>(params, scene, ray, query, Child(params.root)) }
}

/// Returns the closest hit of a ray that meets nothing outside of the subtree at `root`. Only a
/// search of the binary BVH makes use of `root`.
///
/// # Safety
///
/// As [`closest_hit`]; `root` is the root of the BVH, or the [entry](crate::tile_entry::tile_entry)
/// of the ray's tile.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit_below<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
    root: Child,
) -> Hit {
    // SAFETY: the caller's promise.
    unsafe { search::<FEATURES>(params, scene, ray, query, root).0 }
}

/// Returns the hit of [`closest_hit`], and the visits of the search if `FEATURES` has [`COUNTED`].
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
    query: RayQuery,
) -> (Hit, Visits) {
    // SAFETY: the caller's promise.
    unsafe { search::<FEATURES>(params, scene, ray, query, Child(params.root)) }
}

/// Returns the closest hit by the traversal that `FEATURES` names.
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
    query: RayQuery,
    root: Child,
) -> (Hit, Visits) {
    if const { has(FEATURES, LINEAR) } {
        // SAFETY: the caller's promise.
        return unsafe { closest_of_all::<FEATURES>(params, scene, ray, query) };
    }
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    if const { has(FEATURES, WIDE) } {
        // SAFETY: the caller's promise for the wide tree, and for the instruction sets that
        // FEATURES names.
        return unsafe { crate::wide::dispatch::<FEATURES>(params, scene, ray, query) };
    }
    // Padded boxes are cheaper to test (docs/notebook/camera-ray-tiles.md). Heavy kernels use them
    // on CUDA only: on Vulkan they gain little and take long to compile. ptxas places loops by how
    // a choice is written: this form is faster in heavy kernels, the `match` below in all others.
    if const { cfg!(target_arch = "nvptx64") && has_any(FEATURES, HEAVY) }
        && params.flags & FLAG_PADDED_BOXES != 0
    {
        // SAFETY: the caller's promise.
        return unsafe { closest_in_tree::<FEATURES, true>(params, scene, ray, query, root) };
    }
    if const { cfg!(any(target_arch = "nvptx64", target_arch = "spirv")) && !has_any(FEATURES, HEAVY) } {
        return match params.flags & FLAG_PADDED_BOXES != 0 {
            // SAFETY: the caller's promise.
            true => unsafe { closest_in_tree::<FEATURES, true>(params, scene, ray, query, root) },
            // SAFETY: the caller's promise.
            false => unsafe { closest_in_tree::<FEATURES, false>(params, scene, ray, query, root) },
        };
    }
    // SAFETY: the caller's promise.
    unsafe { closest_in_tree::<FEATURES, false>(params, scene, ray, query, root) }
}
