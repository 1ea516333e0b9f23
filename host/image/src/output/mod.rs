//! Writing of image files by extension: PNG, JPEG and TIFF for a display, EXR, HDR and PFM with
//! linear radiance; and checks of the output files of a command.

mod channel;
mod conflict;
mod encoding;
pub mod exposure;
mod exr;
mod format;
mod jpeg;
mod metadata;
pub mod pfm;
mod picture;
mod picture_file;
mod png;
mod tiff;
mod tone_map;

pub use channel::{Channel, Samples, channels, color_channels};
pub use conflict::{ConflictError, Outputs, check_stored};
pub use encoding::{BitDepth, Encoding, GAMMA_RANGE, Transfer, Window};
pub use exr::{MAX_HALF, exceeds_half};
pub use format::{Format, is_stdout};
pub use metadata::{CameraMetadata, Metadata};
pub use picture::Picture;
pub use png::{encode_bytes, write_rgba};
pub use tone_map::ToneMap;

use crate::{Image, ImageError};
use std::io::{ErrorKind, Write};
use std::path::Path;
use trisect_system::atomic_file::{self, write_atomic_or_in_place};

/// Checks before a render that its image can be written: extension, folder and permissions. Creates
/// nothing under that name, and leaves an existing file unchanged.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    Format::of(path)?;
    probe(path)
}

/// Checks that a file of any kind can be written, as [`check_writable`] does for images. Standard
/// output always passes.
pub fn probe(path: &Path) -> Result<(), ImageError> {
    if is_stdout(path) {
        return Ok(());
    }
    atomic_file::probe(path).map_err(|source| {
        let folder = path.parent().filter(|folder| *folder != Path::new("") && !folder.exists());
        let source = match folder {
            Some(folder) => {
                let message = format!("the folder {} does not exist; create it first", folder.display());
                std::io::Error::new(ErrorKind::NotFound, message)
            }
            None => source,
        };
        ImageError::Io { path: path.to_owned(), source }
    })
}

/// Writes a file of any kind. Replaces an earlier one completely or not at all, except where it can
/// only be written in place, as a device, or is standard output, whose reader may end early.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    if is_stdout(path) {
        let mut out = std::io::stdout().lock();
        return match out.write_all(bytes).and_then(|()| out.flush()) {
            Err(source) if source.kind() != ErrorKind::BrokenPipe => {
                Err(ImageError::Io { path: "standard output".into(), source })
            }
            _ => Ok(()),
        };
    }
    write_atomic_or_in_place(path, bytes).map_err(|source| ImageError::Io { path: path.to_owned(), source })
}

/// Writes an image in the format that the extension names, and replaces an earlier file as
/// [`write_file`] does.
///
/// # Errors
///
/// Those of [`Picture::write`].
pub fn write(image: &Image, path: &Path) -> Result<(), ImageError> {
    Picture::from(image).write(path, &Encoding::default())
}

/// Writes a .png from sRGB bytes, three per pixel, and replaces an earlier file as [`write_file`]
/// does.
///
/// # Errors
///
/// [`ImageError::Codec`] if the bytes do not fill the image, [`ImageError::Io`] if the file cannot
/// be written.
pub fn write_bytes(
    size: (u32, u32),
    bytes: &[u8],
    path: &Path,
    metadata: &Metadata,
) -> Result<(), ImageError> {
    let bytes = png::encode_bytes_with(size, bytes, metadata)
        .map_err(|message| ImageError::Codec { path: path.to_owned(), message })?;
    write_file(path, &bytes)
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
        assert!(greatest_difference(&round_trip("tif"), &sample()) < 0.005);
        // JPEG mixes neighbours; a picture this small has no smooth region.
        assert!(greatest_difference(&round_trip("jpg"), &sample()) < 0.1);
    }

    #[test]
    fn the_probe_leaves_nothing_behind() {
        let path = std::env::temp_dir().join(format!("trisect-{}-probe.png", std::process::id()));
        check_writable(&path).unwrap();
        assert!(!path.exists());
        assert!(matches!(check_writable(Path::new("/nonexistent/a.png")), Err(ImageError::Io { .. })));
    }
}
