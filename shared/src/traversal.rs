//! Closest hit of a ray: by the binary BVH with a stack for each ray, near child first, or by a
//! test of each primitive. Paths call it; kernels with [`WIDE`] continue in
//! `wide`.

/// Visits an inner node, if `$child` is one, and sets `$child` to what the search visits next: the
/// nearer child that the ray enters, or what `$stack` has on top. It is a macro, because a stack in
/// a record would be cleared for each ray.
macro_rules! visit_node {
    ($features:expr, $scene:expr, $ray:expr, $reciprocals:expr, $hit:expr, $child:ident, $depth:ident, $stack:expr) => {
        if !$child.is_leaf() {
            // SAFETY: the caller's promise for each child's index.
            let node = unsafe { load::<BvhNode>($scene.nodes, $child.index()) };
            let padded = $features.has::<PADDED_BOXES>();
            let BoxHits { first, second, t_first, t_second } =
                intersect_boxes(padded, $ray.origin, &$reciprocals, &node, $hit.distance);
            if first {
                if second {
                    let second_is_near = t_second < t_first;
                    $child = Child(if second_is_near { node.second } else { node.first });
                    let far = if second_is_near { node.first } else { node.second };
                    // SAFETY: there is at most one push a level, and the caller promises the number
                    // of levels.
                    unsafe { store_local($stack, $depth, far) };
                    $depth += 1;
                } else {
                    $child = Child(node.first);
                }
            } else if second {
                $child = Child(node.second);
            } else {
                $depth -= 1;
                // SAFETY: `$depth` entries were stored.
                $child = Child(unsafe { load_local($stack, $depth) });
            }
        }
    };
}

/// Continues the search of `$ray` at a leaf of an instance, or at [`Child::LEAVE`]: sets `$local`
/// to the ray in the coordinates there, with its `$shear` and `$reciprocals`, `$instance` to the
/// instance, and `$child` to what the search visits next, which `$pop` takes from the stack.
macro_rules! cross_instance {
    ($params:expr, $scene:expr, $ray:expr, $child:ident, $depth:ident, $stack:expr, $local:ident, $instance:ident, $shear:ident, $reciprocals:ident, $pop:block) => {
        if $child == Child::LEAVE {
            ($local, $instance) = ($ray, NO_INSTANCE);
            $pop
        } else {
            // SAFETY: the caller's promise for each child's index; the host counts a level for the
            // entry.
            unsafe {
                $instance = $child.index() - $params.first_instance;
                let entry = instance::entry($params, $scene, $instance);
                store_local($stack, $depth, Child::LEAVE.0);
                $local = entry.enter($ray, $instance);
                $child = Child(entry.root);
            }
            $depth += 1;
        }
        $shear = Shear::new($local.direction);
        $reciprocals = RayReciprocals::new($local.origin, $local.direction);
    };
}

#[cfg(not(target_arch = "nvptx64"))]
mod binary;
#[cfg(target_arch = "nvptx64")]
mod binary_cuda;
mod interleaved;

#[cfg(not(target_arch = "nvptx64"))]
use binary::closest_in_tree;
#[cfg(target_arch = "nvptx64")]
use binary_cuda::closest_in_tree;

pub use interleaved::{Search, Stack};

use crate::bvh::{Child, Hit, NO_PRIMITIVE, RayQuery, Visits};
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use crate::features::WIDE;
use crate::features::{COUNTED, FeatureSet, Features, INSTANCES, LINEAR};
use crate::instance;
use crate::params::RenderParams;
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
unsafe fn initial_hit<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    shear: &Shear,
    query: RayQuery,
) -> Hit {
    let mut hit = Hit::in_world(query.t_max, NO_PRIMITIVE);
    if query.any_hit && query.light_primitive != NO_PRIMITIVE {
        // SAFETY: the caller's promise.
        let t = unsafe { distance(features, params, scene, ray, shear, query.light_primitive) };
        if t < hit.distance {
            hit = Hit::in_world(t, query.light_primitive);
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
unsafe fn closest_of_all<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> (Hit, Visits) {
    let shear = Shear::new(ray.direction);
    // SAFETY: the caller's promise.
    let mut hit = unsafe { initial_hit(features, params, scene, ray, &shear, query) };
    let (mut primitive, mut searches) = (0, true);
    let mut visits = Visits::NONE;
    while searches && primitive < params.primitive_count {
        if features.has::<COUNTED>() {
            visits.leaves += 1;
        }
        // SAFETY: the caller's promise that there are `primitive_count` primitives.
        let t = unsafe { distance(features, params, scene, ray, &shear, primitive) };
        if is_closer(t, primitive, hit.distance, hit.primitive) {
            hit = Hit::in_world(t, primitive);
            searches = !query.any_hit || primitive == query.light_primitive;
        }
        primitive += 1;
    }
    if features.has::<INSTANCES>() && searches {
        // SAFETY: the caller's promise.
        unsafe { closest_of_instances(features, params, scene, ray, query, &mut hit, &mut visits) };
    }
    (hit, visits)
}

/// Sets `hit` to the closest hit by a test of each triangle of each instance, if it is closer.
///
/// # Safety
///
/// As [`closest_hit`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn closest_of_instances<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
    hit: &mut Hit,
    visits: &mut Visits,
) {
    // One exit each: naga does not follow others out of nested loops.
    let (mut number, mut searches) = (0, true);
    while searches && number < params.instance_count {
        // SAFETY: the caller's promise.
        let entry = unsafe { instance::entry(params, scene, number) };
        let local = entry.enter(ray, number);
        let shear = Shear::new(local.direction);
        let mut index = 0;
        while searches && index < entry.triangle_count {
            let primitive = entry.first_triangle + index;
            if features.has::<COUNTED>() {
                visits.leaves += 1;
            }
            // SAFETY: the caller's promise.
            let t = unsafe { distance(features, params, scene, local, &shear, primitive) };
            if is_closer(t, primitive, hit.distance, hit.primitive)
                || hit.is_after(features, t, primitive, number)
            {
                *hit = Hit { distance: t, primitive, instance: number };
                searches = !query.any_hit;
            }
            index += 1;
        }
        number += 1;
    }
}

/// Returns the closest primitive in front of `ray`, as `query` limits it. Of several primitives at
/// one distance it returns the first by index, and of coincident instances the first, so the hit
/// does not depend on the order of the tests.
///
/// # Safety
///
/// `params.root`, `params.primitive_count` and the scene's indices were proven as [`crate::buffer`]
/// says, and the CPU has the instruction set that the features name, if they name one.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> Hit {
    // SAFETY: the caller's promise.
    unsafe { closest_hit_below(features, params, scene, ray, query, Child(params.root)) }
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
pub unsafe fn closest_hit_below<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
    root: Child,
) -> Hit {
    // SAFETY: the caller's promise.
    unsafe { search(features, params, scene, ray, query, root).0 }
}

/// Returns the hit of [`closest_hit`], and the visits of the search if the kernel has [`COUNTED`].
///
/// # Safety
///
/// As [`closest_hit`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit_counted<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> (Hit, Visits) {
    // SAFETY: the caller's promise.
    unsafe { search(features, params, scene, ray, query, Child(params.root)) }
}

/// Returns the closest hit by the traversal that the features name.
///
/// # Safety
///
/// As [`closest_hit_below`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn search<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
    root: Child,
) -> (Hit, Visits) {
    if features.has::<LINEAR>() {
        // SAFETY: the caller's promise.
        return unsafe { closest_of_all(features, params, scene, ray, query) };
    }
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    if features.has::<WIDE>() {
        // SAFETY: the caller's promise for the wide tree, and for the instruction sets that
        // features name.
        return unsafe { crate::wide::dispatch(features, params, scene, ray, query) };
    }
    // SAFETY: the caller's promise.
    unsafe { closest_in_tree(features, params, scene, ray, query, root) }
}
