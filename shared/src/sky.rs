//! Radiance from infinity.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The sky of "Ray Tracing in One Weekend": a gradient by the y of the unit direction. 32 bytes;
/// the fourth word of a row is unused.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Sky {
    /// Radiance straight down.
    pub bottom: Vec3,
    /// Unused.
    pub pad0: u32,
    /// Radiance straight up.
    pub top: Vec3,
    /// Unused.
    pub pad1: u32,
}

const _: () = assert!(size_of::<Sky>() == 32);

impl Sky {
    /// Radiance along a unit direction.
    #[inline(always)]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let a = 0.5 * (direction.y + 1.0);
        self.bottom + (self.top - self.bottom) * a // exact where both are equal
    }
}
