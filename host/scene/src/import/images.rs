//! Images for textures: PNG, JPEG, WebP and KTX2.

use super::budget::fits;
use super::source_location::{SourceLocation, shown};
use crate::description::{Texels, TextureImage};
use crate::error::SceneError;
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;
use trisect_image::texture::{MAX_SIDE, Rgba8, TextureDecoder, TextureError};

/// Transfer function of an image's numbers. The image file's own statement of it is ignored, as
/// glTF requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Curve {
    Srgb,
    Linear,
}

/// The images that have been read, each once for each transfer function.
#[derive(Debug, Default)]
pub(super) struct Images {
    pub all: Vec<Arc<TextureImage>>,
    index: HashMap<(String, Curve), usize>,
}

impl Images {
    /// Returns the index of the image `key` with `curve`. An image that is not there yet is decoded
    /// from the bytes of `read`.
    pub fn get<'a>(
        &mut self,
        key: &str,
        curve: Curve,
        site: &SourceLocation,
        read: impl FnOnce() -> Result<Cow<'a, [u8]>, SceneError>,
    ) -> Result<usize, SceneError> {
        if let Some(&index) = self.index.get(&(key.to_owned(), curve)) {
            return Ok(index);
        }
        let other = if curve == Curve::Srgb { Curve::Linear } else { Curve::Srgb };
        let other = self.index.get(&(key.to_owned(), other)).and_then(|&index| self.all.get(index));
        let image = match other.map(Arc::as_ref) {
            Some(TextureImage {
                name,
                width,
                height,
                texels: Texels::Srgb8(texels) | Texels::Linear8(texels),
            }) => {
                fits(4 * texels.len() as u64, site)?;
                let (name, texels) = (name.clone(), curve.texels(texels.clone()));
                TextureImage { name, width: *width, height: *height, texels }
            }
            _ => decode(&read()?, curve, key, site)?,
        };
        self.all.push(Arc::new(image));
        self.index.insert((key.to_owned(), curve), self.all.len() - 1);
        Ok(self.all.len() - 1)
    }
}

impl Curve {
    fn texels(self, texels: Vec<[u8; 4]>) -> Texels {
        match self {
            Self::Srgb => Texels::Srgb8(texels),
            Self::Linear => Texels::Linear8(texels),
        }
    }
}

/// Decodes a PNG, JPEG, WebP or KTX2 file, recognised by its first bytes, to 8 bits per channel.
pub(super) fn decode(
    bytes: &[u8],
    curve: Curve,
    name: &str,
    site: &SourceLocation,
) -> Result<TextureImage, SceneError> {
    let decoder = TextureDecoder::new(bytes).map_err(|error| refused(error, site))?;
    fits(decoder.memory(), site)?;
    let Rgba8 { width, height, texels } = decoder.decode().map_err(|error| refused(error, site))?;
    Ok(TextureImage { name: shown(name), width, height, texels: curve.texels(texels) })
}

/// Returns the error of a scene for that of an image.
fn refused(error: TextureError, site: &SourceLocation) -> SceneError {
    let message = error.to_string();
    match error {
        TextureError::Container(_) => site.unsupported(
            message,
            "convert it to PNG or JPEG (`ktx extract`; for all textures of a glTF file `gltf-transform ktxdecompress`)",
        ),
        TextureError::Format(_) => site.unsupported(message, "convert it to PNG or JPEG"),
        TextureError::NoImage => site.malformed(message, "it must be PNG, JPEG, WebP or KTX2"),
        TextureError::Codec(reason) => {
            site.malformed(format!("the image cannot be decoded: {}", shown(&reason)), "write it again")
        }
        TextureError::Empty => site.malformed(message, "write it again"),
        TextureError::TooLarge { .. } => site.too_large(message, format!("{MAX_SIDE} x {MAX_SIDE} texels")),
        TextureError::Cut { .. } => {
            site.malformed(message, "it is cut off, or its header is wrong: write it again")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::testing::png;

    #[test]
    fn an_image_used_both_ways_is_decoded_once_and_kept_twice() {
        let mut images = Images::default();
        let site = SourceLocation::new("test", "images[0]");
        let file = png(2, 1, &[[1, 2, 3, 255], [4, 5, 6, 128]]);
        let read = || Ok(Cow::Borrowed(&file[..]));
        assert_eq!(images.get("a", Curve::Srgb, &site, read).unwrap(), 0);
        assert_eq!(images.get("a", Curve::Srgb, &site, || unreachable!()).unwrap(), 0);
        assert_eq!(images.get("a", Curve::Linear, &site, || unreachable!()).unwrap(), 1);
        assert!(matches!(&images.all[0].texels, Texels::Srgb8(texels) if texels[1] == [4, 5, 6, 128]));
        assert!(matches!(&images.all[1].texels, Texels::Linear8(texels) if texels[0] == [1, 2, 3, 255]));
        assert_eq!((images.all[1].width, images.all[1].height), (2, 1));
    }

    #[test]
    fn jpeg_images_are_opaque() {
        let mut file = Vec::new();
        let grey = image::GrayImage::from_pixel(3, 2, image::Luma([100]));
        grey.write_with_encoder(image::codecs::jpeg::JpegEncoder::new(&mut file)).unwrap();
        let image = decode(&file, Curve::Linear, "a", &SourceLocation::new("test", "images[0]")).unwrap();
        let Texels::Linear8(texels) = image.texels else { panic!() };
        assert_eq!((image.width, image.height, texels.len()), (3, 2, 6));
        assert!(texels[0][0].abs_diff(100) < 3 && texels[0][3] == 255);
    }

    #[test]
    fn unusable_images_are_errors() {
        let site = SourceLocation::new("test", "images[0]");
        let error = |bytes: &[u8]| decode(bytes, Curve::Srgb, "a", &site).unwrap_err();
        assert!(matches!(error(b""), SceneError::Malformed { .. }));
        assert!(matches!(error(b"GIF89a"), SceneError::Unsupported { .. }));
        for (bytes, format) in [(&b"\xabKTX 11\xbb\r\n\x1a\n\0"[..], "KTX"), (b"DDS \x7c\0", "Dds")] {
            let message = error(bytes).to_string();
            assert!(
                message.contains(&format!(
                    "{format}, the format of this image, is not supported; convert it to PNG"
                )),
                "{message}"
            );
        }
        for cut in [&b"\xabKTX 20\xbb\r\n\x1a\n\0"[..], b"RIFF\x10\0\0\0WEBPVP8 "] {
            assert!(matches!(error(cut), SceneError::Malformed { .. }));
        }
        let file = png(2, 1, &[[1, 2, 3, 255], [4, 5, 6, 128]]);
        assert!(matches!(error(&file[..file.len() / 2]), SceneError::Malformed { .. }));
        let large = [&file[..16], &[0, 0, 0x40, 0, 0, 0, 0x40, 0], &file[24..]].concat();
        let refused = error(&large).to_string();
        assert!(refused.contains("16384 x 16384") && refused.contains("cut off"), "{refused}");
        let mut wide = file.clone();
        wide[16..20].copy_from_slice(&20000u32.to_be_bytes()); // width in the header, before its checksum
        let checksum = crate::import::testing::crc32(&wide[12..29]);
        wide[29..33].copy_from_slice(&checksum.to_be_bytes());
        let error = error(&wide).to_string();
        assert_eq!(error, "test: images[0]: an image of 20000 x 1; the maximum is 16384 x 16384 texels");
    }
}
