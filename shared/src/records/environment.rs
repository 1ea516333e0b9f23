//! Record of an environment map.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Texel of an environment map in latitude and longitude. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct EnvironmentTexel {
    /// Radiance from the texel.
    pub radiance: Vec3,
    /// Probability of choosing this texel, times the number of texels.
    pub pdf: f32,
    /// Threshold of Walker's alias table: keep this texel if a random word is below, else take
    /// `alias`.
    pub threshold: u32,
    /// Index of the texel to take instead.
    pub alias: u32,
    /// Unused.
    pub pad: [u32; 2],
}

const _: () = assert!(size_of::<EnvironmentTexel>() == 32 && align_of::<EnvironmentTexel>() == 16);
