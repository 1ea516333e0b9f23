//! Slab test of a ray against both boxes of a node of the binary BVH, and the padding of the boxes,
//! which the host adds.

use crate::bvh::BvhNode;
use crate::math::fused;
use glam::Vec3;
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use glam::Vec4;
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use glam::Vec4Swizzles;

/// Minimum magnitude of a direction's component in the slab test; a smaller one, and zero, counts
/// as this.
///
/// Its reciprocal is finite, which keeps 0 · ∞ and ∞ - ∞ out of the test, whatever a backend's
/// minimum does with NaN, for coordinates up to 1e20 (torture tests 24 and 25). A ray perpendicular
/// to an axis misses each slab of that axis that it is not inside, so it visits what a slightly
/// tilted ray visits. (If the test left the axis out, one axis alone would decide for a ray along
/// another, and the ray would visit the whole tree.) Inside a slab the ray stays for 1e18 times
/// half the slab's thickness.
pub const MIN_COMPONENT: f32 = 1e-18;

/// Reciprocals of a ray's direction, as the slab test needs them.
#[derive(Clone, Copy, Debug)]
pub struct RayReciprocals {
    /// 1 / direction, for components of at least [`MIN_COMPONENT`] in magnitude.
    signed: Vec3,
    /// Magnitude of `signed`.
    magnitude: Vec3,
    /// Distance along the ray to the planes through the world's origin, for padded boxes.
    scaled_origin: Vec3,
}

impl RayReciprocals {
    /// Returns the reciprocals of a ray.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let (x, y, z) =
            (signed_reciprocal(direction.x), signed_reciprocal(direction.y), signed_reciprocal(direction.z));
        let signed = Vec3::new(x.0, y.0, z.0);
        Self { signed, magnitude: Vec3::new(x.1, y.1, z.1), scaled_origin: -origin * signed }
    }
}

/// Returns the reciprocal of a direction's component, and its magnitude.
#[cfg(not(target_arch = "nvptx64"))]
#[inline(always)]
fn signed_reciprocal(x: f32) -> (f32, f32) {
    let size = crate::math::reciprocal(crate::math::max(x.abs(), MIN_COMPONENT));
    (f32::from_bits(size.to_bits() | x.to_bits() & 0x8000_0000), size)
}

/// Returns the reciprocal of a direction's component, and its magnitude.
///
/// CUDA compares the magnitudes' bits as integers, which have the same order, and inverts a signed
/// number: the fastest of six forms (docs/notebook/triangles-and-trees.md). NaN stays NaN, and hits
/// no primitive.
#[cfg(target_arch = "nvptx64")]
#[inline(always)]
fn signed_reciprocal(x: f32) -> (f32, f32) {
    let (bits, least) = (x.to_bits() & 0x7fff_ffff, MIN_COMPONENT.to_bits());
    let bounded = if bits > least { bits } else { least };
    let signed = crate::math::reciprocal(f32::from_bits(bounded | x.to_bits() & 0x8000_0000));
    (signed, signed.abs())
}

/// Factor on the exit from a box, so that rounding never loses a hit (Ize, "Robust BVH Ray
/// Traversal", JCGT 2(2), 2013).
///
/// 2 ULP suffice where division is correctly rounded. Vulkan's reciprocal may be off by 2.5 ULP,
/// for entry and exit each, which takes 7: a ray at the border of a box a thousand times its size
/// away would else miss one time in sixteen. The part of the error that grows with the box, not
/// with the distance to it, is less than the 4 ULP by which [`BvhNode::new`] enlarges a box.
pub(crate) const EXIT_SCALE: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Returns the padding of a box: how much to add to half its extent along an axis, for rays whose
/// origin lies within `origin_extent` of the world's origin along it.
///
/// A ray finds a padded box without a difference of origin and centre, and without `EXIT_SCALE`:
/// by products of each with the reciprocal, which cancel. The padding is 6 ULP of all lengths that
/// take part: 1/2 for the ray's product, 1/2 for the sum, 1/2 for the way through half the box, 2.5
/// for the reciprocal on Vulkan, and 2 so that a primitive whose distance was rounded down is not
/// behind its box.
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
pub fn box_padding(center: f32, half: f32, origin_extent: f32) -> f32 {
    6.0 * f32::EPSILON * (center.abs() + half + origin_extent)
}

/// Boxes of a node that a ray enters before a limit, and where.
#[derive(Clone, Copy, Debug)]
pub struct BoxHits {
    /// True if the ray enters the first child's box.
    pub first: bool,
    /// True if the ray enters the second child's box.
    pub second: bool,
    /// Distance along the ray to the first child's box; 0 from inside. Meaningless if it is not
    /// entered.
    pub t_first: f32,
    /// Distance along the ray to the second child's box; 0 from inside. Meaningless if it is not
    /// entered.
    pub t_second: f32,
}

/// Returns which boxes of `node` the ray enters before `limit`, and where. No result depends on its
/// rounding: it may enter a box too many, never one too few.
///
/// `padded`: the boxes have [`box_padding`] for the rounding of an origin like this one.
#[inline(always)]
#[cfg_attr(not(any(target_arch = "nvptx64", target_arch = "spirv")), allow(unused_variables))]
pub fn intersect_boxes(
    padded: bool,
    origin: Vec3,
    reciprocals: &RayReciprocals,
    node: &BvhNode,
    limit: f32,
) -> BoxHits {
    // Two separate forms: a driver that knows `padded` removes one of them, but no product with 1.
    #[cfg(any(target_arch = "nvptx64", target_arch = "spirv"))]
    return if padded {
        intersect_boxes_one_by_one::<true>(origin, reciprocals, node, limit)
    } else {
        intersect_boxes_one_by_one::<false>(origin, reciprocals, node, limit)
    };
    #[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
    return intersect_boxes_together(origin, reciprocals, node, limit);
}

/// Tests one box after the other, for devices, whose lanes are rays.
#[inline(always)]
#[cfg_attr(not(any(test, target_arch = "nvptx64", target_arch = "spirv")), allow(dead_code))]
fn intersect_boxes_one_by_one<const PADDED: bool>(
    origin: Vec3,
    reciprocals: &RayReciprocals,
    node: &BvhNode,
    limit: f32,
) -> BoxHits {
    let middle = |center: Vec3| {
        let RayReciprocals { signed, scaled_origin: start, .. } = *reciprocals;
        if PADDED {
            let along = |center: f32, slope: f32, start: f32| fused(center, slope, start);
            return Vec3::new(
                along(center.x, signed.x, start.x),
                along(center.y, signed.y, start.y),
                along(center.z, signed.z, start.z),
            );
        }
        (center - origin) * signed
    };
    let exit = if PADDED { 1.0 } else { EXIT_SCALE };
    let half = Vec3::new(node.x.z, node.y.z, node.z.z);
    let (first, t_first) =
        intersect_box(reciprocals, middle(Vec3::new(node.x.x, node.y.x, node.z.x)), half, limit, exit);
    let half = Vec3::new(node.x.w, node.y.w, node.z.w);
    let (second, t_second) =
        intersect_box(reciprocals, middle(Vec3::new(node.x.y, node.y.y, node.z.y)), half, limit, exit);
    BoxHits { first, second, t_first, t_second }
}

/// Returns whether the ray enters a box, and where. `middle` is the distance along the ray to the
/// planes through the box's centre.
///
/// Minimum and maximum are those of the bits as integers, which GPUs compute three at a time, and
/// with zero (docs/notebook/kernels-and-schedules.md). For numbers above zero they are the numbers'
/// own. Of two numbers below zero the wrong one may be chosen, but one below zero, so the box is
/// missed, as it should be.
#[inline(always)]
#[cfg_attr(not(any(test, target_arch = "nvptx64", target_arch = "spirv")), allow(dead_code))]
fn intersect_box(
    reciprocals: &RayReciprocals,
    middle: Vec3,
    half: Vec3,
    limit: f32,
    exit_scale: f32,
) -> (bool, f32) {
    let size = reciprocals.magnitude;
    let bits = |t: f32| t.to_bits() as i32;
    let near = |half: f32, size, middle| bits(fused(-half, size, middle));
    let far = |half: f32, size, middle| bits(fused(half, size, middle));
    let entry = near(half.x, size.x, middle.x).max(near(half.y, size.y, middle.y));
    let entry = entry.max(near(half.z, size.z, middle.z)).max(0);
    let exit = far(half.x, size.x, middle.x).min(far(half.y, size.y, middle.y));
    let exit = exit.min(far(half.z, size.z, middle.z)).min(bits(limit));
    let (entry, exit) = (f32::from_bits(entry as u32), f32::from_bits(exit as u32));
    (entry <= exit * exit_scale, entry)
}

/// Tests both boxes at once, for the CPU: centres in the first two lanes, half extents in the
/// others.
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
#[inline(always)]
fn intersect_boxes_together(
    origin: Vec3,
    reciprocals: &RayReciprocals,
    node: &BvhNode,
    limit: f32,
) -> BoxHits {
    let axis = |row: Vec4, origin: f32, signed: f32, size: f32| {
        // Ways to the two centres, and through half of each box.
        let ways = (row - Vec4::new(origin, origin, 0.0, 0.0)) * Vec4::new(signed, signed, size, size);
        (ways - ways.zwxy(), ways + ways.zwxy())
    };
    let RayReciprocals { signed, magnitude: size, .. } = *reciprocals;
    let (x0, x1) = axis(node.x, origin.x, signed.x, size.x);
    let (y0, y1) = axis(node.y, origin.y, signed.y, size.y);
    let (z0, z1) = axis(node.z, origin.z, signed.z, size.z);
    let entry = x0.max(y0).max(z0.max(Vec4::ZERO));
    let exit = x1.min(y1).min(z1.min(Vec4::splat(limit))) * EXIT_SCALE;
    BoxHits { first: entry.x <= exit.x, second: entry.y <= exit.y, t_first: entry.x, t_second: entry.y }
}

/// Returns 1 / `x`, large and finite for a component of zero; for the wide BVH.
///
/// A finite reciprocal keeps 0 · ∞ = NaN out of the slab test, whatever a backend's minimum does
/// with NaN. 1e37 is large enough that a ray parallel to a slab as thin as 1e-20 leaves it only
/// beyond 1e17 units (torture test 24). Its sign does not matter: the slab test sorts the two
/// planes.
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
#[inline(always)]
pub(crate) fn finite_reciprocal(x: f32) -> f32 {
    if x.abs() > 1e-37 { 1.0 / x } else { 1e37 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Child;
    use crate::sphere::MISS;

    /// Tests a box as first and as second child, in the CPU's form and in the devices'; the other
    /// child is a point that no ray here meets.
    fn at(o: Vec3, d: Vec3, low: Vec3, high: Vec3) -> (bool, f32) {
        let (far, leaf) = ((Vec3::splat(-9.0), Vec3::splat(-9.0)), Child::leaf(0));
        let reciprocals = RayReciprocals::new(o, d);
        let [one, two] =
            [BvhNode::new(leaf, (low, high), leaf, far), BvhNode::new(leaf, far, leaf, (low, high))].map(
                |node| {
                    let (a, b) = (
                        intersect_boxes_together(o, &reciprocals, &node, MISS),
                        intersect_boxes_one_by_one::<false>(o, &reciprocals, &node, MISS),
                    );
                    assert_eq!((a.first, a.second), (b.first, b.second), "{o} {d}");
                    a
                },
            );
        assert_eq!((one.first, one.t_first.to_bits()), (two.second, two.t_second.to_bits()));
        assert!(!one.second && !two.first);
        (one.first, one.t_first)
    }

    #[test]
    fn slabs_without_nan() {
        let corner = Vec3::new(1.0, 1.0, 1.0);
        let hits = |o, d| at(o, d, -corner, corner);
        let (hit, t) = hits(Vec3::new(0.99, -0.99, 5.0), Vec3::NEG_Z);
        assert!(hit && (t - 4.0).abs() < 1e-6);
        // Beside a slab that the ray is parallel to: missed, however near, along each axis.
        for axis in Vec3::AXES {
            for side in [Vec3::X, Vec3::NEG_Y, Vec3::Z].map(|side| side * (Vec3::ONE - axis)) {
                let beside = |gap: f32| hits(-5.0 * axis + side * (1.0 + gap), axis).0;
                assert!(side == Vec3::ZERO || !beside(1e-5) && beside(-1e-5), "{axis} {side}");
            }
        }
        // In the plane of a face and along an edge: no NaN.
        assert!(!hits(Vec3::new(1.0, 0.0, 5.0), Vec3::NEG_Z).1.is_nan());
        assert!(!hits(Vec3::new(1.0, -1.0, 5.0), Vec3::NEG_Z).1.is_nan());
        // Components that are denormal or negative zero.
        assert!(hits(Vec3::new(0.5, 0.5, 5.0), Vec3::new(-0.0, 1e-45, -1.0)).0);
        // From inside: entry 0.
        assert_eq!(hits(Vec3::ZERO, Vec3::X), (true, 0.0));
        // Box behind the ray.
        assert!(!hits(Vec3::new(0.0, 0.0, 5.0), Vec3::Z).0);
        // Torture test 24: a slab of thickness 2e-6, a ray inside and parallel to it, the target
        // far along.
        let thin = at(Vec3::ZERO, Vec3::Z, Vec3::new(-1e-6, -1.0, -1.0), Vec3::new(1e-6, 1.0, 100.0));
        assert_eq!(thin, (true, 0.0));
        // A huge box about a ray that is perpendicular to an axis: ∞ - ∞ would be NaN.
        assert!(at(Vec3::ZERO, Vec3::Z, Vec3::splat(-1e18), Vec3::splat(1e18)).0);
    }

    /// A ray towards a point of a box, as the host pads it, enters it: from near and from far, for
    /// small and large boxes, near the world's origin and far from it. Negative control: without
    /// padding, some are lost.
    #[test]
    fn no_box_is_lost() {
        let (mut lost_without, mut lost_without_padding) = (0, 0);
        let wider = |row: Vec4, reach: f32| {
            Vec4::new(
                row.x,
                row.y,
                row.z + box_padding(row.x, row.z, reach),
                row.w + box_padding(row.y, row.w, reach),
            )
        };
        for i in 0..200_000u32 {
            let words = |k: u32| crate::rng::PathKey { seed: k, pixel: i, sample: 0 }.words(0);
            let unit = |bits: u32| 2.0 * crate::math::unit_f32(bits) - 1.0;
            let vector = |w: crate::rng::Words| Vec3::new(unit(w.x), unit(w.y), unit(w.z));
            let size = libm::exp2f(20.0 * unit(words(0).w));
            let place = vector(words(1)) * libm::exp2f(20.0 * unit(words(1).w));
            let (a, b) = (place + vector(words(2)) * size, place + vector(words(3)) * size);
            let (low, high) = (a.min(b), a.max(b));
            let pad = (low.abs().max(high.abs()) + (high - low).max_element()) * (2.0 * f32::EPSILON);
            // A corner of the box, or a point of an edge: rounding loses these first.
            let w = words(4);
            let pick = |bit: u32, low: f32, high: f32| if w.x >> bit & 1 == 0 { low } else { high };
            let mut target =
                Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
            target[w.y as usize % 3] = low[w.y as usize % 3].midpoint(high[w.y as usize % 3]);
            let origin = vector(words(5)) * libm::exp2f(20.0 * unit(words(5).w));
            let to = target.as_dvec3() - origin.as_dvec3();
            let direction = to.normalize().as_vec3();
            // What the rounded ray meets, in double precision.
            let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
            let (t0, t1) = ((low.as_dvec3() - o) / d, (high.as_dvec3() - o) / d);
            let (entry, exit) = (t0.min(t1).max_element(), t0.max(t1).min_element());
            if !(exit > 0.0 && entry <= exit) {
                continue;
            }
            let node = BvhNode::new(Child::leaf(0), (low - pad, high + pad), Child::leaf(1), (low, high));
            let reciprocals = RayReciprocals::new(origin, direction);
            for entries in [
                intersect_boxes_together(origin, &reciprocals, &node, MISS),
                intersect_boxes_one_by_one::<false>(origin, &reciprocals, &node, MISS),
            ] {
                assert!(entries.first, "{low} {high} from {origin} along {direction}");
            }
            let widened = BvhNode {
                x: wider(node.x, origin.x.abs()),
                y: wider(node.y, origin.y.abs()),
                z: wider(node.z, origin.z.abs()),
                ..node
            };
            assert!(
                intersect_boxes_one_by_one::<true>(origin, &reciprocals, &widened, MISS).first,
                "{low} {high} {origin} {direction}"
            );
            lost_without_padding +=
                u32::from(!intersect_boxes_one_by_one::<true>(origin, &reciprocals, &node, MISS).first);
            let less = 1.0 - 12.0 * f32::EPSILON;
            let shrunk = |row: Vec4| Vec4::new(row.y, row.y, row.w * less, row.w * less);
            let bare = BvhNode { x: shrunk(node.x), y: shrunk(node.y), z: shrunk(node.z), ..node };
            lost_without +=
                u32::from(!intersect_boxes_one_by_one::<false>(origin, &reciprocals, &bare, MISS).first);
        }
        assert!(lost_without > 0 && lost_without_padding > 0, "the test does not reach what rounding loses");
    }
}
