//! Records of the binary BVH, and a ray's query and hit, which all traversals share.
//!
//! The host builds and validates the tree; [`crate::traversal`] reads it.

pub use crate::ray::NO_INSTANCE;
use crate::sphere::MISS;
use bytemuck::{Pod, Zeroable};
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
use glam::Vec3;
use glam::Vec4;

/// Entries of the traversal stack. A ray pushes at most one child a level, so a tree with at most
/// this many levels of inner nodes cannot overflow it; the host rejects a deeper one.
pub const STACK_SIZE: usize = 64;

/// Primitive of [`Hit`] if nothing is hit.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// Reference to a child: the index of an inner node, or, with the top bit set, a leaf: a primitive,
/// or an instance, whose number follows those of the primitives.
///
/// A leaf has one primitive: testing a sphere costs about as much as testing its box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(pub u32);

impl Child {
    /// Root of an empty scene, and tile entry where camera rays meet nothing.
    pub const EMPTY: Self = Self(u32::MAX);
    /// Entry of a traversal's stack: the ray has left its instance.
    pub const LEAVE: Self = Self(u32::MAX - 1);
    const LEAF: u32 = 0x8000_0000;
    /// Mask of the index in a reference.
    const INDEX_MASK: u32 = 0x7fff_ffff;
    /// Maximum count of primitives and instances together, and of nodes.
    pub const MAX_INDEX: u32 = Self::INDEX_MASK - 1;

    /// Creates a leaf with `primitive`.
    pub const fn leaf(primitive: u32) -> Self {
        Self(primitive | Self::LEAF)
    }

    /// Creates a reference to an inner node.
    pub const fn inner(node: u32) -> Self {
        Self(node)
    }

    /// Returns whether this is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Returns the index of the node or the number of the primitive.
    #[inline(always)]
    pub const fn index(self) -> u32 {
        self.0 & Self::INDEX_MASK
    }
}

/// Inner node: both children with their boxes, so that one visit decides about two subtrees (Aila
/// and Laine, "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009). 64 bytes, 4 rows;
/// a row is an axis, so that a CPU tests both boxes at once.
///
/// A box is its centre and half its extent: sums and products find where a ray enters and leaves
/// it. Corners would need a minimum and a maximum for each axis, which GPUs compute at half the
/// rate.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Along x: centre of the first child's box, centre of the second's, half extent of the
    /// first's, half extent of the second's.
    pub x: Vec4,
    /// Centres and half extents along y, in the order of `x`.
    pub y: Vec4,
    /// Centres and half extents along z, in the order of `x`.
    pub z: Vec4,
    /// First child, as a [`Child`].
    pub first: u32,
    /// Second child, as a [`Child`].
    pub second: u32,
    /// Root for the camera rays of a tile, as a [`Child`]: see [`crate::tile_entry`].
    pub tile_entry: u32,
    /// Unused.
    pub pad: u32,
}

const _: () = assert!(size_of::<BvhNode>() == 64 && align_of::<BvhNode>() == 16);

/// Lower and upper corner of a box.
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
pub type Corners = (Vec3, Vec3);

#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
impl BvhNode {
    /// Creates a node of two children; its boxes contain the given ones, enlarged by rounding.
    pub fn new(first: Child, first_box: Corners, second: Child, second_box: Corners) -> Self {
        let row = |axis: usize| {
            let (c, h) = center_and_half_extent(first_box.0[axis], first_box.1[axis]);
            let (c2, h2) = center_and_half_extent(second_box.0[axis], second_box.1[axis]);
            Vec4::new(c, c2, h, h2)
        };
        Self { x: row(0), y: row(1), z: row(2), first: first.0, second: second.0, tile_entry: 0, pad: 0 }
    }

    /// Returns boxes that contain those of the first and the second child, enlarged by rounding.
    pub fn boxes(&self) -> [Corners; 2] {
        let corners = |center: Vec3, half: Vec3| {
            let (low, high) = (center - half, center + half);
            (Vec3::from(low.to_array().map(f32::next_down)), Vec3::from(high.to_array().map(f32::next_up)))
        };
        let Self { x, y, z, .. } = self;
        [
            corners(Vec3::new(x.x, y.x, z.x), Vec3::new(x.z, y.z, z.z)),
            corners(Vec3::new(x.y, y.y, z.y), Vec3::new(x.w, y.w, z.w)),
        ]
    }
}

/// Returns the centre of an interval and half its length, enlarged by 4 ULP for those roundings of
/// a traversal that grow with the box.
#[cfg(not(any(target_arch = "nvptx64", target_arch = "spirv")))]
fn center_and_half_extent(low: f32, high: f32) -> (f32, f32) {
    let center = 0.5 * low + 0.5 * high;
    let half = (high - center).max(center - low);
    (center, if half > 0.0 { (half * (1.0 + 4.0 * f32::EPSILON)).next_up() } else { half })
}

/// Result of a traversal: the closest hit or, with [`RayQuery::any_hit`], the one that ended it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray; the query's `t_max` if nothing is hit.
    pub distance: f32,
    /// Number of the primitive, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// Instance that the primitive is part of, or [`NO_INSTANCE`].
    pub instance: u32,
}

impl Hit {
    /// Creates a hit in the world.
    #[inline(always)]
    pub const fn in_world(distance: f32, primitive: u32) -> Self {
        Self { distance, primitive, instance: NO_INSTANCE }
    }
}

/// Cost of a traversal, counted in kernels with [`COUNTED`](crate::features::COUNTED); else zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Inner nodes visited. A visit tests the boxes of all children: two in the binary BVH, eight
    /// in the wide one.
    pub nodes: u32,
    /// Leaves visited. A visit tests one primitive in the binary BVH, up to eight in the wide one.
    pub leaves: u32,
}

impl Visits {
    /// Counts of no visits.
    pub const NONE: Self = Self { nodes: 0, leaves: 0 };
}

/// Query of a ray: the closest hit or any hit, within a distance.
#[derive(Clone, Copy, Debug)]
pub struct RayQuery {
    /// Maximum distance: only nearer hits count.
    pub t_max: f32,
    /// Primitive of the light that a shadow ray is sent to, or [`NO_PRIMITIVE`]: a hit of any other
    /// ends the search. Meaningless unless `any_hit`.
    pub light_primitive: u32,
    /// True if any hit but that of `light_primitive` ends the search.
    pub any_hit: bool,
}

impl RayQuery {
    /// Query for the closest hit at any distance.
    pub const CLOSEST: Self = Self { t_max: MISS, light_primitive: NO_PRIMITIVE, any_hit: false };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::OriginPrimitive;

    #[test]
    fn child_encoding() {
        assert!(Child::leaf(5).is_leaf() && Child::leaf(5).index() == 5);
        assert!(!Child::inner(5).is_leaf() && Child::inner(5).index() == 5);
        assert!(!OriginPrimitive::NONE.is_on(0) && !OriginPrimitive::NONE.is_on(Child::MAX_INDEX - 1));
    }

    /// Centre and half extent contain the box from which they were made, and not much more.
    #[test]
    fn nodes_hold_their_boxes() {
        for i in 0..100_000u32 {
            let w = crate::rng::PathKey { seed: 9, pixel: i, sample: 0 }.words(0);
            let number = |bits: u32| {
                let size = libm::ldexpf(1.0 + crate::math::unit_f32(bits), (bits & 63) as i32 - 32);
                if bits & 64 == 0 { size } else { -size }
            };
            let (low, high) = (number(w.x).min(number(w.y)), number(w.x).max(number(w.y)));
            let (center, half) = center_and_half_extent(low, high);
            let (center, half) = (f64::from(center), f64::from(half));
            assert!(center - half <= f64::from(low) && center + half >= f64::from(high), "{low} {high}");
            let more = 2.0 * half - (f64::from(high) - f64::from(low));
            assert!(
                more <= 16.0 * f64::from(f32::EPSILON) * f64::from(low.abs().max(high.abs())),
                "{low} {high}"
            );
        }
    }
}
