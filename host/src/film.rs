//! The film: sums in double precision over the chunks that kernels sum in single precision.

use crate::image::Image;
use rayon::prelude::*;
use trisect_shared::film::{Carry, PixelSums};

/// Sums over all samples of one pixel so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelTotals {
    /// Of the radiance, by channel. NaN until the first chunk is merged, so that a pixel no one wrote shows.
    pub radiance: [f64; 3],
    /// Of the squared radiance.
    pub squares: [f64; 3],
    /// Samples in the sums.
    pub samples: u64,
    /// Samples that were NaN or infinite and are not in the sums.
    pub rejected: u64,
    /// Path segments traced.
    pub segments: u64,
    /// Samples that were to be taken and that no kernel wrote; with any, the sums are NaN for good.
    pub unwritten: u64,
}

impl PixelTotals {
    const EMPTY: Self = Self {
        radiance: [f64::NAN; 3],
        squares: [f64::NAN; 3],
        samples: 0,
        rejected: 0,
        segments: 0,
        unwritten: 0,
    };

    /// Mean radiance by channel; NaN without samples.
    pub fn mean(&self) -> [f64; 3] {
        self.radiance.map(|sum| sum / self.samples as f64)
    }

    /// Estimated variance of the mean by channel: the sample variance over n; NaN with fewer than two samples.
    pub fn variance_of_mean(&self) -> [f64; 3] {
        let n = self.samples as f64;
        std::array::from_fn(|c| {
            let mean = self.radiance[c] / n;
            ((self.squares[c] / n - mean * mean) / (n - 1.0)).max(0.0)
        })
    }
}

/// An image's worth of [`PixelTotals`], row-major, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` totals.
    pub pixels: Vec<PixelTotals>,
}

/// Counts over a whole film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmCounts {
    /// Samples in the sums.
    pub samples: u64,
    /// NaN or infinite samples, left out.
    pub rejected: u64,
    /// Path segments traced.
    pub segments: u64,
    /// Pixels that miss samples which no kernel wrote.
    pub unwritten: u64,
}

impl Film {
    /// Bytes that one pixel takes on the host: its totals, a chunk on the CPU backend with its carry and one read back, the picture, and two
    /// copies of it while it is encoded.
    pub const BYTES_PER_PIXEL: u64 =
        (size_of::<PixelTotals>() + 2 * size_of::<PixelSums>() + size_of::<Carry>() + 3 * 12) as u64;

    /// A film that no one has written.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        // In parallel: the first touch of fresh memory is what takes the time.
        let pixels = rayon::iter::repeat_n(PixelTotals::EMPTY, pixels).with_min_len(4096).collect();
        Self { width, height, pixels }
    }

    /// Adds a chunk, in which each pixel should hold `samples` samples. Chunks must come in the order of their indices.
    ///
    /// A pixel that no kernel wrote in this chunk becomes NaN and stays so.
    pub fn merge(&mut self, chunk: &[PixelSums], samples: u32) {
        self.pixels.par_iter_mut().zip(chunk).with_min_len(4096).for_each(|(total, sums)| {
            if sums.samples > samples {
                total.radiance = [f64::NAN; 3];
                total.squares = [f64::NAN; 3];
                total.unwritten += u64::from(samples);
                return;
            }
            let first = total.samples + total.rejected + total.unwritten == 0;
            for c in 0..3 {
                let (radiance, squares) = (f64::from(sums.radiance[c]), f64::from(sums.squares[c]));
                total.radiance[c] = if first { radiance } else { total.radiance[c] + radiance };
                total.squares[c] = if first { squares } else { total.squares[c] + squares };
            }
            total.samples += u64::from(sums.samples);
            total.rejected += u64::from(samples - sums.samples);
            total.segments += u64::from(sums.segments);
        });
    }

    /// The mean radiance of each pixel.
    pub fn image(&self) -> Image {
        Image {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(|total| total.mean().map(|value| value as f32)).collect(),
        }
    }

    /// Counts over all pixels.
    pub fn counts(&self) -> FilmCounts {
        let add = |a: FilmCounts, b: FilmCounts| FilmCounts {
            samples: a.samples + b.samples,
            rejected: a.rejected + b.rejected,
            segments: a.segments + b.segments,
            unwritten: a.unwritten + b.unwritten,
        };
        let count = |total: &PixelTotals| FilmCounts {
            samples: total.samples,
            rejected: total.rejected,
            segments: total.segments,
            unwritten: u64::from(total.unwritten > 0 || total.samples + total.rejected == 0),
        };
        self.pixels.par_iter().with_min_len(4096).map(count).reduce(FilmCounts::default, add)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn sums(value: f32, samples: u32) -> PixelSums {
        PixelSums {
            radiance: Vec3::splat(value),
            samples,
            squares: Vec3::splat(value * value),
            segments: 2 * samples,
        }
    }

    #[test]
    fn chunks_add_up_and_rejections_are_counted() {
        let mut film = Film::new(1, 1);
        film.merge(&[sums(2.0, 4)], 4);
        film.merge(&[sums(4.0, 3)], 4);
        assert_eq!(film.pixels[0].radiance, [6.0; 3]);
        assert_eq!(film.counts(), FilmCounts { samples: 7, rejected: 1, segments: 14, unwritten: 0 });
    }

    #[test]
    fn an_unwritten_pixel_shows() {
        let mut film = Film::new(2, 1);
        assert!(film.image().pixels[0][0].is_nan());
        film.merge(&[sums(1.0, 1), PixelSums::UNWRITTEN], 1);
        let image = film.image();
        assert!(image.pixels[0] == [1.0; 3] && image.pixels[1][0].is_nan());
        assert_eq!(film.counts().unwritten, 1);
        // A later chunk does not hide it; a lost chunk spoils an earlier one.
        film.merge(&[PixelSums::UNWRITTEN, sums(1.0, 1)], 1);
        assert!(film.image().pixels.iter().flatten().all(|value| value.is_nan()));
        assert_eq!(film.counts().unwritten, 2);
    }

    /// Torture tests 21 and 22: a constant does not stagnate, a large term does not swallow its neighbours for good. The
    /// error that stays is that of 0.1 as an f32 and of one rounding a chunk, 2^-25 each.
    #[test]
    fn totals_neither_stagnate_nor_drift() {
        let mut film = Film::new(1, 1);
        let (mut chunk, mut carry) = (PixelSums::ZERO, Carry::ZERO);
        for _ in 0..256 {
            chunk.add(Vec3::splat(0.1), &mut carry, 0);
        }
        chunk.finish(carry);
        for _ in 0..1 << 17 {
            film.merge(&[chunk], 256);
        }
        let mean = film.pixels[0].mean()[0];
        assert!((mean / 0.1 - 1.0).abs() < 1e-7, "{mean}");
        let in_f32 = (0..1 << 25).fold(0.0f32, |sum, _| sum + 0.1) / (1 << 25) as f32;
        assert!((in_f32 / 0.1 - 1.0).abs() > 0.1, "the sabotage twin, one f32 sum, must fail: {in_f32}");

        let mut film = Film::new(1, 1);
        for value in [16_777_216.0, 1.0, -16_777_216.0] {
            film.merge(&[sums(value, 1)], 1);
        }
        assert_eq!(film.image().pixels[0][0], 1.0 / 3.0);
    }

    #[test]
    fn variance_of_the_mean() {
        let mut film = Film::new(1, 1);
        for value in [1.0, 3.0] {
            film.merge(&[sums(value, 1)], 1);
        }
        // Mean 2, sample variance 2, over n = 2.
        assert_eq!((film.pixels[0].mean()[0], film.pixels[0].variance_of_mean()[0]), (2.0, 1.0));
    }
}
