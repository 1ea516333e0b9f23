//! Thumbnails of images and of their errors, for the report page.

use super::point::Point;
use super::reference::Truth;
use super::reference::view;
use crate::Error;
use trisect::image::Image;
use trisect::metrics::srgb;

/// Maximum width in pixels.
const WIDTH: u32 = 360;

/// Relative difference that is shown with the brightest colour.
const BRIGHTEST: f64 = 0.5;

/// Colours of errors from 0 to 1, evenly spaced in lightness: matplotlib's "inferno" (N. Smith and
/// S. van der Walt, 2015; CC0), sampled at ninths.
const INFERNO: [[u8; 3]; 10] = [
    [0, 0, 4],
    [27, 12, 65],
    [74, 12, 107],
    [120, 28, 109],
    [165, 44, 96],
    [207, 68, 70],
    [237, 105, 37],
    [251, 155, 6],
    [247, 209, 61],
    [252, 255, 164],
];

/// A small image with three bytes (RGB) per pixel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Thumbnail {
    pub width: u32,
    pub height: u32,
    pub bytes: Vec<u8>,
}

/// Thumbnails of an image, of its relative difference from the reference, and of its FLIP errors.
pub(super) struct Picture {
    pub image: Thumbnail,
    pub difference: Thumbnail,
    pub flip: Thumbnail,
}

/// Thumbnails on a report page.
#[derive(Default)]
pub struct Pictures {
    /// Reference image; `None` without a reference.
    pub(super) reference: Option<Thumbnail>,
    pub(super) shown: Vec<(String, u32, Picture)>,
}

impl Pictures {
    pub(super) fn new(truth: &Truth) -> Self {
        Self { reference: Some(shown(truth.image)), shown: Vec::new() }
    }

    pub(super) fn add(&mut self, point: &Point, picture: Picture) {
        self.shown.push((point.name(), point.spp, picture));
    }
}

impl Picture {
    pub(super) fn of(image: &Image, truth: &Truth) -> Result<Self, Error> {
        let r = truth.image;
        let errors = truth.seen.flip(&view(image))?.errors;
        let relative = |pixel: usize| {
            let (x, r) = (image.pixels[pixel], r.pixels[pixel]);
            let of = |c: usize| {
                let (x, r) = (f64::from(x[c]), f64::from(r[c]));
                (x - r).abs() / (r * r + 0.01).sqrt()
            };
            (0..3).map(of).sum::<f64>() / 3.0 / BRIGHTEST
        };
        let (width, height) = (image.width, image.height);
        Ok(Self {
            image: shown(image),
            difference: map(width, height, relative),
            flip: map(width, height, |pixel| f64::from(errors[pixel])),
        })
    }
}

/// Returns a thumbnail of an image, encoded as sRGB.
fn shown(image: &Image) -> Thumbnail {
    small(
        image.width,
        image.height,
        |pixel| image.pixels[pixel].map(f64::from),
        |mean| mean.map(|value| srgb::encode_u8(value as f32)),
    )
}

/// Returns a thumbnail of errors from 0 to 1, as colours.
fn map(width: u32, height: u32, error: impl Fn(usize) -> f64) -> Thumbnail {
    small(width, height, |pixel| [error(pixel); 3], |mean| colour(mean[0]))
}

fn colour(error: f64) -> [u8; 3] {
    let place = if error.is_nan() { 9.0 } else { error.clamp(0.0, 1.0) * 9.0 };
    let below = (place.floor() as usize).min(8);
    let share = place - below as f64;
    let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
    std::array::from_fn(|c| mix(INFERNO[below][c], INFERNO[below + 1][c]))
}

/// Returns a thumbnail whose pixels are means over squares of pixels.
fn small(
    width: u32,
    height: u32,
    value: impl Fn(usize) -> [f64; 3],
    encode: impl Fn([f64; 3]) -> [u8; 3],
) -> Thumbnail {
    let step = width.div_ceil(WIDTH).max(1);
    let (across, down) = (width.div_ceil(step), height.div_ceil(step));
    let mut bytes = Vec::with_capacity(across as usize * down as usize * 3);
    for y in 0..down {
        for x in 0..across {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for row in y * step..((y + 1) * step).min(height) {
                for column in x * step..((x + 1) * step).min(width) {
                    let pixel = value(row as usize * width as usize + column as usize);
                    (0..3).for_each(|c| sum[c] += pixel[c]);
                    count += 1.0;
                }
            }
            bytes.extend(encode(sum.map(|sum| sum / count)));
        }
    }
    Thumbnail { width: across, height: down, bytes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_errors() {
        assert_eq!(colour(0.0), INFERNO[0]);
        assert_eq!(colour(1.0), INFERNO[9]);
        assert_eq!(colour(f64::NAN), INFERNO[9]);
        assert_eq!(colour(0.5), [186, 56, 83]);
    }

    #[test]
    fn large_images_become_small() {
        let image = Image { width: 1000, height: 3, pixels: vec![[1.0, 0.0, 0.0]; 3000] };
        let small = shown(&image);
        assert_eq!((small.width, small.height), (334, 1));
        assert!(small.bytes.chunks(3).all(|pixel| pixel == [255, 0, 0]));
    }
}
