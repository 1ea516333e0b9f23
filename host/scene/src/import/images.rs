//! Images for textures: PNG and JPEG.

use super::budget::fits;
use super::source_location::{SourceLocation, shown};
use crate::description::{Texels, TextureImage};
use crate::error::SceneError;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Cursor;
use trisect_image::bounds::{self, Demand};
use trisect_system::memory;

/// Maximum width and height in texels.
const MAX_SIDE: u32 = 16384;

/// First bytes and names of texture containers for GPUs, which are not supported.
const CONTAINERS: [(&[u8], &str); 2] =
    [(b"\xabKTX 20\xbb\r\n\x1a\n", "KTX2"), (b"\xabKTX 11\xbb\r\n\x1a\n", "KTX")];

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
    pub all: Vec<TextureImage>,
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
        let image = match self.index.get(&(key.to_owned(), other)).and_then(|&index| self.all.get(index)) {
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
        self.all.push(image);
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

/// Decodes a PNG or JPEG file, recognised by its first bytes, to 8 bits per channel.
pub(super) fn decode(
    bytes: &[u8],
    curve: Curve,
    name: &str,
    site: &SourceLocation,
) -> Result<TextureImage, SceneError> {
    if let Some((_, format)) = CONTAINERS.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        let remedy = "convert it to PNG or JPEG (`ktx extract`; for all textures of a glTF file `gltf-transform ktxdecompress`)";
        return Err(site.unsupported(format!("{format}, the format of this image,"), remedy));
    }
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
        Ok(other) => {
            return Err(site
                .unsupported(format!("{other:?}, the format of this image,"), "convert it to PNG or JPEG"));
        }
        Err(_) => return Err(site.malformed("this is not an image", "it must be PNG or JPEG")),
    };
    let broken = |error: image::ImageError| {
        site.malformed(
            format!("the image cannot be decoded: {}", shown(&error.to_string())),
            "write it again",
        )
    };
    let check = |(width, height): (u64, u64), shortest: u64| {
        if width.max(height) > u64::from(MAX_SIDE) {
            let maximum = format!("{MAX_SIDE} x {MAX_SIDE} texels");
            return Err(site.too_large(format!("an image of {width} x {height}"), maximum));
        }
        // At least one byte as decoded, four as RGBA, and four as the texels that are kept.
        let needed = width.saturating_mul(height).saturating_mul(9);
        let (demand, length) = (Demand { width, height, shortest, needed }, bytes.len() as u64);
        if demand.is_cut(length) {
            let (least, length) = (memory::display(shortest), memory::display(length));
            let problem = format!(
                "its header says {width} x {height} texels, for which a file of this kind has {least} at least, and it has {length}"
            );
            return Err(site.malformed(problem, "it is cut off, or its header is wrong: write it again"));
        }
        Ok(())
    };
    // Before the decoder allocates rows of this width.
    let mut largest = u64::MAX;
    if let Some((width, height, shortest)) = bounds::png(bytes).filter(|_| format == ImageFormat::Png) {
        check((width, height), shortest)?;
        largest = width.saturating_mul(height).saturating_mul(9).saturating_add(bounds::MAX_CHUNK);
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some((memory::available() / 2).min(largest));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(site.malformed("the image has no texels", "write it again"));
    }
    let (wide, high) = (u64::from(width), u64::from(height));
    // The PNG header was checked above.
    let shortest = if format == ImageFormat::Jpeg { bounds::shortest_jpeg(wide, high) } else { 0 };
    check((wide, high), shortest)?;
    // As decoded, as 8-bit RGBA, and as the texels that are kept.
    fits(decoder.total_bytes().saturating_add(8 * wide * high), site)?;
    let rgba = DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgba8();
    let texels = rgba.as_raw().as_chunks().0.to_vec();
    Ok(TextureImage { name: shown(name), width, height, texels: curve.texels(texels) })
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
        for (bytes, format) in [
            (&b"\xabKTX 20\xbb\r\n\x1a\n\0"[..], "KTX2"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "WebP"),
            (b"DDS \x7c\0", "Dds"),
        ] {
            let message = error(bytes).to_string();
            assert!(
                message.contains(&format!(
                    "{format}, the format of this image, is not supported; convert it to PNG"
                )),
                "{message}"
            );
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
