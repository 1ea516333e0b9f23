//! Records of textures.

use crate::math::from_half;
use bytemuck::{Pod, Zeroable};
use glam::Vec4;

/// Texture index of a material without a texture.
pub const NO_TEXTURE: u32 = u32::MAX;

/// Wrap mode: the image repeats beyond its border.
pub const REPEAT: u32 = 0;
/// Wrap mode: the image repeats beyond its border, mirrored each time.
pub const MIRROR: u32 = 1;
/// Wrap mode: the border texel continues beyond the border.
pub const CLAMP: u32 = 2;
/// Bit of [`Texture::flags`]: nearest texel instead of bilinear interpolation. Bits 0 to 1 are the
/// wrap mode across, bits 2 to 3 the wrap mode down.
pub const NEAREST: u32 = 1 << 4;
/// Bit of [`Texture::flags`]: the second set of texture coordinates.
pub const SECOND_SET: u32 = 1 << 5;

/// Use of an image by a material. 48 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Texture {
    /// Index of the image's first texel in the array of all texels.
    pub first: u32,
    /// Texels across, at least 1.
    pub width: u32,
    /// Texels down, at least 1.
    pub height: u32,
    /// Wrap modes, filter and set of texture coordinates; see [`NEAREST`] and [`SECOND_SET`].
    pub flags: u32,
    /// Coefficient of the image's u, which is `uu` u + `uv` v + `u0` of the surface's (u, v). Image
    /// coordinate (0, 0) is the image's top left corner.
    pub uu: f32,
    /// Coefficient of the image's u; see `uu`.
    pub uv: f32,
    /// Coefficient of the image's v, which is `vu` u + `vv` v + `v0` of the surface's (u, v).
    pub vu: f32,
    /// Coefficient of the image's v; see `vu`.
    pub vv: f32,
    /// Offset of the image's u; see `uu`.
    pub u0: f32,
    /// Offset of the image's v; see `vu`.
    pub v0: f32,
    /// Unused.
    pub pad: [u32; 2],
}

const _: () = assert!(size_of::<Texture>() == 48 && align_of::<Texture>() == 16);

/// Texel: four linear channels in half precision; see [`from_half`]. 8 bytes.
#[repr(C, align(8))]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Texel {
    /// Red in the lower half, green in the upper half.
    pub red_green: u32,
    /// Blue in the lower half, alpha in the upper half.
    pub blue_alpha: u32,
}

impl Texel {
    /// Opaque white.
    pub const WHITE: Self = Self { red_green: 0x3c00_3c00, blue_alpha: 0x3c00_3c00 };

    /// Returns red, green, blue and alpha.
    #[inline(always)]
    pub fn channels(self) -> Vec4 {
        Vec4::new(
            from_half(self.red_green),
            from_half(self.red_green >> 16),
            from_half(self.blue_alpha),
            from_half(self.blue_alpha >> 16),
        )
    }
}
