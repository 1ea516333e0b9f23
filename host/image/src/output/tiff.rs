//! TIFF files.

use super::encoding::{samples_8, samples_16};
use super::{BitDepth, Encoding, Picture};
use std::io::Cursor;
use tiff::encoder::colortype::{ColorType, RGB8, RGB16};
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, Predictor, TiffEncoder, TiffValue};
use tiff::tags::{ExtraSamples, Tag};

/// Returns the bytes of a file, compressed by deflate with differences of neighbours, and the
/// metadata as its description.
pub fn encode(picture: &Picture, encoding: &Encoding) -> Result<Vec<u8>, String> {
    let (pixels, alpha) = (&picture.image.pixels, picture.alpha);
    let written = match encoding.bits {
        BitDepth::Eight => write::<RGB8>(picture, encoding, &samples_8(pixels, alpha, encoding.transfer)),
        BitDepth::Sixteen => write::<RGB16>(picture, encoding, &samples_16(pixels, alpha, encoding.transfer)),
    };
    written.map_err(|error| error.to_string())
}

fn write<C: ColorType>(
    picture: &Picture,
    encoding: &Encoding,
    samples: &[C::Inner],
) -> tiff::TiffResult<Vec<u8>>
where
    [C::Inner]: TiffValue,
{
    let mut file = Cursor::new(Vec::new());
    // Predictors of this encoder know three channels only.
    let predictor = if picture.alpha.is_some() { Predictor::None } else { Predictor::Horizontal };
    let mut encoder = TiffEncoder::new(&mut file)?
        .with_compression(Compression::Deflate(DeflateLevel::Fast))
        .with_predictor(predictor);
    let mut image = encoder.new_image::<C>(picture.image.width, picture.image.height)?;
    if picture.alpha.is_some() {
        image.extra_samples(&[ExtraSamples::UnassociatedAlpha])?;
    }
    if let Some(software) = &encoding.metadata.software {
        image.encoder().write_tag(Tag::Software, ascii(software).as_str())?;
    }
    if !encoding.metadata.entries.is_empty() {
        let text = ascii(&encoding.metadata.lines());
        image.encoder().write_tag(Tag::ImageDescription, text.as_str())?;
    }
    image.write_data(samples)?;
    Ok(file.into_inner())
}

/// Returns text with a question mark for what TIFF's text cannot hold.
fn ascii(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii() && c != '\0' { c } else { '?' }).collect()
}
