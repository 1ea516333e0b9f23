//! Wide BVH and its traversal, for CPUs with SIMD: a ray is tested against eight boxes at once, and
//! against up to eight primitives of a leaf.
//!
//! A primitive's test is [`Triangle::hit`](crate::triangle::Triangle::hit) or
//! [`Sphere::distance`](crate::sphere::Sphere::distance), operation by operation, so it gives the
//! same bits. The host makes the wide BVH from the binary one; [`crate::traversal`] calls
//! [`dispatch`].

mod packet;

use crate::buffer::{borrow, eight_local, load_local, store_local};
use crate::bvh::{Hit, NO_INSTANCE, NO_PRIMITIVE, RayQuery, STACK_SIZE, Visits};
#[cfg(target_arch = "x86_64")]
use crate::features::{AVX2, AVX512};
use crate::features::{COUNTED, FeatureSet, Features, INSTANCES, PLANAR, TRIANGLES};
use crate::params::RenderParams;
use crate::primitive::{distance, is_closer};
use crate::ray::Ray;
pub use crate::records::wide::{LeafKind, SpherePacket, TrianglePacket, WideChild, WideNode, WideTree};
use crate::scene::Scene;
use crate::simd::{LANES, Portable, Simd, StackTop};
use crate::slabs::{EXIT_SCALE, finite_reciprocal};
use crate::triangle::Shear;
use core::hint::black_box;
use core::mem::MaybeUninit;
use packet::{PreparedRay, intersect_spheres, intersect_triangles};

/// Capacity of the traversal's stack. A visit replaces a child by at most eight, of which one is
/// visited next; eight entries are written, however many count.
const STACK_CAPACITY: usize = STACK_SIZE * (LANES - 1) + LANES;

/// Returns the closest hit by the instruction set that the features name; see [`closest_hit`].
///
/// # Safety
///
/// As [`closest_hit`], and the CPU has the instruction set.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer and simd")]
pub unsafe fn dispatch<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> (Hit, Visits) {
    #[cfg(target_arch = "x86_64")]
    if features.has::<AVX512>() {
        // SAFETY: the caller's promise.
        return unsafe { closest_hit(features, crate::simd::Avx512::assume(), params, scene, ray, query) };
    } else if features.has::<AVX2>() {
        // SAFETY: the caller's promise.
        return unsafe { closest_hit(features, crate::simd::Avx2::assume(), params, scene, ray, query) };
    }
    // SAFETY: the caller's promise.
    unsafe { closest_hit(features, Portable, params, scene, ray, query) }
}

/// Returns the closest primitive in front of `ray`, as `query` limits it, and the visits of the
/// search. Traversal of the binary BVH returns the same closest hit.
///
/// Children are visited in the order of their centres along the ray's octant. That takes no more
/// visits than the order of their distances (docs/notebook/triangles-and-trees.md), and one
/// permutation.
///
/// # Safety
///
/// `scene.wide` and the scene's indices were proven as [`crate::buffer`] says; the light's
/// primitive is a primitive of the scene, or [`NO_PRIMITIVE`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn closest_hit<const POSSIBLE: Features, L: Simd>(
    features: FeatureSet<POSSIBLE>,
    l: L,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> (Hit, Visits) {
    let tree = scene.wide;
    let mut best = query.t_max;
    let (mut closest, mut reached) = (NO_PRIMITIVE, NO_INSTANCE);
    if tree.root == WideChild::EMPTY {
        return (Hit::in_world(best, closest), Visits::NONE);
    }
    let direction = ray.direction;
    if query.any_hit && query.light_primitive != NO_PRIMITIVE {
        // A primitive behind the light must not count, whichever of the two is tested first.
        // SAFETY: the caller's promise for the light's primitive.
        let t =
            unsafe { distance(features, params, scene, ray, &Shear::new(direction), query.light_primitive) };
        if is_closer(t, query.light_primitive, best, closest) {
            (best, closest) = (t, query.light_primitive);
        }
    }
    // The ray in the coordinates of the instance that it is in.
    let (mut local, mut instance) = (ray, NO_INSTANCE);
    // Leaves read it from memory; nodes need the registers.
    let mut prepared = black_box(PreparedRay::new(ray));
    let mut slabs = SlabRay::new(l, ray);
    let mut best_exit = best * EXIT_SCALE;
    // Not cleared, as the binary traversal's stack.
    let mut entries = MaybeUninit::<[f32; STACK_CAPACITY]>::uninit();
    let mut children = MaybeUninit::<[u32; STACK_CAPACITY]>::uninit();
    let mut depth = 0u32;
    let mut child = tree.root;
    let mut visits = Visits::NONE;
    'search: loop {
        if features.has::<COUNTED>() {
            visits.nodes += u32::from(!child.is_leaf());
            visits.leaves += u32::from(child.is_leaf());
        }
        if !child.is_leaf() {
            // SAFETY: the caller's promise for each child's index; six planes; eight octants;
            // `STACK_CAPACITY`.
            unsafe {
                let node = borrow(tree.nodes, child.0);
                let SlabRay { octant, near, far, .. } = slabs;
                let [ox, oy, oz] = slabs.origin;
                let ([in_x, in_y, in_z], [out_x, out_y, out_z]) = (slabs.entry, slabs.exit);
                let entry_x = l.mul(l.sub(l.load(borrow(&node.planes, near[0])), ox), in_x);
                let entry_y = l.mul(l.sub(l.load(borrow(&node.planes, near[1])), oy), in_y);
                let entry_z = l.mul(l.sub(l.load(borrow(&node.planes, near[2])), oz), in_z);
                let exit_x = l.mul(l.sub(l.load(borrow(&node.planes, far[0])), ox), out_x);
                let exit_y = l.mul(l.sub(l.load(borrow(&node.planes, far[1])), oy), out_y);
                let exit_z = l.mul(l.sub(l.load(borrow(&node.planes, far[2])), oz), out_z);
                let entry = l.max(l.max(entry_x, entry_y), l.max(entry_z, l.splat(0.0)));
                let exit = l.min(l.min(exit_x, exit_y), l.min(exit_z, l.splat(best_exit)));
                let top = StackTop {
                    entries: eight_local(&mut entries, depth),
                    children: eight_local(&mut children, depth),
                };
                depth += l.push_sorted(entry, exit, &node.children, *borrow(&node.order.0, octant), top);
            }
        } else if features.has::<INSTANCES>() && child.holds(LeafKind::Instance) {
            if child == WideChild::LEAVE {
                (local, instance) = (ray, NO_INSTANCE);
            } else {
                instance = child.index();
                // SAFETY: the caller's promise for each child's index; `STACK_CAPACITY`.
                unsafe {
                    let entry = crate::instance::entry(params, scene, instance);
                    local = entry.enter(ray, instance);
                    store_local(&mut entries, depth, 0.0);
                    store_local(&mut children, depth, WideChild::LEAVE.0);
                    store_local(&mut entries, depth + 1, 0.0);
                    store_local(&mut children, depth + 1, *borrow(tree.instance_roots, instance));
                }
                depth += 2;
            }
            prepared = black_box(PreparedRay::new(local));
            slabs = SlabRay::new(l, local);
        } else if features.has::<PLANAR>() && child.holds(LeafKind::Planar) {
            let primitive = child.index();
            // SAFETY: the caller's promise.
            let t = unsafe { distance(features, params, scene, ray, &Shear::new(direction), primitive) };
            if is_closer(t, primitive, best, closest) {
                (best, best_exit, closest) = (t, t * EXIT_SCALE, primitive);
                reached = NO_INSTANCE;
                if query.any_hit && primitive != query.light_primitive {
                    break 'search;
                }
            }
        } else {
            let (count, origin_primitive) = (child.count(), local.origin_primitive);
            // SAFETY: the caller's promise for each child's index.
            let (mut hits, t, primitives) = unsafe {
                if features.has::<TRIANGLES>() && child.holds(LeafKind::Triangles) {
                    let packet = borrow(tree.triangles, child.packet());
                    let (lanes, departure) = (child.lanes(), origin_primitive.primitive());
                    let (hits, t) = intersect_triangles(l, packet, lanes, &prepared, departure, best);
                    (hits, t, &packet.primitives)
                } else {
                    let packet = borrow(tree.spheres, child.index());
                    let origin_primitive = (origin_primitive.primitive(), origin_primitive.goes_inside());
                    let (hits, t) = intersect_spheres(l, packet, count, &prepared, origin_primitive, best);
                    (hits, t, &packet.primitives)
                }
            };
            if hits != 0 {
                let t = l.store(t);
                while hits != 0 {
                    let lane = hits.trailing_zeros();
                    hits &= hits - 1;
                    // SAFETY: the number of one of eight lanes.
                    let (t, primitive) = unsafe { (*borrow(&t.0, lane), *borrow(&primitives.0, lane)) };
                    let hit = Hit { distance: best, primitive: closest, instance: reached };
                    if is_closer(t, primitive, best, closest)
                        || hit.is_after(features, t, primitive, instance)
                    {
                        (best, best_exit, closest) = (t, t * EXIT_SCALE, primitive);
                        reached = instance;
                        if query.any_hit && primitive != query.light_primitive {
                            break 'search;
                        }
                    }
                }
            }
        }
        loop {
            if depth == 0 {
                break 'search;
            }
            depth -= 1;
            // SAFETY: `depth` entries were stored.
            let (entry, top) = unsafe { (load_local(&entries, depth), load_local(&children, depth)) };
            if entry <= best_exit {
                child = WideChild(top);
                break;
            }
        }
    }
    (Hit { distance: best, primitive: closest, instance: reached }, visits)
}

/// Ray as the test of a node's boxes needs it.
#[derive(Clone, Copy)]
struct SlabRay<L: Simd> {
    /// Octant of the direction; a bit for each axis, set below zero.
    octant: u32,
    /// Rows of the planes where the ray enters.
    near: [u32; 3],
    /// Rows of the planes where the ray leaves.
    far: [u32; 3],
    origin: [L::F; 3],
    /// Reciprocals of the direction, to enter.
    entry: [L::F; 3],
    /// Reciprocals of the direction, to leave.
    exit: [L::F; 3],
}

impl<L: Simd> SlabRay<L> {
    #[inline(always)]
    fn new(l: L, ray: Ray) -> Self {
        let inverse = ray.direction.to_array().map(finite_reciprocal);
        let negative = inverse.map(|x| x.to_bits() >> 31);
        let near = [3 * negative[0], 1 + 3 * negative[1], 2 + 3 * negative[2]];
        Self {
            octant: negative[0] | negative[1] << 1 | negative[2] << 2,
            near,
            far: [3 - near[0], 5 - near[1], 7 - near[2]],
            origin: ray.origin.to_array().map(|x| l.splat(x)),
            entry: inverse.map(|x| l.splat(x)),
            exit: inverse.map(|x| l.splat(x * EXIT_SCALE)),
        }
    }
}
