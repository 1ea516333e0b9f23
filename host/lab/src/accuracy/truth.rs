//! Prepares reference images for the comparison with many others.

use rayon::prelude::*;
use trisect::image::Image;
use trisect::metrics::flip::{DEFAULT_PIXELS_PER_DEGREE, FlipReference};
use trisect::metrics::{ImageView, MetricsError};

/// Number of pixels above which FLIP is computed for fewer repetitions.
const LARGE: u64 = 200_000;

/// A reference, with data derived from it once for the comparison with many images.
pub struct Truth<'a> {
    /// Two images of disjoint samples, or the same image twice if its noise is unknown.
    pub halves: [&'a Image; 2],
    /// Variance of the mean of both halves, by pixel and channel; 0 if it is unknown.
    pub variance: &'a [[f32; 3]],
    /// Mean of both halves.
    pub image: &'a Image,
    /// Independent images whose mean the reference is; empty if there are none. The tests of block
    /// means take the noise of the reference from them, so that they hold even if the noise of
    /// neighbouring pixels is not independent.
    pub repetitions: &'a [Image],
    /// The mean image as prepared for FLIP.
    pub seen: FlipReference<'a>,
}

impl<'a> Truth<'a> {
    /// Prepares two halves, with the variance of their mean, that mean, and the
    /// [repetitions](Self::repetitions) that they were made of.
    ///
    /// # Errors
    ///
    /// [`MetricsError`] for an image without pixels.
    pub fn of_halves(
        halves: [&'a Image; 2],
        variance: &'a [[f32; 3]],
        image: &'a Image,
        repetitions: &'a [Image],
    ) -> Result<Self, MetricsError> {
        let seen = FlipReference::new(&view(image), DEFAULT_PIXELS_PER_DEGREE)?;
        Ok(Self { halves, variance, image, repetitions, seen })
    }
}

/// Returns the number of repetitions for which FLIP is computed.
pub(crate) fn flips_of(pixels: u64, seeds: usize) -> usize {
    if pixels > LARGE { 2 } else { 4.min(seeds) }
}

/// Returns the mean of two images of one size.
pub(crate) fn mean_of(a: &Image, b: &Image) -> Image {
    let pixels = a.pixels.par_iter().zip(&b.pixels);
    let pixels = pixels.map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
    Image { width: a.width, height: a.height, pixels }
}

/// Returns an image as FLIP reads it.
pub(crate) fn view(image: &Image) -> ImageView<'_> {
    ImageView { width: image.width as usize, height: image.height as usize, pixels: &image.pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_images_have_fewer_flips() {
        assert_eq!((flips_of(LARGE, 8), flips_of(LARGE + 1, 8), flips_of(1, 2)), (4, 2, 2));
    }
}
