//! Choices of how an image file is encoded.

use super::{Format, Metadata};
use crate::ImageError;
use crate::metrics::srgb;
use rayon::prelude::*;
use std::path::Path;

/// Minimum and maximum exponent of [`Transfer::Gamma`].
pub const GAMMA_RANGE: std::ops::RangeInclusive<f32> = 0.1..=10.0;

/// Number of pixels that a task of the thread pool converts.
const TASK: usize = 4096;

/// Curve by which a file for a display encodes linear light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Transfer {
    /// The sRGB transfer function (IEC 61966-2-1).
    #[default]
    Srgb,
    /// Power of 1 / gamma.
    Gamma(f32),
}

impl Transfer {
    /// Encodes one value. Values below 0 give at most 0; NaN gives NaN.
    pub fn encode(self, linear: f32) -> f32 {
        match self {
            Self::Srgb => srgb::encode(linear),
            Self::Gamma(gamma) if linear > 0.0 => linear.powf(1.0 / gamma),
            Self::Gamma(_) => linear,
        }
    }
}

/// Bits of a channel in a file for a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 8 bits.
    #[default]
    Eight,
    /// 16 bits, in .png and .tif.
    Sixteen,
}

/// Encoding of an image file. The default is that of the library: 8-bit sRGB for a display, 32-bit
/// floats in .exr, no metadata.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Encoding {
    /// Bits of a channel in a file for a display.
    pub bits: BitDepth,
    /// Curve of a file for a display.
    pub transfer: Transfer,
    /// True if colours in .exr have 16 bits, unless one exceeds
    /// [`MAX_HALF`](super::exr::MAX_HALF).
    pub half: bool,
    /// Text about the render.
    pub metadata: Metadata,
    /// Place of the image in a larger one, which .exr keeps: its data window in the display window.
    pub window: Option<Window>,
}

/// Place of an image in a larger one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the larger image at the upper left pixel.
    pub at: (u32, u32),
    /// Pixels across and down the larger image.
    pub of: (u32, u32),
}

impl Encoding {
    /// Checks that the format of an image has what was asked for.
    ///
    /// # Errors
    ///
    /// [`ImageError::No16Bits`] for 16 bits, [`ImageError::NoDisplay`] for a gamma, in a format
    /// that has none.
    pub fn check(&self, path: &Path) -> Result<(), ImageError> {
        let format = Format::of(path)?;
        if self.bits == BitDepth::Sixteen && !format.has_16_bits() {
            return Err(ImageError::No16Bits { path: path.to_owned() });
        }
        if self.transfer != Transfer::Srgb && !format.is_display() {
            return Err(ImageError::NoDisplay { path: path.to_owned(), option: "gamma" });
        }
        Ok(())
    }
}

/// Returns the samples of a file for a display, `N` per pixel. `sample` turns red, green, blue and
/// alpha into samples. Without `alpha` it is 1; otherwise the image is multiplied by it, and the
/// samples are not.
fn samples<T: Copy + Default + Send, const N: usize>(
    pixels: &[[f32; 3]],
    alpha: Option<&[f32]>,
    sample: impl Fn([f32; 3], f32) -> [T; N] + Sync,
) -> Vec<T> {
    let mut samples = vec![[T::default(); N]; pixels.len()];
    let tasks = samples.par_chunks_mut(TASK).zip(pixels.par_chunks(TASK)).enumerate();
    tasks.for_each(|(task, (samples, pixels))| {
        let alpha = alpha.map(|alpha| &alpha[task * TASK..]);
        for (index, (sampled, pixel)) in samples.iter_mut().zip(pixels).enumerate() {
            *sampled = match alpha.map(|alpha| alpha[index]) {
                None => sample(*pixel, 1.0),
                Some(alpha) => sample(pixel.map(|c| if alpha > 0.0 { c / alpha } else { 0.0 }), alpha),
            };
        }
    });
    samples.into_flattened()
}

/// Returns RGB samples, or RGBA samples with `alpha`, of 8 bits.
pub(super) fn samples_8(pixels: &[[f32; 3]], alpha: Option<&[f32]>, transfer: Transfer) -> Vec<u8> {
    // A float-to-integer cast saturates, and maps NaN to 0.
    let code = |value: f32| (transfer.encode(value) * 255.0 + 0.5) as u8;
    match alpha {
        None => samples(pixels, None, |pixel, _| pixel.map(code)),
        Some(_) => samples(pixels, alpha, |pixel, alpha| {
            let [red, green, blue] = pixel.map(code);
            [red, green, blue, (255.0 * alpha.clamp(0.0, 1.0)).round() as u8]
        }),
    }
}

/// Returns RGB samples, or RGBA samples with `alpha`, of 16 bits.
pub(super) fn samples_16(pixels: &[[f32; 3]], alpha: Option<&[f32]>, transfer: Transfer) -> Vec<u16> {
    let code = |value: f32| (transfer.encode(value) * 65535.0 + 0.5) as u16;
    match alpha {
        None => samples(pixels, None, |pixel, _| pixel.map(code)),
        Some(_) => samples(pixels, alpha, |pixel, alpha| {
            let [red, green, blue] = pixel.map(code);
            [red, green, blue, (65535.0 * alpha.clamp(0.0, 1.0)).round() as u16]
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_known_values() {
        let pixels = [[0.0, 0.18, 1.0], [f32::NAN, -1.0, 7.0]];
        assert_eq!(samples_8(&pixels, None, Transfer::Srgb), [0, 118, 255, 0, 0, 255]);
        assert_eq!(samples_8(&pixels[..1], None, Transfer::Gamma(2.0)), [0, 108, 255]);
        // 0.18 is 0.461356 in sRGB.
        assert_eq!(samples_16(&pixels, None, Transfer::Srgb), [0, 30235, 65535, 0, 0, 65535]);
        assert_eq!(
            samples_8(&[[0.09, 0.0, 0.5], [1.0; 3]], Some(&[0.5, 0.0]), Transfer::Srgb),
            [118, 0, 255, 128, 0, 0, 0, 0]
        );
        assert_eq!(samples_16(&[[0.25; 3]], Some(&[0.25]), Transfer::Srgb), [65535, 65535, 65535, 16384]);
    }

    /// All pixels have their own alpha, also beyond the first task.
    #[test]
    fn tasks_share_the_pixels() {
        let count = 3 * TASK + 5;
        let alpha: Vec<f32> = (0..count).map(|index| (index % 7) as f32 / 6.0).collect();
        let pixels: Vec<[f32; 3]> = alpha.iter().map(|alpha| [*alpha; 3]).collect();
        for (pixel, alpha) in samples_8(&pixels, Some(&alpha), Transfer::Srgb).chunks(4).zip(&alpha) {
            let white = if *alpha > 0.0 { 255 } else { 0 };
            assert_eq!(pixel, [white, white, white, (255.0 * alpha).round() as u8]);
        }
    }

    #[test]
    fn formats_lack_what_they_lack() {
        let sixteen = Encoding { bits: BitDepth::Sixteen, ..Encoding::default() };
        let gamma = Encoding { transfer: Transfer::Gamma(2.2), ..Encoding::default() };
        let passes = |of: &Encoding, name: &str| of.check(Path::new(name)).is_ok();
        assert!(passes(&sixteen, "a.png") && passes(&sixteen, "a.tif") && !passes(&sixteen, "a.jpg"));
        assert!(passes(&gamma, "a.jpg") && !passes(&gamma, "a.exr") && !passes(&sixteen, "a.exr"));
        assert!(passes(&Encoding::default(), "a.pfm"));
    }
}
