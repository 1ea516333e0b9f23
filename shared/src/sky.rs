//! Radiance from infinity, for scenes without an environment map; [`crate::path`] adds it.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Sky of "Ray Tracing in One Weekend": a gradient by the y of the unit direction. 32 bytes; the
/// last word is unused.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Sky {
    /// Radiance from straight below.
    pub bottom: Vec3,
    /// Mean luminance over all directions, of the panorama if there is one, in the unit of the
    /// strengths of a [light tree](crate::light::tree). The host fills it in for a launch.
    pub strength: f32,
    /// Radiance from straight above.
    pub top: Vec3,
    /// Unused.
    pub pad1: u32,
}

const _: () = assert!(size_of::<Sky>() == 32);

impl Sky {
    /// Returns the radiance from a unit direction.
    #[inline(always)]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let a = 0.5 * (direction.y + 1.0);
        self.bottom + (self.top - self.bottom) * a // exact where both are equal
    }
}
