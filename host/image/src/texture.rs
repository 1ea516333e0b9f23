//! Decoding of images for textures: PNG and JPEG.

use crate::bounds::{self, Demand};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use thiserror::Error;
use trisect_system::memory;

/// Maximum width and height in texels.
pub const MAX_SIDE: u32 = 16384;

/// First bytes and names of texture containers for GPUs, which are not supported.
const CONTAINERS: [(&[u8], &str); 2] =
    [(b"\xabKTX 20\xbb\r\n\x1a\n", "KTX2"), (b"\xabKTX 11\xbb\r\n\x1a\n", "KTX")];

/// Texels with 8 bits for each of red, green, blue and alpha, in the file's own transfer function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba8 {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels, row by row, top row first.
    pub texels: Vec<[u8; 4]>,
}

/// Bytes that are no image for a texture. Messages name neither file nor place, which the caller
/// knows.
#[derive(Debug, Error)]
pub enum TextureError {
    /// A container of textures for GPUs.
    #[error("{0}, the format of this image,")]
    Container(&'static str),
    /// An image of another format.
    #[error("{0}, the format of this image,")]
    Format(String),
    /// Bytes of no known format.
    #[error("this is not an image")]
    NoImage,
    /// Bytes that the image library does not decode.
    #[error("the image cannot be decoded: {0}")]
    Codec(String),
    /// An image without texels.
    #[error("the image has no texels")]
    Empty,
    /// A side above [`MAX_SIDE`].
    #[error("an image of {width} x {height}")]
    TooLarge {
        /// Width in texels that the header claims.
        width: u64,
        /// Height in texels that the header claims.
        height: u64,
    },
    /// The header claims more texels than a file of this length can hold.
    #[error(
        "its header says {width} x {height} texels, for which a file of this kind has {} at least, and it has {}",
        memory::display(*shortest), memory::display(*length)
    )]
    Cut {
        /// Width in texels that the header claims.
        width: u64,
        /// Height in texels that the header claims.
        height: u64,
        /// Bytes of the shortest file with as many texels.
        shortest: u64,
        /// Bytes of the file.
        length: u64,
    },
}

/// Image for a texture whose header was checked and whose texels are still encoded.
pub struct TextureDecoder<'a> {
    decoder: Box<dyn ImageDecoder + 'a>,
}

impl<'a> TextureDecoder<'a> {
    /// Reads the header of a PNG or JPEG file, recognised by its first bytes.
    ///
    /// # Errors
    ///
    /// [`TextureError`], before memory is allocated for texels that the file cannot hold.
    pub fn new(bytes: &'a [u8]) -> Result<Self, TextureError> {
        if let Some((_, format)) = CONTAINERS.iter().find(|(magic, _)| bytes.starts_with(magic)) {
            return Err(TextureError::Container(format));
        }
        let format = match image::guess_format(bytes) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
            Ok(other) => return Err(TextureError::Format(format!("{other:?}"))),
            Err(_) => return Err(TextureError::NoImage),
        };
        let length = bytes.len() as u64;
        // Before the decoder allocates rows of this width.
        let mut largest = u64::MAX;
        if let Some((width, height, shortest)) = bounds::png(bytes).filter(|_| format == ImageFormat::Png) {
            check((width, height), shortest, length)?;
            largest = needed(width, height).saturating_add(bounds::MAX_CHUNK);
        }
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::default();
        limits.max_alloc = Some((memory::available() / 2).min(largest));
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(codec)?;
        let (width, height) = decoder.dimensions();
        if width == 0 || height == 0 {
            return Err(TextureError::Empty);
        }
        let (wide, high) = (u64::from(width), u64::from(height));
        // The PNG header was checked above.
        let shortest = if format == ImageFormat::Jpeg { bounds::shortest_jpeg(wide, high) } else { 0 };
        check((wide, high), shortest, length)?;
        Ok(Self { decoder: Box::new(decoder) })
    }

    /// Returns the bytes of memory that [`decode`](Self::decode) takes: texels as decoded, as 8-bit
    /// RGBA, and those that are returned.
    pub fn memory(&self) -> u64 {
        let (width, height) = self.decoder.dimensions();
        self.decoder.total_bytes().saturating_add(8 * u64::from(width) * u64::from(height))
    }

    /// Decodes the texels.
    ///
    /// # Errors
    ///
    /// [`TextureError::Codec`].
    pub fn decode(self) -> Result<Rgba8, TextureError> {
        let rgba = DynamicImage::from_decoder(self.decoder).map_err(codec)?.into_rgba8();
        let (width, height) = rgba.dimensions();
        Ok(Rgba8 { width, height, texels: rgba.as_raw().as_chunks().0.to_vec() })
    }
}

fn codec(error: image::ImageError) -> TextureError {
    TextureError::Codec(error.to_string())
}

/// Refuses a header that claims a side above [`MAX_SIDE`], or more texels than `length` bytes hold.
fn check((width, height): (u64, u64), shortest: u64, length: u64) -> Result<(), TextureError> {
    if width.max(height) > u64::from(MAX_SIDE) {
        return Err(TextureError::TooLarge { width, height });
    }
    let demand = Demand { width, height, shortest, needed: needed(width, height) };
    if demand.is_cut(length) {
        return Err(TextureError::Cut { width, height, shortest, length });
    }
    Ok(())
}

/// Returns the minimum bytes of memory that decoding takes: one for each texel as decoded, four as
/// RGBA, and four as the texels that are kept.
fn needed(width: u64, height: u64) -> u64 {
    width.saturating_mul(height).saturating_mul(9)
}
