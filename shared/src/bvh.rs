//! The binary BVH and its traversal, per ray with a stack, near child first; and the search without a tree.

use crate::buffer::{load, load_local, store_local};
use crate::features::{FLATS, Features, LINEAR, TRIANGLES, has};
#[cfg(any(target_arch = "nvptx64", target_arch = "spirv"))]
use crate::math::{max, min};
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::sphere::MISS;
use crate::triangle::Shear;
use bytemuck::{Pod, Zeroable};
use core::mem::MaybeUninit;
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use glam::Vec4Swizzles;
use glam::{Vec3, Vec4};

/// Entries of the traversal stack. A ray pushes at most one child per level, so a tree with at most this many levels of inner
/// nodes cannot overflow it; the host rejects a deeper one.
pub const STACK_SIZE: usize = 64;

/// What [`closest_hit`] names when nothing is hit.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// A reference to a child: an inner node's index, or, with the top bit set, a leaf's one primitive.
///
/// One primitive a leaf: testing a sphere costs about as much as testing its box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(pub u32);

impl Child {
    /// The root of an empty scene.
    pub const EMPTY: Self = Self(u32::MAX);
    const LEAF: u32 = 0x8000_0000;
    /// Primitives and nodes that can be referred to.
    pub const LIMIT: u32 = 0x7fff_ffff;

    /// A leaf with this primitive.
    pub const fn leaf(primitive: u32) -> Self {
        Self(primitive | Self::LEAF)
    }

    /// An inner node.
    pub const fn inner(node: u32) -> Self {
        Self(node)
    }

    /// Whether this is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The index of the node or the primitive.
    #[inline(always)]
    pub const fn index(self) -> u32 {
        self.0 & Self::LIMIT
    }
}

/// An inner node: both children with their boxes, so that one visit decides about two subtrees (Aila and Laine,
/// "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009). 64 bytes, four rows; a row is an axis, so that a CPU tests
/// both boxes at once.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Along x: lower bound of the first child's box, of the second's, upper bound of the first's, of the second's.
    pub x: Vec4,
    /// Along y.
    pub y: Vec4,
    /// Along z.
    pub z: Vec4,
    /// The first [`Child`].
    pub first: u32,
    /// The second [`Child`].
    pub second: u32,
    /// Unused.
    pub pad: [u32; 2],
}

const _: () = assert!(size_of::<BvhNode>() == 64 && align_of::<BvhNode>() == 16);

impl BvhNode {
    /// A node of two children and their boxes, lower and upper corner.
    pub fn new(first: Child, first_box: (Vec3, Vec3), second: Child, second_box: (Vec3, Vec3)) -> Self {
        let ((low, high), (low2, high2)) = (first_box, second_box);
        Self {
            x: Vec4::new(low.x, low2.x, high.x, high2.x),
            y: Vec4::new(low.y, low2.y, high.y, high2.y),
            z: Vec4::new(low.z, low2.z, high.z, high2.z),
            first: first.0,
            second: second.0,
            pad: [0; 2],
        }
    }
}

/// Distance and index of the primitive that a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Along the ray; the reach's limit if nothing is hit.
    pub distance: f32,
    /// Or [`NO_PRIMITIVE`].
    pub primitive: u32,
}

/// 1 / `x`, large and finite for a component of zero.
///
/// A finite reciprocal keeps 0 · ∞ = NaN out of the slab test whatever a backend's minimum does with NaN. 1e37 is large
/// enough that a ray parallel to a slab as thin as 1e-20 leaves it only beyond 1e17 units (torture test 24).
/// Its sign does not matter: the slab test sorts the two planes.
#[inline(always)]
fn reciprocal(x: f32) -> f32 {
    if x.abs() > 1e-37 { 1.0 / x } else { 1e37 }
}

/// Which boxes of a node a ray enters before a limit, and where.
struct Entries {
    first: bool,
    second: bool,
    t_first: f32,
    t_second: f32,
}

/// By how much the exit from a box is moved out, so that rounding never loses a hit (Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013):
/// 2 ULP where division is correctly rounded. Vulkan's reciprocal may be off by 2.5 ULP, of entry and exit each, which takes 7; a ray
/// at the border of a box a thousand times its size away would else miss one time in sixteen.
const EXIT: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Slabs, of both boxes. A ray that runs inside the plane of a face may miss the box: the host pads each primitive's box.
#[cfg(any(target_arch = "nvptx64", target_arch = "spirv"))]
#[inline(always)]
fn enter(origin: Vec3, inverse: Vec3, node: &BvhNode, limit: f32) -> Entries {
    let (x0, x1) = ((node.x.x - origin.x) * inverse.x, (node.x.z - origin.x) * inverse.x);
    let (y0, y1) = ((node.y.x - origin.y) * inverse.y, (node.y.z - origin.y) * inverse.y);
    let (z0, z1) = ((node.z.x - origin.z) * inverse.z, (node.z.z - origin.z) * inverse.z);
    let t_first = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), 0.0));
    let exit = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), limit));
    let first = t_first <= exit * EXIT;
    let (x0, x1) = ((node.x.y - origin.x) * inverse.x, (node.x.w - origin.x) * inverse.x);
    let (y0, y1) = ((node.y.y - origin.y) * inverse.y, (node.y.w - origin.y) * inverse.y);
    let (z0, z1) = ((node.z.y - origin.z) * inverse.z, (node.z.w - origin.z) * inverse.z);
    let t_second = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), 0.0));
    let exit = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), limit));
    Entries { first, second: t_second <= exit * EXIT, t_first, t_second }
}

/// The same operations four at a time: the same bits, in a third of the instructions.
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
#[inline(always)]
fn enter(origin: Vec3, inverse: Vec3, node: &BvhNode, limit: f32) -> Entries {
    let x = (node.x - Vec4::splat(origin.x)) * Vec4::splat(inverse.x);
    let y = (node.y - Vec4::splat(origin.y)) * Vec4::splat(inverse.y);
    let z = (node.z - Vec4::splat(origin.z)) * Vec4::splat(inverse.z);
    let (x1, y1, z1) = (x.zwxy(), y.zwxy(), z.zwxy());
    let entry = x.min(x1).max(y.min(y1)).max(z.min(z1).max(Vec4::ZERO));
    let exit = x.max(x1).min(y.max(y1)).min(z.max(z1).min(Vec4::splat(limit))) * EXIT;
    Entries { first: entry.x <= exit.x, second: entry.y <= exit.y, t_first: entry.x, t_second: entry.y }
}

/// How far a ray looks, and for what.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// Only hits nearer than this count.
    pub limit: f32,
    /// A hit of any other primitive than this ends the search: what a shadow ray wants to know. Meaningless unless `any`.
    pub target: u32,
    /// Whether to end the search so.
    pub any: bool,
}

impl Reach {
    /// The closest hit, however far.
    pub const CLOSEST: Self = Self { limit: MISS, target: NO_PRIMITIVE, any: false };
}

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
fn is_closer(t: f32, primitive: u32, best: f32, closest: u32) -> bool {
    (t < best) | ((t == best) & ((primitive as i32) < closest as i32))
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
/// `params.root`, `params.primitives` and the scene's indices were proven as [`crate::buffer`] says.
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
    let nodes = scene.nodes;
    let root = Child(params.root);
    let Ray { origin, direction, .. } = ray;
    let mut best = reach.limit;
    let mut closest = NO_PRIMITIVE;
    if root == Child::EMPTY {
        return Hit { distance: best, primitive: closest };
    }
    let shear = Shear::new(direction); // without triangles no one reads it
    let inverse = Vec3::new(reciprocal(direction.x), reciprocal(direction.y), reciprocal(direction.z));
    // Not cleared: 256 bytes for each ray cost more than all the boxes that it tests. Two variables, not a record with methods:
    // LLVM clears the whole of one that holds the length too, and SPIR-V has no pointers in records to borrow the entries.
    let mut stack = MaybeUninit::<[u32; STACK_SIZE]>::uninit();
    let mut depth = 0u32;
    let mut child = root;
    // Each way out of a visit stands by itself: with one common pop an H100 is 7 % slower through Vulkan.
    loop {
        if child.is_leaf() {
            let primitive = child.index();
            // SAFETY: the caller's promise.
            let t = unsafe { distance::<FEATURES>(params, scene, ray, &shear, primitive) };
            if is_closer(t, primitive, best, closest) {
                best = t;
                closest = primitive;
                if reach.any && primitive != reach.target {
                    break;
                }
            }
            if depth == 0 {
                break;
            }
            depth -= 1;
            // SAFETY: `depth` entries were stored.
            let top = unsafe { load_local(&stack, depth) };
            child = Child(top);
        } else {
            // SAFETY: the caller's promise for each child's index.
            let node = unsafe { load(nodes, child.index()) };
            let Entries { first, second, t_first, t_second } = enter(origin, inverse, &node, best);
            if first {
                if second {
                    let second_is_near = t_second < t_first;
                    child = Child(if second_is_near { node.second } else { node.first });
                    // SAFETY: one push a level, and the caller's promise for the levels.
                    unsafe {
                        store_local(&mut stack, depth, if second_is_near { node.first } else { node.second });
                    }
                    depth += 1;
                } else {
                    child = Child(node.first);
                }
            } else if second {
                child = Child(node.second);
            } else {
                if depth == 0 {
                    break;
                }
                depth -= 1;
                // SAFETY: `depth` entries were stored.
                let top = unsafe { load_local(&stack, depth) };
                child = Child(top);
            }
        }
    }
    Hit { distance: best, primitive: closest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Departure;

    #[test]
    fn slabs_without_nan() {
        let corner = Vec3::new(1.0, 1.0, 1.0);
        let inverse = |d: Vec3| Vec3::new(reciprocal(d.x), reciprocal(d.y), reciprocal(d.z));
        // The box in question is first or second; the other is a point that no ray here meets.
        let at = |o: Vec3, d: Vec3, low: Vec3, high: Vec3| {
            let (far, leaf) = ((Vec3::splat(-9.0), Vec3::splat(-9.0)), Child::leaf(0));
            let one = enter(o, inverse(d), &BvhNode::new(leaf, (low, high), leaf, far), MISS);
            let two = enter(o, inverse(d), &BvhNode::new(leaf, far, leaf, (low, high)), MISS);
            assert_eq!((one.first, one.t_first.to_bits()), (two.second, two.t_second.to_bits()));
            assert!(!one.second && !two.first);
            (one.first, one.t_first)
        };
        let hits = |o, d| at(o, d, -corner, corner);
        assert_eq!(hits(Vec3::new(0.99, -0.99, 5.0), Vec3::NEG_Z), (true, 4.0));
        assert!(!hits(Vec3::new(1.1, 0.0, 5.0), Vec3::NEG_Z).0);
        // In the plane of a face and along an edge: 0 · 1e37 = 0, no NaN.
        assert!(!hits(Vec3::new(1.0, 0.0, 5.0), Vec3::NEG_Z).1.is_nan());
        assert!(!hits(Vec3::new(1.0, -1.0, 5.0), Vec3::NEG_Z).1.is_nan());
        // Denormal and negative zero components.
        assert!(hits(Vec3::new(0.5, 0.5, 5.0), Vec3::new(-0.0, 1e-45, -1.0)).0);
        // From inside: entry 0.
        assert_eq!(hits(Vec3::ZERO, Vec3::X), (true, 0.0));
        // Torture test 24: a slab of thickness 2e-6, a ray inside and parallel to it, the target far along.
        let thin = at(Vec3::ZERO, Vec3::Z, Vec3::new(-1e-6, -1.0, -1.0), Vec3::new(1e-6, 1.0, 100.0));
        assert_eq!(thin, (true, 0.0));
    }

    #[test]
    fn child_encoding() {
        assert!(Child::leaf(5).is_leaf() && Child::leaf(5).index() == 5);
        assert!(!Child::inner(5).is_leaf() && Child::inner(5).index() == 5);
        assert!(!Departure::NONE.is_on(0) && !Departure::NONE.is_on(Child::LIMIT - 1));
    }
}
