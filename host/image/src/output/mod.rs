//! Writing of image files by extension: PNG (8-bit sRGB), EXR and PFM (32-bit linear), HDR (linear,
//! shared exponent), and checks of the output files of a command.

mod channels;
mod conflict;
pub mod exposure;
pub mod pfm;
mod tone_map;

pub use channels::{Channel, Samples, write_channels};
pub use conflict::{ConflictError, Outputs, check_stored};
pub use tone_map::ToneMap;

use crate::metrics::srgb;
use crate::{Image, ImageError};
use image::{ExtendedColorType, ImageBuffer, ImageFormat, Rgb, Rgba};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;
use trisect_system::atomic_file::{self, write_atomic_or_in_place};

/// Image file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8-bit sRGB; values are clipped to 0..1.
    Png,
    /// OpenEXR, 32-bit float, linear.
    Exr,
    /// Radiance, linear, 8-bit mantissas with a shared exponent.
    Hdr,
    /// Portable float map, 32-bit, linear.
    Pfm,
}

impl Format {
    /// Returns the format that a path's extension names, in upper or lower case.
    ///
    /// # Errors
    ///
    /// [`ImageError::UnknownExtension`].
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some("hdr") => Ok(Self::Hdr),
            Some("pfm") => Ok(Self::Pfm),
            _ => Err(ImageError::UnknownExtension { path: path.to_owned() }),
        }
    }
}

/// Checks before a render that its image can be written: extension, folder and permissions. Creates
/// nothing under that name, and leaves an existing file unchanged.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    Format::of(path)?;
    probe(path)
}

/// Checks that a file of any kind can be written, as [`check_writable`] does for images.
pub fn probe(path: &Path) -> Result<(), ImageError> {
    atomic_file::probe(path).map_err(|source| ImageError::Io { path: path.to_owned(), source })
}

/// Writes a file of any kind. Replaces an earlier one completely or not at all, except where it can
/// only be written in place, as a device.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    write_atomic_or_in_place(path, bytes).map_err(|source| ImageError::Io { path: path.to_owned(), source })
}

/// Writes an image in the format that the extension names, and replaces an earlier file as
/// [`write_file`] does.
pub fn write(image: &Image, path: &Path) -> Result<(), ImageError> {
    let bytes = encode(image, Format::of(path)?)
        .map_err(|message| ImageError::Codec { path: path.to_owned(), message })?;
    write_atomic_or_in_place(path, &bytes).map_err(|source| ImageError::Io { path: path.to_owned(), source })
}

/// Writes a .png with alpha. `image` is multiplied by `alpha`, and the file is not, as its format
/// says. Replaces an earlier file as [`write_file`] does.
///
/// # Errors
///
/// [`ImageError::NoAlpha`] for another extension, [`ImageError::Codec`] if pixels or alpha do not
/// fill the image, [`ImageError::Io`] if the file cannot be written.
pub fn write_transparent(image: &Image, alpha: &[f32], path: &Path) -> Result<(), ImageError> {
    if Format::of(path)? != Format::Png {
        return Err(ImageError::NoAlpha { path: path.to_owned() });
    }
    let codec = |message: String| ImageError::Codec { path: path.to_owned(), message };
    let straight = |(pixel, &alpha): (&[f32; 3], &f32)| {
        let [red, green, blue] = pixel.map(|c| srgb::encode_u8(if alpha > 0.0 { c / alpha } else { 0.0 }));
        [red, green, blue, (255.0 * alpha.clamp(0.0, 1.0)).round() as u8]
    };
    let bytes: Vec<u8> = image.pixels.iter().zip(alpha).flat_map(straight).collect();
    let buffer: ImageBuffer<Rgba<u8>, _> = ImageBuffer::from_raw(image.width, image.height, bytes)
        .ok_or_else(|| codec("the pixels do not fill the image".to_owned()))?;
    let mut file = Cursor::new(Vec::new());
    buffer.write_to(&mut file, ImageFormat::Png).map_err(|error| codec(error.to_string()))?;
    write_file(path, &file.into_inner())
}

/// Writes a .png from sRGB bytes, three per pixel.
pub fn write_bytes(width: u32, height: u32, bytes: &[u8], path: &Path) -> Result<(), ImageError> {
    let bytes = encode_bytes(width, height, bytes)
        .map_err(|message| ImageError::Codec { path: path.to_owned(), message })?;
    write_atomic_or_in_place(path, &bytes).map_err(|source| ImageError::Io { path: path.to_owned(), source })
}

/// Returns the bytes of a .png from sRGB bytes, three per pixel.
pub fn encode_bytes(width: u32, height: u32, bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut file = Cursor::new(Vec::new());
    let buffer: ImageBuffer<Rgb<u8>, _> = ImageBuffer::from_raw(width, height, bytes.to_vec())
        .ok_or_else(|| "the pixels do not fill the image".to_owned())?;
    buffer.write_to(&mut file, ImageFormat::Png).map_err(|e| e.to_string())?;
    Ok(file.into_inner())
}

/// Writes a .png from RGBA pixels with 8 bits for each channel, red in the lowest byte. The file is
/// written in place: a series of frames need not survive a power failure.
///
/// # Errors
///
/// [`ImageError::Codec`] if the pixels do not fill the image, [`ImageError::Io`] if the file cannot
/// be written.
pub fn write_rgba(width: u32, height: u32, pixels: &[u32], path: &Path) -> Result<(), ImageError> {
    let bytes: Vec<u8> = pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect();
    let format = ImageFormat::Png;
    image::save_buffer_with_format(path, &bytes, width, height, ExtendedColorType::Rgba8, format).map_err(
        |error| match error {
            image::ImageError::IoError(source) => ImageError::Io { path: path.to_owned(), source },
            other => ImageError::Codec { path: path.to_owned(), message: other.to_string() },
        },
    )
}

/// Number of pixels that a task of the thread pool converts.
const TASK: usize = 4096;

/// Returns pixels as sRGB bytes, three per pixel, on all threads.
fn srgb_bytes(pixels: &[[f32; 3]]) -> Vec<u8> {
    let mut bytes = vec![[0; 3]; pixels.len()];
    let tasks = bytes.par_chunks_mut(TASK).zip(pixels.par_chunks(TASK));
    tasks.for_each(|(bytes, pixels)| {
        bytes.iter_mut().zip(pixels).for_each(|(bytes, pixel)| *bytes = pixel.map(srgb::encode_u8));
    });
    bytes.into_flattened()
}

/// Returns the bytes of an image file. NaN becomes black in PNG; NaN and infinity become black in
/// HDR, which cannot represent them.
pub fn encode(image: &Image, format: Format) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    let (width, height) = (image.width, image.height);
    let wrong_size = || "the pixels do not fill the image".to_owned();
    match format {
        Format::Png => {
            return encode_bytes(width, height, &srgb_bytes(&image.pixels));
        }
        Format::Exr => return channels::encode_rgb(image),
        Format::Hdr => {
            let mut samples: Vec<f32> = image.pixels.iter().flatten().copied().collect();
            samples.iter_mut().filter(|value| !value.is_finite()).for_each(|value| *value = 0.0);
            let buffer: ImageBuffer<Rgb<f32>, _> =
                ImageBuffer::from_raw(width, height, samples).ok_or_else(wrong_size)?;
            buffer.write_to(&mut bytes, ImageFormat::Hdr).map_err(|e| e.to_string())?;
        }
        Format::Pfm => return Ok(pfm::encode(image)),
    }
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn sample() -> Image {
        let pixels = (0..12).map(|i| [i as f32 / 11.0, 0.25, 1.0 - i as f32 / 11.0]).collect();
        Image { width: 4, height: 3, pixels }
    }

    fn round_trip(extension: &str) -> Image {
        let path =
            std::env::temp_dir().join(format!("trisect-{}-{extension}.{extension}", std::process::id()));
        write(&sample(), &path).unwrap();
        let image = Image::read(&path).unwrap();
        fs::remove_file(path).unwrap();
        image
    }

    fn greatest_difference(a: &Image, b: &Image) -> f32 {
        assert_eq!((a.width, a.height), (b.width, b.height));
        a.pixels
            .iter()
            .flatten()
            .zip(b.pixels.iter().flatten())
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    }

    #[test]
    fn float_formats_keep_every_bit() {
        assert_eq!(round_trip("exr"), sample());
        assert_eq!(round_trip("pfm"), sample());
    }

    #[test]
    fn coarse_formats_keep_their_precision() {
        // One step of 8-bit sRGB near white is 0.009 linear; HDR's mantissa has 8 bits.
        assert!(greatest_difference(&round_trip("png"), &sample()) < 0.005);
        assert!(greatest_difference(&round_trip("hdr"), &sample()) < 0.008);
    }

    #[test]
    fn extensions() {
        assert_eq!(Format::of(Path::new("a.PNG")).unwrap(), Format::Png);
        for bad in ["a", "a.jpg", "png"] {
            assert!(matches!(Format::of(Path::new(bad)), Err(ImageError::UnknownExtension { .. })), "{bad}");
        }
    }

    #[test]
    fn the_probe_leaves_nothing_behind() {
        let path = std::env::temp_dir().join(format!("trisect-{}-probe.png", std::process::id()));
        check_writable(&path).unwrap();
        assert!(!path.exists());
        assert!(matches!(check_writable(Path::new("/nonexistent/a.png")), Err(ImageError::Io { .. })));
    }
}
