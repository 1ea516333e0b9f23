//! Traversal of the binary BVH on CUDA.

use super::initial_hit;
use crate::buffer::{load, load_local, store_local};
use crate::bvh::{BvhNode, Child, Hit, NO_INSTANCE, RayQuery, STACK_SIZE, Visits};
use crate::features::{COUNTED, FeatureSet, Features, INSTANCES, PADDED_BOXES};
use crate::instance;
use crate::params::RenderParams;
use crate::primitive::{distance, is_closer};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::slabs::{BoxHits, RayReciprocals, intersect_boxes};
use crate::triangle::Shear;
use core::mem::MaybeUninit;

/// Returns the closest hit below `root`, as `binary` does on other targets. Lanes with a leaf wait
/// for the others to visit a second node, so that more of them test together, which is faster on
/// CUDA (docs/notebook/kernels-and-schedules.md).
///
/// # Safety
///
/// As [`closest_hit`](super::closest_hit).
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_in_tree<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
    root: Child,
) -> (Hit, Visits) {
    // The ray in the coordinates of the instance that it is in.
    let (mut local, mut instance) = (ray, NO_INSTANCE);
    let mut shear = Shear::new(ray.direction);
    let mut reciprocals = RayReciprocals::new(ray.origin, ray.direction);
    // SAFETY: the caller's promise.
    let mut hit = unsafe { initial_hit(features, params, scene, ray, &shear, query) };
    // One entry more than levels: the lowest is `EMPTY`, which ends the search.
    let mut stack = MaybeUninit::<[u32; STACK_SIZE + 1]>::uninit();
    // SAFETY: the stack has a first entry.
    unsafe { store_local(&mut stack, 0, Child::EMPTY.0) };
    let mut depth = 1u32;
    let mut child = root;
    let mut visits = Visits::NONE;
    macro_rules! visit {
        () => {
            if features.has::<COUNTED>() {
                visits.nodes += u32::from(!child.is_leaf());
            }
            visit_node!(features, scene, local, reciprocals, hit, child, depth, &mut stack);
        };
    }
    while child != Child::EMPTY {
        // Two nodes before a leaf; written out, because LLVM does not unroll a loop of this size.
        visit!();
        visit!();
        if child.is_leaf() && child != Child::EMPTY {
            if features.has::<COUNTED>() {
                visits.leaves += u32::from(child != Child::LEAVE);
            }
            if features.has::<INSTANCES>() && child.index() >= params.first_instance {
                cross_instance!(
                    params,
                    scene,
                    ray,
                    child,
                    depth,
                    &mut stack,
                    local,
                    instance,
                    shear,
                    reciprocals,
                    {
                        depth -= 1;
                        // SAFETY: `depth` entries were stored.
                        child = Child(unsafe { load_local(&stack, depth) });
                    }
                );
                continue;
            }
            let primitive = child.index();
            depth -= 1;
            // SAFETY: `depth` entries were stored.
            child = Child(unsafe { load_local(&stack, depth) });
            // SAFETY: the caller's promise.
            let t = unsafe { distance(features, params, scene, local, &shear, primitive) };
            if is_closer(t, primitive, hit.distance, hit.primitive)
                || hit.is_after(features, t, primitive, instance)
            {
                hit = Hit { distance: t, primitive, instance };
                if query.any_hit && primitive != query.light_primitive {
                    child = Child::EMPTY;
                }
            }
        }
    }
    (hit, visits)
}
