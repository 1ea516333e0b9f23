//! Image textures: bilinear or nearest lookup in one array of texels for all images.
//!
//! Called by BSDFs, lights and paths; the host decodes images to texels.

use crate::buffer::{load, load_record};
use crate::math::floor;
pub use crate::records::texture::{CLAMP, MIRROR, NEAREST, NO_TEXTURE, REPEAT, SECOND_SET, Texel, Texture};
use crate::scene::Scene;
use glam::{Vec3, Vec4};

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
/// A nearest lookup is a bilinear one without fractions, so that kernels have one of both.
///
/// # Safety
///
/// `index` and the scene's textures were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn sample(scene: Scene, index: u32, u: f32, v: f32) -> Vec4 {
    // SAFETY: the caller's promise.
    unsafe { filter(scene, load_record::<Texture>(scene.textures, index), u, v) }
}

/// Returns the four channels of texture `t` at (`u`, `v`) of the surface.
///
/// # Safety
///
/// `t` is one of the scene's textures, as in [`sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn filter(scene: Scene, t: Texture, u: f32, v: f32) -> Vec4 {
    let mut x = (t.uu * u + t.uv * v + t.u0) * t.width as f32;
    let mut y = (t.vu * u + t.vv * v + t.v0) * t.height as f32;
    let nearest = t.flags & NEAREST != 0;
    if !nearest {
        (x, y) = (x - 0.5, y - 0.5); // from texel centre to texel centre
    }
    let (i, j) = (floor(x), floor(y));
    let (mut fx, mut fy) = (0.0, 0.0);
    if !nearest {
        // A coordinate that is too large to have a fraction has fraction 0.
        (fx, fy) = (fraction(x, i), fraction(y, j));
    }
    let (across, down) = (t.flags & 3, (t.flags >> 2) & 3);
    let (left, right) = (wrap(i, t.width, across), wrap(i + 1, t.width, across));
    let top = t.first + wrap(j, t.height, down) * t.width;
    let bottom = t.first + wrap(j + 1, t.height, down) * t.width;
    // SAFETY: `wrap` stays inside the image, whose texels the host proved.
    unsafe {
        let texel = |at: u32| load::<Texel>(scene.texels, at).channels();
        let upper = texel(top + left) * (1.0 - fx) + texel(top + right) * fx;
        let lower = texel(bottom + left) * (1.0 - fx) + texel(bottom + right) * fx;
        upper * (1.0 - fy) + lower * fy
    }
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
