//! Decoding of images for textures: PNG, JPEG, WebP, and KTX2 with Basis Universal.

mod error;
mod ktx2;

pub use error::{MAX_SIDE, TextureError};

use crate::bounds::{self, Demand};
use image::codecs::webp::WebPDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use ktx2::Ktx2;
use std::io::Cursor;
use trisect_system::memory;

/// First bytes of a texture container for GPUs that is not supported.
const KTX1: &[u8] = b"\xabKTX 11\xbb\r\n\x1a\n";

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

/// Image for a texture whose header was checked and whose texels are still encoded.
pub struct TextureDecoder<'a> {
    source: Source<'a>,
}

enum Source<'a> {
    Image(Box<dyn ImageDecoder + 'a>),
    Ktx2(Box<Ktx2>),
}

impl<'a> TextureDecoder<'a> {
    /// Reads the header of a PNG, JPEG, WebP or KTX2 file, recognised by its first bytes.
    ///
    /// # Errors
    ///
    /// [`TextureError`], before memory is allocated for texels that the file cannot hold.
    pub fn new(bytes: &'a [u8]) -> Result<Self, TextureError> {
        if bytes.starts_with(ktx2::MAGIC) {
            return Ok(Self { source: Source::Ktx2(Box::new(Ktx2::new(bytes)?)) });
        }
        if bytes.starts_with(KTX1) {
            return Err(TextureError::Container("KTX"));
        }
        let format = match image::guess_format(bytes) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) => format,
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
        if format == ImageFormat::WebP {
            return Self::webp(bytes);
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
        Ok(Self { source: Source::Image(Box::new(decoder)) })
    }

    fn webp(bytes: &'a [u8]) -> Result<Self, TextureError> {
        let decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(codec)?;
        if decoder.has_animation() {
            return Err(TextureError::Format("animated WebP".to_owned()));
        }
        let (width, height) = decoder.dimensions();
        if width == 0 || height == 0 {
            return Err(TextureError::Empty);
        }
        if bounds::webp_image(bytes).is_some_and(|size| size != (width.into(), height.into())) {
            return Err(TextureError::Codec("the image has another size than its canvas".to_owned()));
        }
        // An image of one colour has a few bytes at any size.
        check((width.into(), height.into()), 0, bytes.len() as u64)?;
        Ok(Self { source: Source::Image(Box::new(decoder)) })
    }

    /// Returns the bytes of memory that [`decode`](Self::decode) takes: texels as decoded, with 4
    /// bytes for those that WebP keeps beside them, as 8-bit RGBA, and those that are returned.
    pub fn memory(&self) -> u64 {
        match &self.source {
            Source::Image(decoder) => {
                let (width, height) = decoder.dimensions();
                decoder.total_bytes().saturating_add(12 * u64::from(width) * u64::from(height))
            }
            Source::Ktx2(ktx2) => ktx2.memory(),
        }
    }

    /// Decodes the texels.
    ///
    /// # Errors
    ///
    /// [`TextureError::Codec`].
    pub fn decode(self) -> Result<Rgba8, TextureError> {
        let decoder = match self.source {
            Source::Image(decoder) => decoder,
            Source::Ktx2(ktx2) => {
                let (width, height) = (ktx2.width, ktx2.height);
                return Ok(Rgba8 { width, height, texels: ktx2.transcode()? });
            }
        };
        let rgba = DynamicImage::from_decoder(decoder).map_err(codec)?.into_rgba8();
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
