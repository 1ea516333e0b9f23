//! Image textures: bilinear or nearest lookup in one array of texels for all images.
//!
//! Called by BSDFs, lights and paths; the host decodes images to texels.

use crate::buffer::load;
use crate::math::{floor, from_half};
use crate::scene::Scene;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

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
    /// Wrap modes and filter; see [`NEAREST`].
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

/// Returns the texel index, 0 to `size` - 1, of any column or row `i`, by wrap mode.
#[inline(always)]
fn wrap(i: i32, size: u32, mode: u32) -> u32 {
    if mode == CLAMP {
        return if i < 0 {
            0
        } else if i as u32 >= size {
            size - 1
        } else {
            i as u32
        };
    }
    // At least 1, so that the compiler drops the check for division by zero.
    let period = if mode == MIRROR { 2 * size } else { size }.max(1);
    let r = if i < 0 { period - 1 - !i as u32 % period } else { i as u32 % period };
    if r >= size { period - 1 - r } else { r }
}

/// Returns the four channels of texture `index` at (`u`, `v`) of the surface.
///
/// # Safety
///
/// `index` and the scene's textures were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn sample(scene: Scene, index: u32, u: f32, v: f32) -> Vec4 {
    // SAFETY: the caller's promise.
    let t = unsafe { load::<Texture>(scene.textures, index) };
    let x = (t.uu * u + t.uv * v + t.u0) * t.width as f32;
    let y = (t.vu * u + t.vv * v + t.v0) * t.height as f32;
    if t.flags & NEAREST != 0 {
        // SAFETY: the caller's promise.
        return unsafe { texel(scene, t, floor(x), floor(y)) };
    }
    let (x, y) = (x - 0.5, y - 0.5); // from texel centre to texel centre
    let (i, j) = (floor(x), floor(y));
    // A coordinate that is too large to have a fraction has fraction 0.
    let (fx, fy) = (fraction(x, i), fraction(y, j));
    // SAFETY: the caller's promise.
    unsafe {
        let top = texel(scene, t, i, j) * (1.0 - fx) + texel(scene, t, i + 1, j) * fx;
        let bottom = texel(scene, t, i, j + 1) * (1.0 - fx) + texel(scene, t, i + 1, j + 1) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// Returns the texel of any column `i` and row `j`, wrapped. (Not a closure: it would capture
/// references in a record, which rust-gpu does not have.)
///
/// # Safety
///
/// As [`sample`], for `t`.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn texel(scene: Scene, t: Texture, i: i32, j: i32) -> Vec4 {
    let (across, down) = (t.flags & 3, (t.flags >> 2) & 3);
    let at = t.first + wrap(j, t.height, down) * t.width + wrap(i, t.width, across);
    // SAFETY: `wrap` stays inside the image, whose texels the host proved.
    unsafe { load::<Texel>(scene.texels, at) }.channels()
}

#[inline(always)]
#[allow(
    clippy::manual_range_contains,
    reason = "rust-gpu has no references in records, which `contains` of a range needs"
)]
fn fraction(x: f32, floor: i32) -> f32 {
    let f = x - floor as f32;
    if f >= 0.0 && f <= 1.0 { f } else { 0.0 }
}

/// Returns the colour of texture `index` at (`u`, `v`), or white for [`NO_TEXTURE`].
///
/// # Safety
///
/// As [`sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn color(scene: Scene, index: u32, u: f32, v: f32) -> Vec3 {
    if index == NO_TEXTURE {
        return Vec3::ONE;
    }
    // SAFETY: the caller's promise.
    let c = unsafe { sample(scene, index, u, v) };
    Vec3::new(c.x, c.y, c.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapping() {
        let all = |mode, size: u32, from: i32, to: i32, out: &mut [u32]| {
            for (slot, i) in out.iter_mut().zip(from..to) {
                *slot = wrap(i, size, mode);
            }
        };
        let mut got = [0; 9];
        all(REPEAT, 3, -4, 5, &mut got);
        assert_eq!(got, [2, 0, 1, 2, 0, 1, 2, 0, 1]);
        all(MIRROR, 3, -4, 5, &mut got);
        assert_eq!(got, [2, 2, 1, 0, 0, 1, 2, 2, 1]);
        all(CLAMP, 3, -4, 5, &mut got);
        assert_eq!(got, [0, 0, 0, 0, 0, 1, 2, 2, 2]);
        for mode in [REPEAT, MIRROR, CLAMP] {
            for i in [i32::MIN, i32::MIN + 1, -2_000_000_000, i32::MAX - 1, i32::MAX] {
                assert!(wrap(i, 7, mode) < 7);
            }
        }
    }
}
