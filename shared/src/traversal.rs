//! The closest hit: by the binary tree with a stack a ray, near child first; and by a test of each primitive.

use crate::buffer::{load, load_local, store_local};
use crate::bvh::{Child, Hit, NO_PRIMITIVE, Reach, STACK_SIZE};
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use crate::features::WIDE;
use crate::features::{FLATS, Features, LINEAR, TRIANGLES, has};
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::slabs::{Entries, Slopes, enter};
use crate::sphere::MISS;
use crate::triangle::Shear;
use core::mem::MaybeUninit;

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
    if has(FEATURES, TRIANGLES) && index >= params.first_triangle {
        // SAFETY: the caller's promise for each child's index.
        let triangle = unsafe { load(scene.triangles, index - params.first_triangle) };
        let t = triangle.hit(ray.origin, shear).distance;
        return if leaves { MISS } else { t };
    }
    if has(FEATURES, FLATS) && index >= params.first_flat {
        // SAFETY: as above.
        let flat = unsafe { load(scene.flats, index - params.first_flat) };
        let t = flat.distance(ray.origin, ray.direction);
        return if leaves { MISS } else { t };
    }
    // SAFETY: as above.
    let sphere = unsafe { load(scene.spheres, index) };
    sphere.distance(ray.origin, ray.direction, leaves, ray.departure)
}

/// Whether a hit of `primitive` at `t` comes before that of `closest` at `best`. ([`NO_PRIMITIVE`] is -1: nothing ties with it.)
#[inline(always)]
pub(crate) fn is_closer(t: f32, primitive: u32, best: f32, closest: u32) -> bool {
    (t < best) | ((t == best) & ((primitive as i32) < closest as i32))
}

/// Inner nodes that a lane visits before it tests a leaf.
const VISITS: u32 = if cfg!(target_arch = "nvptx64") { 2 } else { 1 };

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
) -> Hit {
    let shear = Shear::new(ray.direction);
    let mut hit = Hit { distance: reach.limit, primitive: NO_PRIMITIVE };
    let mut primitive = 0;
    while primitive < params.primitives {
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
    hit
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
    if has(FEATURES, LINEAR) {
        // SAFETY: the caller's promise.
        return unsafe { closest_of_all::<FEATURES>(params, scene, ray, reach) };
    }
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    if has(FEATURES, WIDE) {
        // SAFETY: the caller's promise for the wide tree, and for the instruction sets that FEATURES names.
        return unsafe { crate::wide::dispatch::<FEATURES>(params, scene, ray, reach) };
    }
    // SAFETY: the caller's promise.
    unsafe { closest_in_tree::<FEATURES>(params, scene, ray, reach) }
}

/// Descends the binary tree.
///
/// # Safety
///
/// As [`closest_hit`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn closest_in_tree<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    reach: Reach,
) -> Hit {
    let shear = Shear::new(ray.direction); // without triangles no one reads it
    let slopes = Slopes::new(ray.origin, ray.direction);
    let mut hit = Hit { distance: reach.limit, primitive: NO_PRIMITIVE };
    // Not cleared: 256 bytes for each ray cost more than all the boxes that it tests. Two variables, not a record with methods:
    // LLVM clears the whole of one that holds the length too, and SPIR-V has no pointers in records to borrow the entries.
    let mut stack = Stack::uninit();
    // SAFETY: there is a first entry. It is what is left when all is visited.
    unsafe { store_local(&mut stack, 0, Child::EMPTY.0) };
    let mut depth = 1u32;
    let mut child = Child(params.root);
    while child != Child::EMPTY {
        // Lanes with a leaf wait for the others to visit a second node, so that more of them test together: on CUDA, where an H100 is
        // 6 % faster so than by a leaf or a node a turn. Through Vulkan it is 10 % slower.
        let mut visits = 0;
        while visits < VISITS {
            if !child.is_leaf() {
                // SAFETY: the caller's promise for each child's index and for the levels.
                child = unsafe { visit(scene, &slopes, hit.distance, child, &mut stack, &mut depth) };
            }
            visits += 1;
        }
        if child.is_leaf() && child != Child::EMPTY {
            let primitive = child.index();
            // SAFETY: the caller's promise.
            let t = unsafe { distance::<FEATURES>(params, scene, ray, &shear, primitive) };
            depth -= 1;
            // SAFETY: `depth` entries were stored.
            child = Child(unsafe { load_local(&stack, depth) });
            if is_closer(t, primitive, hit.distance, hit.primitive) {
                hit = Hit { distance: t, primitive };
                if reach.any && primitive != reach.target {
                    child = Child::EMPTY;
                }
            }
        }
    }
    hit
}

/// One entry more than levels: the lowest is [`Child::EMPTY`].
type Stack = MaybeUninit<[u32; STACK_SIZE + 1]>;

/// What comes after an inner node: its nearer child that the ray enters, or the top of the stack.
///
/// # Safety
///
/// `child` is an inner node of the scene, and the stack has `depth` entries, one at least, and room for one more.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn visit(
    scene: Scene,
    slopes: &Slopes,
    limit: f32,
    child: Child,
    stack: &mut Stack,
    depth: &mut u32,
) -> Child {
    // SAFETY: the caller's promise.
    let node = unsafe { load(scene.nodes, child.index()) };
    let Entries { first, second, t_first, t_second } = enter(slopes, &node, limit);
    if first {
        if second {
            let second_is_near = t_second < t_first;
            // SAFETY: the caller's promise.
            unsafe { store_local(stack, *depth, if second_is_near { node.first } else { node.second }) };
            *depth += 1;
            Child(if second_is_near { node.second } else { node.first })
        } else {
            Child(node.first)
        }
    } else if second {
        Child(node.second)
    } else {
        *depth -= 1;
        // SAFETY: the caller's promise.
        Child(unsafe { load_local(stack, *depth) })
    }
}
