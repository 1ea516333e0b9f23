//! Record of a first hit.

#[cfg(doc)]
use crate::bvh::NO_PRIMITIVE;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// First hit of the camera ray of one sample. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FirstHit {
    /// Outward unit normal of the surface; zero if nothing is hit.
    pub normal: Vec3,
    /// Index of the primitive, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// Distance along the camera ray; [`crate::sphere::MISS`] if nothing is hit.
    pub distance: f32,
    /// Unused.
    pub pad: [u32; 3],
}

const _: () = assert!(size_of::<FirstHit>() == 32 && align_of::<FirstHit>() == 16);
