//! Records of the wide BVH.

use crate::simd::SimdRow;
use bytemuck::{Pod, Zeroable};

/// Content of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafKind {
    /// Spheres, in a [`SpherePacket`].
    Spheres = 0,
    /// One planar shape, by the number of its primitive.
    Planar = 1,
    /// Triangles, in a [`TrianglePacket`].
    Triangles = 2,
    /// One instance, by its number.
    Instance = 3,
}

/// Reference to a child of a wide node: the index of a node, or, with the top bit set, a leaf. A
/// leaf has two bits of [`LeafKind`], three bits for its number of primitives minus one, and 26
/// bits of index. The index of a leaf of triangles counts lanes: leaves share packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WideChild(pub u32);

impl WideChild {
    /// Root of an empty scene, and placeholder for a missing child of a node.
    pub const EMPTY: Self = Self(u32::MAX);
    /// Entry of a traversal's stack: the ray has left its instance.
    pub const LEAVE: Self = Self::leaf(LeafKind::Instance, 2, 0);
    const LEAF: u32 = 0x8000_0000;
    /// Largest index of a packet of spheres, a lane of triangles, a primitive or an instance.
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

    /// Returns the packet of a leaf of triangles.
    #[inline(always)]
    pub const fn packet(self) -> u32 {
        self.index() / 8
    }

    /// Returns the lanes of the packet that are those of a leaf of triangles, a bit for each.
    #[inline(always)]
    pub const fn lanes(self) -> u32 {
        ((2 << (self.count() - 1)) - 1) << (self.0 % 8)
    }

    /// Returns the index of the packet of spheres, of the first lane of triangles or, in a planar
    /// leaf, of the primitive. Only for leaves.
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

/// Up to eight triangles, those of one leaf or of several. 320 bytes, 10 rows of 32.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TrianglePacket {
    /// Vertex `a` along x, y and z, then `b`, then `c`.
    pub vertices: [SimdRow<f32>; 9],
    /// Primitive numbers, ascending in each leaf; `u32::MAX` in lanes that no leaf has.
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
    /// Root of the mesh of each instance, as a [`WideChild`] word.
    pub instance_roots: &'a [u32],
    /// Inner nodes, parents before children.
    pub nodes: &'a [WideNode],
    /// Leaves of spheres.
    pub spheres: &'a [SpherePacket],
    /// Leaves of triangles.
    pub triangles: &'a [TrianglePacket],
}

impl WideTree<'_> {
    /// Wide BVH of a scene that is traced without one.
    pub const NONE: Self =
        Self { root: WideChild::EMPTY, instance_roots: &[], nodes: &[], spheres: &[], triangles: &[] };
}
