//! Record of a participating medium.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

/// Bit of [`Medium::flags`]: collisions scatter or emit. A medium without it only absorbs.
pub const COLLIDES: u32 = 1;
/// Bit of [`Medium::flags`]: a grid of densities multiplies the extinction.
pub const HAS_GRID: u32 = 2;

/// Medium that absorbs, scatters and emits. 128 bytes, as
/// [`Material`](crate::material::Material), in whose array it stands.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Medium {
    /// Extinction by channel, per scene unit; of a medium with a grid, where the grid has its
    /// maximum.
    pub extinction: Vec3,
    /// Mean cosine of the scattering angle (g of Henyey and Greenstein), above -1 and below 1.
    pub anisotropy: f32,
    /// Scattered fraction of a collision, by channel, 0 to 1; 0 in channels without extinction.
    pub albedo: Vec3,
    /// Bits: [`COLLIDES`], [`HAS_GRID`].
    pub flags: u32,
    /// Radiance emitted by a collision, by channel: that of a thick layer times 1 - albedo.
    pub emission: Vec3,
    /// Index of the grid's first texel of densities.
    pub first_density: u32,
    /// Row of the map from world coordinates to voxels across; voxel i reaches from i to i + 1.
    pub x: Vec4,
    /// Row of that map to voxels down.
    pub y: Vec4,
    /// Row of that map to layers of voxels.
    pub z: Vec4,
    /// Number of voxels across; at least 1 with a grid, as `height` and `depth`.
    pub width: u32,
    /// Number of rows of voxels.
    pub height: u32,
    /// Number of layers of voxels.
    pub depth: u32,
    /// Index of the texel with the first cell's majorant; there is one for each cell of
    /// [`CELL`](crate::medium::CELL) voxels along each axis.
    pub first_majorant: u32,
    /// Unused.
    pub pad: [u32; 4],
}

const _: () = assert!(size_of::<Medium>() == 128 && align_of::<Medium>() == 16);

impl Medium {
    /// Stands for no medium.
    pub const CLEAR: Self = Self {
        extinction: Vec3::ZERO,
        anisotropy: 0.0,
        albedo: Vec3::ZERO,
        flags: 0,
        emission: Vec3::ZERO,
        first_density: 0,
        x: Vec4::ZERO,
        y: Vec4::ZERO,
        z: Vec4::ZERO,
        width: 0,
        height: 0,
        depth: 0,
        first_majorant: 0,
        pad: [0; 4],
    };
}
