//! Rays, and where on a primitive they start.

use glam::Vec3;

/// A half-line: points `origin` + t `direction`, t > 0. In rows, as naga lays out what holds it.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, in scene units.
    pub origin: Vec3,
    /// The primitive that the ray leaves.
    pub origin_primitive: OriginPrimitive,
    /// Unit vector.
    pub direction: Vec3,
}

/// The primitive that a ray starts on, and on which side of it; keeps it from hitting that primitive where it starts.
///
/// A ray that leaves a convex primitive outward cannot meet it again, and one that leaves inward meets the far side
/// only. Knowing that takes no epsilon, so it holds at every scale (numerics: torture tests 8 and 12), where offsets
/// fail for small or remote primitives.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OriginPrimitive(u32);

impl OriginPrimitive {
    /// In free space: on the lens.
    pub const NONE: Self = Self(u32::MAX);

    /// On `primitive` (below 2³¹), going inside it or outside.
    #[inline(always)]
    pub fn new(primitive: u32, inside: bool) -> Self {
        Self(primitive | (inside as u32) << 31)
    }

    /// Whether the ray starts on this primitive.
    #[inline(always)]
    pub fn is_on(self, primitive: u32) -> bool {
        self.0 & 0x7fff_ffff == primitive
    }

    /// The number of the primitive; for [`OriginPrimitive::NONE`] one that no primitive has.
    #[inline(always)]
    pub fn primitive(self) -> u32 {
        self.0 & 0x7fff_ffff
    }

    /// Whether it goes inside.
    #[inline(always)]
    pub fn goes_inside(self) -> bool {
        self.0 >> 31 != 0
    }
}
