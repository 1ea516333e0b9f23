//! Images in memory, their reading from PNG, JPEG, TIFF, EXR, HDR and PFM files, and images for
//! textures.

mod bounds;
mod exr;
pub mod magma;
pub mod metrics;
pub mod output;
pub mod texture;

use crate::metrics::srgb;
use crate::output::{Format, pfm};
use bounds::{Bounds, Demand};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::{self, BufReader, Cursor, ErrorKind, Read, Seek};
use std::path::{Path, PathBuf};
use thiserror::Error;
use trisect_system::input;
use trisect_system::memory;

/// Image of linear Rec. 709 radiance, row-major, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green and blue of `width * height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

/// Image file, or other output, that cannot be read or written.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The system refused to read or write the file.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The extension names no format.
    #[error("{}: unknown image format; use .png, .jpg, .tif, .exr, .hdr or .pfm", path.display())]
    UnknownExtension {
        /// Path of the file.
        path: PathBuf,
    },
    /// An image would be printed on a terminal.
    #[error("standard output is a terminal, which shows no image; name a file, or pipe it into a program")]
    ToTerminal,
    /// Layers are asked for, and the format has none.
    #[error("{}: `aov` needs a format with layers; use .exr", path.display())]
    NoLayers {
        /// Path of the file.
        path: PathBuf,
    },
    /// Light groups are asked for, and the format has no layers.
    #[error("{}: `light_group` needs a format with layers; use .exr", path.display())]
    NoLightGroups {
        /// Path of the file.
        path: PathBuf,
    },
    /// Transparency is asked for, and the format has none.
    #[error("{}: `background` transparent needs a format with alpha; use .png, .tif or .exr", path.display())]
    NoAlpha {
        /// Path of the file.
        path: PathBuf,
    },
    /// A curve for a display is asked for, and the format holds radiance.
    #[error("{}: `{option}` is for a display, and the format holds linear radiance; use .png, .jpg or .tif", path.display())]
    NoDisplay {
        /// Path of the file.
        path: PathBuf,
        /// Option that asks for it.
        option: &'static str,
    },
    /// Channels of 16 bits are asked for, and the format has none.
    #[error("{}: `bits` 16 needs a format that has 8 or 16 bits; use .png or .tif", path.display())]
    No16Bits {
        /// Path of the file.
        path: PathBuf,
    },
    /// A layer is asked for twice.
    #[error("`aov` names {layer} twice; name each layer once")]
    LayerTwice {
        /// Name of the layer.
        layer: &'static str,
    },
    /// The content does not fit the extension, or cannot be decoded or encoded.
    #[error("{}: {message}", path.display())]
    Codec {
        /// Path of the file.
        path: PathBuf,
        /// Message of the codec.
        message: String,
    },
    /// The header claims more pixels than a file of this length can hold.
    #[error(
        "{}: its header says {width} x {height} pixels, for which a file of this kind has at least {}, but it has {}; it is cut off, or its header is wrong: write it again",
        path.display(), memory::display(*shortest), memory::display(*length)
    )]
    Cut {
        /// Path of the file.
        path: PathBuf,
        /// Width in pixels that the header claims.
        width: u64,
        /// Height in pixels that the header claims.
        height: u64,
        /// Bytes of the shortest file with as many pixels.
        shortest: u64,
        /// Bytes of the file.
        length: u64,
    },
    /// The file has only few of the pixels of its display window.
    #[error(
        "{}: its display window has {width} x {height} pixels, the file has {given} of them, and the blank rest would take too much memory; crop the display window to the data window",
        path.display()
    )]
    Blank {
        /// Path of the file.
        path: PathBuf,
        /// Width of the display window in pixels.
        width: u64,
        /// Height of the display window in pixels.
        height: u64,
        /// Number of pixels in the file.
        given: u64,
    },
    /// Decoding takes more memory than is available.
    #[error(
        "{}: reading its {width} x {height} pixels takes {}, but {} of memory are available; use a smaller image",
        path.display(), memory::display(*needed), memory::display(*free)
    )]
    TooLarge {
        /// Path of the file.
        path: PathBuf,
        /// Width in pixels.
        width: u64,
        /// Height in pixels.
        height: u64,
        /// Bytes of memory that decoding takes.
        needed: u64,
        /// Available bytes of memory.
        free: u64,
    },
}

impl Image {
    /// Writes the image in the format that the extension names: PNG, JPEG and TIFF with 8 bits in
    /// sRGB, EXR and PFM with 32-bit floats, HDR.
    ///
    /// # Errors
    ///
    /// [`ImageError`] for an unknown extension, or a file that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        output::write(self, path.as_ref())
    }

    /// Reads PNG, JPEG and TIFF (sRGB, decoded to linear), EXR, HDR or PFM, by extension.
    ///
    /// # Errors
    ///
    /// [`ImageError`], before memory is allocated for pixels that the file or the memory cannot
    /// hold.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let io = |source| ImageError::Io { path: path.to_owned(), source };
        let format = Format::of(path)?;
        let file = input::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        Self::read_from(file, length, format, path)
    }

    /// Reads the bytes of an image file, by the extension of its name, as [`read`](Self::read)
    /// does.
    ///
    /// # Errors
    ///
    /// Those of [`Self::read`].
    pub fn decode(bytes: &[u8], name: &Path) -> Result<Self, ImageError> {
        Self::read_from(Cursor::new(bytes), bytes.len() as u64, Format::of(name)?, name)
    }

    /// Reads an image of `length` bytes; `path` stands for it in messages.
    fn read_from(
        mut file: impl Read + Seek,
        length: u64,
        format: Format,
        path: &Path,
    ) -> Result<Self, ImageError> {
        let io = |source| ImageError::Io { path: path.to_owned(), source };
        let bounds = Bounds { path, length, free: memory::available() };
        match format {
            Format::Pfm => read_pfm(&bounds, file),
            Format::Exr => exr::read_file(&bounds, file),
            Format::Hdr => decode(&bounds, file, ImageFormat::Hdr, u64::MAX),
            Format::Jpeg => decode(&bounds, file, ImageFormat::Jpeg, u64::MAX),
            Format::Tiff => decode(&bounds, file, ImageFormat::Tiff, u64::MAX),
            Format::Png => {
                let mut start = Vec::new();
                (&mut file).take(64).read_to_end(&mut start).and_then(|_| file.rewind()).map_err(io)?;
                let mut largest = 0;
                if let Some((width, height, shortest)) = bounds::png(&start) {
                    let needed = width.saturating_mul(height).saturating_mul(MIN_OF_PIXEL);
                    bounds.check(&Demand { width, height, shortest, needed })?;
                    largest = needed;
                }
                decode(&bounds, file, ImageFormat::Png, largest.saturating_add(bounds::MAX_CHUNK))
            }
        }
    }
}

/// Bytes per pixel in addition to the decoded form: linear channels, twice while they are copied.
const MIN_OF_PIXEL: u64 = 24;

/// Decodes a file by the image library, which may allocate `largest` bytes for pixels
/// and other data of the file.
fn decode(
    bounds: &Bounds,
    file: impl Read + Seek,
    format: ImageFormat,
    largest: u64,
) -> Result<Image, ImageError> {
    let codec = |error: image::ImageError| match error {
        image::ImageError::IoError(source) if source.kind() == ErrorKind::UnexpectedEof => {
            ImageError::Codec { path: bounds.path.to_owned(), message: "the file is cut off".to_owned() }
        }
        image::ImageError::IoError(source) => ImageError::Io { path: bounds.path.to_owned(), source },
        other => ImageError::Codec { path: bounds.path.to_owned(), message: other.to_string() },
    };
    let mut reader = ImageReader::with_format(BufReader::new(file), format);
    let mut limits = Limits::default();
    // The default limit refuses images that this program writes. A limit is needed because a colour
    // profile may claim gigabytes.
    limits.max_alloc = Some(bounds.free.min(largest));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(codec)?;
    let (width, height) = decoder.dimensions();
    let (wide, high) = (u64::from(width), u64::from(height));
    let shortest = match format {
        ImageFormat::Hdr => bounds::shortest_hdr(wide, high),
        ImageFormat::Jpeg => bounds::shortest_jpeg(wide, high),
        ImageFormat::Tiff => decoder.total_bytes() / bounds::MAX_TIFF,
        _ => 0,
    };
    let needed = decoder.total_bytes().saturating_add((wide * high).saturating_mul(MIN_OF_PIXEL));
    bounds.check(&Demand { width: wide, height: high, shortest, needed })?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(codec)?;
    let encoded = !matches!(decoded, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let rgb = decoded.into_rgb32f();
    let linear = |value| if encoded { srgb::decode(value) } else { value };
    Ok(Image { width, height, pixels: rgb.pixels().map(|pixel| pixel.0.map(linear)).collect() })
}

/// Reads a portable float map (PFM). Its length decides how much memory it takes.
fn read_pfm(bounds: &Bounds, file: impl Read) -> Result<Image, ImageError> {
    let Bounds { path, length, free } = *bounds;
    // The bytes of the file, and its pixels: three channels, even if the file has one.
    let needed = length.saturating_mul(4);
    if needed > free {
        let (width, height) = (length / 4, 1);
        return Err(ImageError::TooLarge { path: path.to_owned(), width, height, needed, free });
    }
    let mut bytes = Vec::new();
    let io = |source| ImageError::Io { path: path.to_owned(), source };
    file.take(length).read_to_end(&mut bytes).map_err(io)?;
    pfm::decode(&bytes).map_err(|message| ImageError::Codec { path: path.to_owned(), message })
}

#[cfg(test)]
mod tests;
