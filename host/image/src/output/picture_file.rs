//! Encoding of a picture in the format of its file.

use super::{Encoding, Format, Picture, exr, jpeg, pfm, png, tiff, write_file};
use crate::{Image, ImageError};
use image::Rgb;
use image::codecs::hdr::HdrEncoder;
use std::path::Path;

impl Picture<'_> {
    /// Writes the file in the format that the extension names, and replaces an earlier file as
    /// [`write_file`] does.
    ///
    /// # Errors
    ///
    /// * [`ImageError::UnknownExtension`]
    /// * [`ImageError::NoAlpha`], [`ImageError::NoLayers`] and the errors of [`Encoding::check`]
    ///   for a format that cannot hold the picture
    /// * [`ImageError::Codec`] if pixels, alpha or channels do not fill the image
    /// * [`ImageError::Io`] if the file cannot be written
    pub fn write(self, path: &Path, encoding: &Encoding) -> Result<(), ImageError> {
        let bytes = self.encode(path, encoding)?;
        write_file(path, &bytes)
    }

    /// Returns the bytes of the file that [`write`](Self::write) writes.
    ///
    /// # Errors
    ///
    /// Those of [`write`](Self::write).
    pub fn encode(self, path: &Path, encoding: &Encoding) -> Result<Vec<u8>, ImageError> {
        let format = Format::of(path)?;
        encoding.check(path)?;
        if self.alpha.is_some() && !format.has_alpha() {
            return Err(ImageError::NoAlpha { path: path.to_owned() });
        }
        if !self.layers.is_empty() && format != Format::Exr {
            return Err(ImageError::NoLayers { path: path.to_owned() });
        }
        let bytes = self.encode_format(format, encoding);
        bytes.map_err(|message| ImageError::Codec { path: path.to_owned(), message })
    }

    fn encode_format(self, format: Format, encoding: &Encoding) -> Result<Vec<u8>, String> {
        let Image { width, height, ref pixels } = *self.image;
        let count = width as usize * height as usize;
        if pixels.len() != count || self.alpha.is_some_and(|alpha| alpha.len() != count) {
            return Err("the pixels do not fill the image".to_owned());
        }
        match format {
            Format::Png => png::encode(&self, encoding),
            Format::Jpeg => jpeg::encode(&self, encoding),
            Format::Tiff => tiff::encode(&self, encoding),
            Format::Exr => exr::encode(self, encoding),
            Format::Pfm => Ok(pfm::encode(self.image)),
            Format::Hdr => {
                let finite = |channel: f32| if channel.is_finite() { channel } else { 0.0 };
                let samples: Vec<Rgb<f32>> = pixels.iter().map(|pixel| Rgb(pixel.map(finite))).collect();
                let mut bytes = Vec::new();
                let encoder = HdrEncoder::new(&mut bytes);
                encoder.encode(&samples, width as usize, height as usize).map_err(|e| e.to_string())?;
                Ok(bytes)
            }
        }
    }
}
