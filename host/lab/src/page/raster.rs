//! Images of a page: made smaller, encoded for a display, and embedded as PNG.

use super::{Ramp, escape};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rayon::prelude::*;
use trisect::image::Image;
use trisect::metrics::srgb;
use trisect::output::encode_bytes;

/// Image with three bytes (sRGB) per pixel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raster {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green and blue of each pixel, row by row from the top.
    pub bytes: Vec<u8>,
}

/// Edges, in pixels of an image, of the squares that become one pixel each.
pub(crate) fn reduction((width, height): (u32, u32), max_edge: u32) -> u32 {
    width.max(height).div_ceil(max_edge.max(1)).max(1)
}

impl Raster {
    /// Returns an image whose radiance is multiplied by `factor`, encoded as sRGB. Each pixel is
    /// the mean of a square with edges of `step` pixels.
    pub fn of_image(image: &Image, step: u32, factor: f32) -> Self {
        let mean = |square: &[usize]| {
            let mut sum = [0.0; 3];
            for &pixel in square {
                (0..3).for_each(|c| sum[c] += f64::from(image.pixels[pixel][c]));
            }
            sum.map(|sum| srgb::encode_u8((sum / square.len() as f64) as f32 * factor))
        };
        Self::reduced((image.width, image.height), step, mean)
    }

    /// Returns the colours of values. Each pixel has the colour of the mean of a square with edges
    /// of `step` pixels.
    pub fn of_values(size: (u32, u32), step: u32, ramp: Ramp, value: impl Fn(usize) -> f64 + Sync) -> Self {
        Self::reduced(size, step, |square| {
            ramp.color(square.iter().map(|&pixel| value(pixel)).sum::<f64>() / square.len() as f64)
        })
    }

    /// Returns an image with a pixel for each square with edges of `step` pixels. `color` gets the
    /// indices of the pixels of a square.
    pub fn reduced(
        (width, height): (u32, u32),
        step: u32,
        color: impl Fn(&[usize]) -> [u8; 3] + Sync,
    ) -> Self {
        let (across, down) = (width.div_ceil(step), height.div_ceil(step));
        let row = |y: u32| {
            let mut bytes = Vec::with_capacity(3 * across as usize);
            let mut square = Vec::with_capacity((step * step) as usize);
            for x in 0..across {
                square.clear();
                for row in y * step..((y + 1) * step).min(height) {
                    let first = row as usize * width as usize;
                    let columns = x * step..((x + 1) * step).min(width);
                    square.extend(columns.map(|column| first + column as usize));
                }
                bytes.extend(color(&square));
            }
            bytes
        };
        let rows: Vec<Vec<u8>> = (0..down).into_par_iter().map(row).collect();
        Self { width: across, height: down, bytes: rows.concat() }
    }

    /// Returns the image as a data URI of a PNG file.
    ///
    /// # Errors
    ///
    /// A message of the encoder.
    pub fn data_uri(&self) -> Result<String, String> {
        let bytes = encode_bytes(self.width, self.height, &self.bytes)?;
        Ok(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
    }

    /// Returns an `img` element with this text in place of the image.
    ///
    /// # Errors
    ///
    /// A message of the encoder.
    pub fn img(&self, alt: &str) -> Result<String, String> {
        Ok(element(&self.data_uri()?, (self.width, self.height), alt, ""))
    }
}

/// Returns an `img` element. `more` are further attributes.
pub(super) fn element(uri: &str, (width, height): (u32, u32), alt: &str, more: &str) -> String {
    let alt = escape(alt);
    format!("<img{more} src=\"{uri}\" width=\"{width}\" height=\"{height}\" alt=\"{alt}\">")
}

#[cfg(test)]
mod tests {
    use super::super::{INFERNO, NOT_FINITE};
    use super::*;

    #[test]
    fn large_images_become_small() {
        let image = Image { width: 1000, height: 3, pixels: vec![[1.0, 0.0, 0.0]; 3000] };
        assert_eq!(reduction((1000, 3), 360), 3);
        let small = Raster::of_image(&image, 3, 1.0);
        assert_eq!((small.width, small.height), (334, 1));
        assert!(small.bytes.chunks(3).all(|pixel| pixel == [255, 0, 0]));
        assert_eq!((reduction((10, 360), 360), reduction((0, 0), 360)), (1, 1));
    }

    /// Means are taken of light, not of its encoding: half white is code 188.
    #[test]
    fn means_of_light() {
        let image = Image { width: 2, height: 1, pixels: vec![[1.0; 3], [0.0; 3]] };
        assert_eq!(Raster::of_image(&image, 2, 1.0).bytes, [188; 3]);
        assert_eq!(Raster::of_image(&image, 1, 0.5).bytes, [188, 188, 188, 0, 0, 0]);
        let values = [0.0, f64::NAN];
        assert_eq!(Raster::of_values((2, 1), 1, INFERNO, |pixel| values[pixel]).bytes[3..], NOT_FINITE);
    }

    #[test]
    fn embedded_images_have_alternatives() {
        let image = Raster { width: 1, height: 1, bytes: vec![1, 2, 3] };
        let html = image.img("a \"b\"").unwrap_or_default();
        assert!(html.starts_with("<img src=\"data:image/png;base64,iVBOR"), "{html}");
        assert!(html.ends_with("width=\"1\" height=\"1\" alt=\"a &quot;b&quot;\">"), "{html}");
        assert!(Raster { width: 2, ..image }.img("").is_err());
    }
}
