//! Rays, and the primitive that a ray starts on; made by camera and paths, read by traversal.

use glam::Vec3;

/// Instance of a hit in the world, and of a ray that leaves a primitive there.
pub const NO_INSTANCE: u32 = u32::MAX;

/// A half-line: points `origin` + t `direction`, t > 0. Vectors begin rows of 16 bytes, as naga
/// lays out records that contain a ray.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start of the ray, in scene units.
    pub origin: Vec3,
    /// Primitive that the ray leaves.
    pub origin_primitive: OriginPrimitive,
    /// Vector along the ray: a unit vector in the world, and of the same distances in an instance.
    pub direction: Vec3,
    /// Instance that the ray leaves, or [`NO_INSTANCE`].
    pub origin_instance: u32,
}

impl Ray {
    /// Creates a ray that leaves a primitive in the world, or none.
    #[inline(always)]
    pub const fn in_world(origin: Vec3, direction: Vec3, origin_primitive: OriginPrimitive) -> Self {
        Self { origin, origin_primitive, direction, origin_instance: NO_INSTANCE }
    }
}

/// Primitive that a ray starts on, and on which side of it; keeps the ray from hitting that
/// primitive where it starts.
///
/// A ray that leaves a convex primitive outward cannot meet it again, and one that leaves it inward
/// meets the far side only. That takes no epsilon and so holds at every scale (torture tests 8 and
/// 12), where offsets fail for small or remote primitives.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OriginPrimitive(u32);

impl OriginPrimitive {
    /// No primitive: the ray starts in free space, on the lens.
    pub const NONE: Self = Self(u32::MAX);

    /// Creates the origin on `primitive` (below 2³¹) of a ray that goes `inside` it or outside.
    #[inline(always)]
    pub fn new(primitive: u32, inside: bool) -> Self {
        Self(primitive | (inside as u32) << 31)
    }

    /// Returns whether the ray starts on this primitive.
    #[inline(always)]
    pub fn is_on(self, primitive: u32) -> bool {
        self.0 & 0x7fff_ffff == primitive
    }

    /// Returns the number of the primitive; for [`OriginPrimitive::NONE`] a number that no
    /// primitive has.
    #[inline(always)]
    pub fn primitive(self) -> u32 {
        self.0 & 0x7fff_ffff
    }

    /// Returns whether the ray goes inside the primitive.
    #[inline(always)]
    pub fn goes_inside(self) -> bool {
        self.0 >> 31 != 0
    }
}
