//! Image for a screen: 8 bits a channel, sRGB. The display kernel of live frames calls [`display`].

use crate::denoise::FilteredPixel;
use crate::film::PixelSums;
use crate::math::{cbrt_unit, sqrt};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// One launch of the display kernel. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct DisplayParams {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Number of columns, from the left, that show the plain mean of the samples.
    pub split: u32,
    /// Factor of the radiance.
    pub exposure: f32,
    /// First row of the launch.
    pub first_row: u32,
    /// Unused.
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
    /// Unused.
    pub pad2: u32,
}

const _: () = assert!(size_of::<DisplayParams>() == 32);

/// Returns a pixel of column `x` as red, green, blue and opacity, from the lowest byte on: the
/// plain mean of its samples, or the result of the denoiser. A channel that is not a number is
/// black, as in a PNG.
#[inline(always)]
pub fn display(params: &DisplayParams, sums: PixelSums, filtered: FilteredPixel, x: u32) -> u32 {
    let color = if x < params.split { mean(params, sums) } else { denoised(params, filtered) };
    pack(srgb(color.x), srgb(color.y), srgb(color.z))
}

/// Returns the exposed mean of samples; NaN without samples.
#[inline(always)]
fn mean(params: &DisplayParams, sums: PixelSums) -> Vec3 {
    sums.radiance / sums.samples as f32 * params.exposure
}

/// Returns the exposed result of the denoiser; black if it is not known.
#[inline(always)]
fn denoised(params: &DisplayParams, filtered: FilteredPixel) -> Vec3 {
    if filtered.is_known() { filtered.color * params.exposure } else { Vec3::ZERO }
}

#[inline(always)]
fn pack(red: u32, green: u32, blue: u32) -> u32 {
    red | green << 8 | blue << 16 | 0xff00_0000
}

/// Number of pixels that [`display_rows`] converts at a time.
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
const AT_ONCE: usize = 64;

/// Calls `show` with the index and the colour of each pixel of the columns `span` of row `y`, as
/// [`display`] returns it. Channels lie next to each other while they are converted, so that a
/// compiler for a CPU converts several at a time.
///
/// # Panics
///
/// If an array has no record for one of the pixels.
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
#[inline(always)]
pub fn display_rows(
    params: &DisplayParams,
    sums: &[PixelSums],
    filtered: &[FilteredPixel],
    span: core::ops::Range<u32>,
    y: u32,
    mut show: impl FnMut(u32, u32),
) {
    for first in span.clone().step_by(AT_ONCE) {
        let columns = first..span.end.min(first + AT_ONCE as u32);
        let (mut linear, mut codes) = ([[0.0; AT_ONCE]; 3], [[0; AT_ONCE]; 3]);
        for (at, x) in columns.clone().enumerate() {
            let pixel = (y * params.width + x) as usize;
            let color =
                if x < params.split { mean(params, sums[pixel]) } else { denoised(params, filtered[pixel]) };
            [linear[0][at], linear[1][at], linear[2][at]] = color.to_array();
        }
        for (codes, linear) in codes.iter_mut().zip(&linear) {
            for (code, linear) in codes.iter_mut().zip(linear) {
                *code = srgb(*linear);
            }
        }
        for (at, x) in columns.enumerate() {
            show(y * params.width + x, pack(codes[0][at], codes[1][at], codes[2][at]));
        }
    }
}

/// Returns the sRGB code (IEC 61966-2-1) of a linear value: clipped, and rounded to nearest up to
/// an error of 1e-6.
#[inline(always)]
fn srgb(linear: f32) -> u32 {
    // NaN is not above 0.
    let c = if linear > 0.0 { if linear < 1.0 { linear } else { 1.0 } } else { 0.0 };
    // c^(1/2.4) is the cube root of c^(5/4).
    let curve = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * cbrt_unit(c * sqrt(sqrt(c))) - 0.055 };
    (curve * 255.0 + 0.5) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(width: u32, split: u32, exposure: f32) -> DisplayParams {
        DisplayParams { width, height: 1, split, exposure, first_row: 0, pad0: 0, pad1: 0, pad2: 0 }
    }

    fn shown(params: &DisplayParams, value: f32, x: u32) -> u32 {
        let sums = PixelSums { radiance: Vec3::splat(value * 4.0), samples: 4, ..PixelSums::ZERO };
        let lit = FilteredPixel { color: Vec3::splat(value * 0.5), variance: 0.0 };
        display(params, sums, lit, x) & 0xff
    }

    #[test]
    fn codes_are_those_of_the_standard() {
        let params = of(1, 1, 1.0);
        let curve = |c: f64| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        let mut worst = 0.0f64;
        for step in 0..=100_000 {
            let value = step as f32 * 1e-5;
            let want = curve(f64::from(value)) * 255.0;
            worst = worst.max((f64::from(shown(&params, value, 0)) - want).abs());
        }
        assert!(worst < 0.5 + 1e-3, "{worst}");
        for (value, code) in
            [(f32::NAN, 0), (-1.0, 0), (f32::NEG_INFINITY, 0), (2.0, 255), (f32::INFINITY, 255)]
        {
            assert_eq!(shown(&params, value, 0), code, "{value}");
        }
    }

    #[test]
    fn the_left_is_raw() {
        let params = of(4, 2, 2.0);
        assert_eq!((shown(&params, 0.5, 1), shown(&params, 0.5, 2)), (255, 188));
        let nothing = display(&params, PixelSums::ZERO, FilteredPixel::UNKNOWN, 0);
        assert_eq!(
            (nothing, display(&params, PixelSums::ZERO, FilteredPixel::UNKNOWN, 3)),
            (0xff00_0000, 0xff00_0000)
        );
    }
}
