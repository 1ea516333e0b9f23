//! PNG files.

use super::encoding::{samples_8, samples_16};
use super::{BitDepth, Encoding, Metadata, Picture, Transfer};
use crate::ImageError;
use image::ExtendedColorType;
use png::{ColorType, Compression, Encoder, Filter, Info, ScaledFloat, SrgbRenderingIntent, Writer};
use std::path::Path;

/// Returns the bytes of a file with the samples, colour space and text that `encoding` chooses.
pub fn encode(picture: &Picture, encoding: &Encoding) -> Result<Vec<u8>, String> {
    let (width, height) = (picture.image.width, picture.image.height);
    let colors = if picture.alpha.is_some() { ColorType::Rgba } else { ColorType::Rgb };
    let (pixels, alpha) = (&picture.image.pixels, picture.alpha);
    let (bits, data) = match encoding.bits {
        BitDepth::Eight => (png::BitDepth::Eight, samples_8(pixels, alpha, encoding.transfer)),
        BitDepth::Sixteen => {
            let samples = samples_16(pixels, alpha, encoding.transfer);
            (png::BitDepth::Sixteen, samples.into_iter().flat_map(u16::to_be_bytes).collect())
        }
    };
    encode_samples((width, height), (colors, bits), encoding, &data).map_err(|error| error.to_string())
}

/// Returns the bytes of a file from sRGB bytes, three per pixel.
///
/// # Errors
///
/// A message if the bytes do not fill the image, or it is empty.
pub fn encode_bytes(width: u32, height: u32, bytes: &[u8]) -> Result<Vec<u8>, String> {
    encode_bytes_with((width, height), bytes, &Metadata::default())
}

/// Returns the bytes of a file as [`encode_bytes`] does, with the text of `metadata`.
///
/// # Errors
///
/// Those of [`encode_bytes`].
pub(super) fn encode_bytes_with(
    (width, height): (u32, u32),
    bytes: &[u8],
    metadata: &Metadata,
) -> Result<Vec<u8>, String> {
    let encoding = Encoding { metadata: metadata.clone(), ..Encoding::default() };
    let kind = (ColorType::Rgb, png::BitDepth::Eight);
    encode_samples((width, height), kind, &encoding, bytes).map_err(|error| error.to_string())
}

/// Returns the bytes of a file with these samples; those of 16 bits are big-endian.
fn encode_samples(
    (width, height): (u32, u32),
    (colors, bits): (ColorType, png::BitDepth),
    encoding: &Encoding,
    data: &[u8],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = Encoder::with_info(&mut file, Info::with_size(width, height))?;
    encoder.set_color(colors);
    encoder.set_depth(bits);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    match encoding.transfer {
        Transfer::Srgb => encoder.set_source_srgb(SrgbRenderingIntent::Perceptual),
        Transfer::Gamma(gamma) => encoder.set_source_gamma(ScaledFloat::new(1.0 / gamma)),
    }
    let metadata = &encoding.metadata;
    let software = metadata.software.iter().map(|software| ("Software", software));
    for (name, value) in software.chain(metadata.entries.iter().map(|(name, value)| (*name, value))) {
        // tEXt chunks are Latin-1, iTXt chunks UTF-8.
        match value.is_ascii() {
            true => encoder.add_text_chunk(name.to_owned(), value.clone())?,
            false => encoder.add_itxt_chunk(name.to_owned(), value.clone())?,
        }
    }
    let mut writer: Writer<_> = encoder.write_header()?;
    writer.write_image_data(data)?;
    writer.finish()?;
    Ok(file)
}

/// Writes a file from RGBA pixels with 8 bits for each channel, red in the lowest byte. The file is
/// written in place: a series of frames need not survive a power failure.
///
/// # Errors
///
/// [`ImageError::Codec`] if the pixels do not fill the image, [`ImageError::Io`] if the file cannot
/// be written.
pub fn write_rgba(width: u32, height: u32, pixels: &[u32], path: &Path) -> Result<(), ImageError> {
    let bytes: Vec<u8> = pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect();
    let format = image::ImageFormat::Png;
    image::save_buffer_with_format(path, &bytes, width, height, ExtendedColorType::Rgba8, format).map_err(
        |error| match error {
            image::ImageError::IoError(source) => ImageError::Io { path: path.to_owned(), source },
            other => ImageError::Codec { path: path.to_owned(), message: other.to_string() },
        },
    )
}
