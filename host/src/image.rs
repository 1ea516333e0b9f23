//! Images in memory, and reading them from files.

use crate::metrics::srgb;
use crate::output::pfm;
use image::{DynamicImage, ImageReader};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Linear Rec. 709 radiance, row-major, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

/// An image file that cannot be read or written.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The extension names no format.
    #[error("{}: unknown image format; use .png, .exr, .hdr or .pfm", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
    },
    /// A format of one picture, and more to write.
    #[error("{}: --aov needs a format with layers; use .exr", path.display())]
    NoLayers {
        /// The file.
        path: PathBuf,
    },
    /// The content is not what the extension says, or cannot be encoded.
    #[error("{}: {message}", path.display())]
    Codec {
        /// The file.
        path: PathBuf,
        /// What the codec said.
        message: String,
    },
}

impl Image {
    /// Reads PNG (sRGB, decoded to linear), EXR, HDR or PFM, by extension.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let format = crate::output::Format::of(path)?;
        let io = |source| ImageError::Io { path: path.to_owned(), source };
        if format == crate::output::Format::Pfm {
            let bytes = std::fs::read(path).map_err(io)?;
            return pfm::decode(&bytes)
                .map_err(|message| ImageError::Codec { path: path.to_owned(), message });
        }
        let codec = |error: image::ImageError| match error {
            image::ImageError::IoError(source) => ImageError::Io { path: path.to_owned(), source },
            other => ImageError::Codec { path: path.to_owned(), message: other.to_string() },
        };
        let mut reader = ImageReader::open(path).map_err(io)?;
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(crate::memory::available()); // its default refuses images that this program writes
        reader.limits(limits);
        let decoded = reader.decode().map_err(codec)?;
        let encoded = !matches!(decoded, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
        let rgb = decoded.into_rgb32f();
        let (width, height) = rgb.dimensions();
        let linear = |value| if encoded { srgb::decode(value) } else { value };
        Ok(Self { width, height, pixels: rgb.pixels().map(|pixel| pixel.0.map(linear)).collect() })
    }
}
