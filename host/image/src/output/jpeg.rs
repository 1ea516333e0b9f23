//! JPEG files.

use super::encoding::samples_8;
use super::{Encoding, Picture};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

/// Quality of the compression, 1 to 100: above it files grow faster than differences shrink.
const QUALITY: u8 = 95;

/// Maximum bytes of a comment, whose length has 16 bits and counts itself.
const MAX_COMMENT: usize = u16::MAX as usize - 2;

/// Returns the bytes of a file with full resolution of colour, and the metadata as a comment.
pub fn encode(picture: &Picture, encoding: &Encoding) -> Result<Vec<u8>, String> {
    let image = picture.image;
    let samples = samples_8(&image.pixels, None, encoding.transfer);
    let mut file = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut file, QUALITY);
    let written = encoder.encode(&samples, image.width, image.height, ExtendedColorType::Rgb8);
    written.map_err(|error| error.to_string())?;
    Ok(with_comment(file, &encoding.metadata.lines()))
}

/// Inserts a comment behind the first segment, which must be that of JFIF.
fn with_comment(mut file: Vec<u8>, comment: &str) -> Vec<u8> {
    let mut end = comment.len().min(MAX_COMMENT);
    while !comment.is_char_boundary(end) {
        end -= 1;
    }
    let comment = &comment.as_bytes()[..end];
    // Start of image (2 bytes), marker of JFIF (2), then the length without the marker.
    let length = file.get(4..6).and_then(|bytes| bytes.first_chunk()).copied().map(u16::from_be_bytes);
    let place = length.map(|length| 4 + usize::from(length)).filter(|place| *place <= file.len());
    if let Some(place) = place.filter(|_| !comment.is_empty()) {
        let length = (comment.len() as u16 + 2).to_be_bytes();
        let segment = [&[0xff, 0xfe], &length[..], comment].concat();
        file.splice(place..place, segment);
    }
    file
}
