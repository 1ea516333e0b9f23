//! Wide BVH and its traversal, for CPUs with SIMD: a ray is tested against eight boxes at once, and
//! against up to eight primitives of a leaf.
//!
//! A primitive's test is [`Triangle::hit`](crate::triangle::Triangle::hit) or
//! [`Sphere::distance`](crate::sphere::Sphere::distance), operation by operation, so it gives the
//! same bits. The host makes the wide BVH from the binary one; [`crate::traversal`] calls
//! [`dispatch`].

mod packet;

use crate::buffer::{borrow, eight_local, load_local};
use crate::bvh::{Hit, NO_PRIMITIVE, RayQuery, STACK_SIZE, Visits};
use crate::features::{AVX2, AVX512, COUNTED, Features, PLANAR, TRIANGLES, has};
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::simd::{LANES, Portable, Simd, SimdRow, StackTop};
use crate::slabs::{EXIT_SCALE, finite_reciprocal};
use crate::traversal::{distance, is_closer};
use crate::triangle::Shear;
use bytemuck::{Pod, Zeroable};
use core::hint::black_box;
use core::mem::MaybeUninit;
use packet::{PreparedRay, intersect_spheres, intersect_triangles};

/// Content of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafKind {
    /// Spheres, in a [`SpherePacket`].
    Spheres = 0,
    /// One planar shape, by the number of its primitive.
    Planar = 1,
    /// Triangles, in a [`TrianglePacket`].
    Triangles = 2,
}

/// Reference to a child of a wide node: the index of a node, or, with the top bit set, a leaf. A
/// leaf has two bits of [`LeafKind`], three bits for its number of primitives minus one, and 26
/// bits of index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WideChild(pub u32);

impl WideChild {
    /// Root of an empty scene, and placeholder for a missing child of a node.
    pub const EMPTY: Self = Self(u32::MAX);
    const LEAF: u32 = 0x8000_0000;
    /// Largest index of a packet or primitive.
    pub const MAX_INDEX: u32 = 0x03ff_ffff;

    /// Creates a reference to an inner node.
    pub const fn inner(node: u32) -> Self {
        Self(node)
    }

    /// Creates a reference to a leaf of 1 to 8 primitives.
    pub const fn leaf(kind: LeafKind, count: u32, index: u32) -> Self {
        Self(Self::LEAF | (kind as u32) << 29 | (count - 1) << 26 | index)
    }

    /// Returns whether this is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Returns whether this leaf is of `kind`. Only for leaves.
    #[inline(always)]
    pub const fn holds(self, kind: LeafKind) -> bool {
        self.0 >> 29 & 3 == kind as u32
    }

    /// Returns the number of primitives of this leaf. Only for leaves.
    #[inline(always)]
    pub const fn count(self) -> u32 {
        (self.0 >> 26 & 7) + 1
    }

    /// Returns the index of the packet or, in a planar leaf, of the primitive. Only for leaves.
    #[inline(always)]
    pub const fn index(self) -> u32 {
        self.0 & Self::MAX_INDEX
    }
}

/// Eight children and their boxes. 256 bytes, 8 rows of 32.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct WideNode {
    /// Lower bounds along x, y and z, then upper bounds. A missing child has ∞ and -∞, which no ray
    /// meets.
    pub planes: [SimdRow<f32>; 6],
    /// Children as [`WideChild`] words.
    pub children: SimdRow<u32>,
    /// Order of the eight lanes, farthest child first, three bits each; one word for each octant of
    /// a ray's direction (bit 0: x is below zero, and so on).
    pub order: SimdRow<u32>,
}

const _: () = assert!(size_of::<WideNode>() == 256 && align_of::<WideNode>() == 64);

/// Up to eight triangles; the first ones count. 320 bytes, 10 rows of 32.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TrianglePacket {
    /// Vertex `a` along x, y and z, then `b`, then `c`.
    pub vertices: [SimdRow<f32>; 9],
    /// Primitive numbers, ascending.
    pub primitives: SimdRow<u32>,
}

const _: () = assert!(size_of::<TrianglePacket>() == 320 && align_of::<TrianglePacket>() == 64);

/// Up to eight spheres; the first ones count. 160 bytes, 5 rows of 32.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SpherePacket {
    /// Centre along x, y and z, then radius.
    pub shape: [SimdRow<f32>; 4],
    /// Primitive numbers, ascending.
    pub primitives: SimdRow<u32>,
}

const _: () = assert!(size_of::<SpherePacket>() == 160 && align_of::<SpherePacket>() == 32);

/// Arrays of a wide BVH.
#[derive(Clone, Copy, Debug)]
pub struct WideTree<'a> {
    /// Root, or [`WideChild::EMPTY`] if there are no primitives.
    pub root: WideChild,
    /// Inner nodes, parents before children.
    pub nodes: &'a [WideNode],
    /// Leaves of spheres.
    pub spheres: &'a [SpherePacket],
    /// Leaves of triangles.
    pub triangles: &'a [TrianglePacket],
}

impl WideTree<'_> {
    /// Wide BVH of a scene that is traced without one.
    pub const NONE: Self = Self { root: WideChild::EMPTY, nodes: &[], spheres: &[], triangles: &[] };
}

/// Capacity of the traversal's stack. A visit replaces a child by at most eight, of which one is
/// visited next; eight entries are written, however many count.
const STACK_CAPACITY: usize = STACK_SIZE * (LANES - 1) + LANES;

/// Returns the closest hit by the instruction set that `FEATURES` names; see [`closest_hit`].
///
/// # Safety
///
/// As [`closest_hit`], and the CPU has the instruction set.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer and simd")]
pub unsafe fn dispatch<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> (Hit, Visits) {
    #[cfg(target_arch = "x86_64")]
    if const { has(FEATURES, AVX512) } {
        // SAFETY: the caller's promise.
        return unsafe {
            closest_hit::<FEATURES, _>(crate::simd::Avx512::assume(), params, scene, ray, query)
        };
    } else if const { has(FEATURES, AVX2) } {
        // SAFETY: the caller's promise.
        return unsafe { closest_hit::<FEATURES, _>(crate::simd::Avx2::assume(), params, scene, ray, query) };
    }
    // SAFETY: the caller's promise.
    unsafe { closest_hit::<FEATURES, _>(Portable, params, scene, ray, query) }
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
pub unsafe fn closest_hit<const FEATURES: Features, L: Simd>(
    l: L,
    params: &RenderParams,
    scene: Scene,
    ray: Ray,
    query: RayQuery,
) -> (Hit, Visits) {
    let tree = scene.wide;
    let mut best = query.t_max;
    let mut closest = NO_PRIMITIVE;
    if tree.root == WideChild::EMPTY {
        return (Hit { distance: best, primitive: closest }, Visits::NONE);
    }
    let Ray { direction, origin_primitive, .. } = ray;
    if query.any_hit && query.light_primitive != NO_PRIMITIVE {
        // A primitive behind the light must not count, whichever of the two is tested first.
        // SAFETY: the caller's promise for the light's primitive.
        let t = unsafe {
            distance::<FEATURES>(params, scene, ray, &Shear::new(direction), query.light_primitive)
        };
        if is_closer(t, query.light_primitive, best, closest) {
            (best, closest) = (t, query.light_primitive);
        }
    }
    // Leaves read it from memory; nodes need the registers.
    let prepared = &black_box(PreparedRay::new(ray));
    let inverse =
        [finite_reciprocal(direction.x), finite_reciprocal(direction.y), finite_reciprocal(direction.z)];
    let negative = inverse.map(|x| x.to_bits() >> 31);
    let octant = negative[0] | negative[1] << 1 | negative[2] << 2;
    // Rows of the planes where the ray enters and where it leaves.
    let near = [3 * negative[0], 1 + 3 * negative[1], 2 + 3 * negative[2]];
    let far = [3 - near[0], 5 - near[1], 7 - near[2]];
    let [ox, oy, oz] = ray.origin.to_array().map(|x| l.splat(x));
    let [in_x, in_y, in_z] = inverse.map(|x| l.splat(x));
    let [out_x, out_y, out_z] = inverse.map(|x| l.splat(x * EXIT_SCALE));
    let mut best_exit = best * EXIT_SCALE;
    // Not cleared, as the binary traversal's stack.
    let mut entries = MaybeUninit::<[f32; STACK_CAPACITY]>::uninit();
    let mut children = MaybeUninit::<[u32; STACK_CAPACITY]>::uninit();
    let mut depth = 0u32;
    let mut child = tree.root;
    let mut visits = Visits::NONE;
    'search: loop {
        if const { has(FEATURES, COUNTED) } {
            visits.nodes += u32::from(!child.is_leaf());
            visits.leaves += u32::from(child.is_leaf());
        }
        if !child.is_leaf() {
            // SAFETY: the caller's promise for each child's index; six planes; eight octants;
            // `STACK_CAPACITY`.
            unsafe {
                let node = borrow(tree.nodes, child.0);
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
        } else if const { has(FEATURES, PLANAR) } && child.holds(LeafKind::Planar) {
            let primitive = child.index();
            // SAFETY: the caller's promise.
            let t = unsafe { distance::<FEATURES>(params, scene, ray, &Shear::new(direction), primitive) };
            if is_closer(t, primitive, best, closest) {
                (best, best_exit, closest) = (t, t * EXIT_SCALE, primitive);
                if query.any_hit && primitive != query.light_primitive {
                    break 'search;
                }
            }
        } else {
            let count = child.count();
            // SAFETY: the caller's promise for each child's index.
            let (mut hits, t, primitives) = unsafe {
                if const { has(FEATURES, TRIANGLES) } && child.holds(LeafKind::Triangles) {
                    let packet = borrow(tree.triangles, child.index());
                    let (hits, t) =
                        intersect_triangles(l, packet, count, prepared, origin_primitive.primitive(), best);
                    (hits, t, &packet.primitives)
                } else {
                    let packet = borrow(tree.spheres, child.index());
                    let origin_primitive = (origin_primitive.primitive(), origin_primitive.goes_inside());
                    let (hits, t) = intersect_spheres(l, packet, count, prepared, origin_primitive, best);
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
                    if is_closer(t, primitive, best, closest) {
                        (best, best_exit, closest) = (t, t * EXIT_SCALE, primitive);
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
    (Hit { distance: best, primitive: closest }, visits)
}
