//! Traversal of the binary BVH on the CPU and in SPIR-V kernels; CUDA has `binary_cuda`. The parent
//! module calls it.

use super::initial_hit;
use crate::buffer::{load, load_local, store_local};
use crate::bvh::{BvhNode, Child, Hit, NO_INSTANCE, RayQuery, STACK_SIZE, Visits};
use crate::features::{COUNTED, FeatureSet, Features, HEAVY, INSTANCES, PADDED_BOXES};
use crate::instance;
use crate::params::RenderParams;
use crate::primitive::{distance, is_closer};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::slabs::{BoxHits, RayReciprocals, intersect_boxes};
use crate::triangle::Shear;
use core::mem::MaybeUninit;

/// Returns the hit below `root` that `query` asks for, and the visits if the kernel has
/// [`COUNTED`].
///
/// The loops are "while-while" (Aila and Laine 2009): a lane descends to a leaf, waits for the
/// others, tests it, and continues with the stack. In heavy SPIR-V kernels it waits for at most
/// two nodes, which is faster in those kernels only (docs/notebook/vulkan.md).
///
/// # Safety
///
/// As [`closest_hit_below`](super::closest_hit_below).
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
    let mut shear = Shear::new(ray.direction); // unused without triangles
    let mut reciprocals = RayReciprocals::new(ray.origin, ray.direction);
    // SAFETY: the caller's promise.
    let mut hit = unsafe { initial_hit(features, params, scene, ray, &shear, query) };
    // Not cleared: clearing 256 bytes for each ray costs more than all the boxes that it tests.
    // Stack and depth are separate variables, and the steps are macros. In one record with the
    // depth, LLVM would clear the stack as well; and a record cannot borrow the stack, because
    // SPIR-V has no pointers in records.
    let mut stack = MaybeUninit::<[u32; STACK_SIZE]>::uninit();
    let mut depth = 0u32;
    let mut child = root;
    let mut visits = Visits::NONE;
    macro_rules! pop {
        () => {
            child = Child::EMPTY;
            if depth > 0 {
                depth -= 1;
                // SAFETY: `depth` entries were stored.
                child = Child(unsafe { load_local(&stack, depth) });
            }
        };
    }
    macro_rules! visit {
        () => {
            if features.has::<COUNTED>() {
                visits.nodes += 1;
            }
            // SAFETY: the caller's promise for each child's index.
            let node = unsafe { load::<BvhNode>(scene.nodes, child.index()) };
            let BoxHits { first, second, t_first, t_second } = intersect_boxes(
                features.has::<PADDED_BOXES>(),
                local.origin,
                &reciprocals,
                &node,
                hit.distance,
            );
            if first {
                if second {
                    let second_is_near = t_second < t_first;
                    child = Child(if second_is_near { node.second } else { node.first });
                    let far = if second_is_near { node.first } else { node.second };
                    // SAFETY: there is at most one push a level, and the caller promises the number
                    // of levels.
                    unsafe { store_local(&mut stack, depth, far) };
                    depth += 1;
                } else {
                    child = Child(node.first);
                }
            } else if second {
                child = Child(node.second);
            } else {
                pop!();
            }
        };
    }
    macro_rules! test {
        () => {
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
                        pop!();
                    }
                );
                continue;
            }
            let primitive = child.index();
            // SAFETY: the caller's promise.
            let t = unsafe { distance(features, params, scene, local, &shear, primitive) };
            if is_closer(t, primitive, hit.distance, hit.primitive)
                || hit.is_after(features, t, primitive, instance)
            {
                hit = Hit { distance: t, primitive, instance };
                if query.any_hit && primitive != query.light_primitive {
                    depth = 0;
                }
            }
            pop!();
        };
    }
    // `pop` sets `EMPTY` when the stack is empty. Its top bit is set, so it counts as a leaf.
    if cfg!(target_arch = "spirv") && features.has::<HEAVY>() {
        while child != Child::EMPTY {
            if !child.is_leaf() {
                visit!();
            }
            if !child.is_leaf() {
                visit!();
            }
            if child.is_leaf() && child != Child::EMPTY {
                test!();
            }
        }
    } else {
        loop {
            while !child.is_leaf() {
                visit!();
            }
            if child == Child::EMPTY {
                break;
            }
            test!();
        }
    }
    (hit, visits)
}
