//! Estimates of the noise of an image, in total and by tiles, from its own samples.

use super::percentile::percentile;
use super::{DualBuffers, Tiles};
use crate::film::TASK;
use crate::passes::MeasuredNoise;
use crate::stats::Noise;
use rayon::prelude::*;
use std::sync::OnceLock;
use trisect_image::metrics::REL_MSE_EPSILON;
use trisect_shared::noise::{EPSILON, PixelNoise};

const _: () = assert!(EPSILON == REL_MSE_EPSILON as f32);

/// Noise of a tile; arrays are by half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TileNoise {
    /// Mean over pixels and channels of the variance of one sample over mean² + 0.01.
    pub variance: [f64; 2],
    /// Segments per sample.
    pub work: [f64; 2],
    /// Mean over pixels of the squared relative error (relMSE).
    pub error: f64,
}

/// Noise of an image, by tiles.
pub(super) struct NoiseMap {
    /// Root of the estimated relMSE, as in [`Noise::error`].
    pub error: f64,
    pub tiles: Vec<TileNoise>,
    /// [Shares](Self::shares), once they were asked for.
    pub shares: OnceLock<[Vec<f64>; 2]>,
}

impl Noise {
    /// Returns the noise of an image; `from_halves` as in [`NoiseMap::new`].
    pub(super) fn of(halves: &DualBuffers, from_halves: bool) -> Self {
        let pixels = 0..halves.pixels(0).len();
        let errors = pixels.into_par_iter().with_min_len(TASK);
        let errors = errors.map(|pixel| pixel_noise(halves, pixel, from_halves).error).collect::<Vec<f32>>();
        Self::from_errors(&NoiseMap::new(halves, from_halves), &errors)
    }

    /// Returns the noise of an image with this noise map and these squared errors of pixels.
    fn from_errors(noise_map: &NoiseMap, errors: &[f32]) -> Self {
        Self { error: noise_map.error, percentile_99: f64::from(percentile(errors, 0.99)).sqrt() }
    }

    /// Returns the noise that a device measured, with the errors of pixels.
    pub(super) fn measured(noise: &MeasuredNoise<'_>, tiles: &Tiles) -> Self {
        Self::from_errors(&NoiseMap::measured(noise, tiles), noise.errors)
    }
}

/// Returns the noise of a pixel.
fn pixel_noise(halves: &DualBuffers, pixel: usize, from_halves: bool) -> PixelNoise {
    let [first, second] = [0, 1].map(|half| halves.pixels(half)[pixel].sums());
    PixelNoise::of(first, second, from_halves)
}

impl From<PixelNoise> for TileNoise {
    fn from(mean: PixelNoise) -> Self {
        Self {
            variance: [mean.variance.0, mean.variance.1].map(f64::from),
            work: [mean.work.0, mean.work.1].map(f64::from),
            error: f64::from(mean.error),
        }
    }
}

impl NoiseMap {
    /// Returns the map of an image that was not measured: all tiles are equal.
    pub fn uniform(tiles: &Tiles) -> Self {
        let tile = TileNoise { variance: [1.0; 2], work: [1.0; 2], error: 1.0 };
        Self::of(f64::NAN, vec![tile; tiles.len()])
    }

    /// Returns a map with this error.
    pub fn of(error: f64, tiles: Vec<TileNoise>) -> Self {
        Self { error, tiles, shares: OnceLock::new() }
    }

    /// Measures an image. The error of independent samples follows from the variance within each
    /// half. With `from_halves`, samples are not independent (Sobol), and the error follows from
    /// the difference of the halves; so it does for a pixel with fewer than two samples in a half.
    /// The variances that steer samples are those within each half, except in such a pixel.
    ///
    /// The error is relative to the mean of both halves, the variances that steer samples to the
    /// mean of their own half. Relative to the other half's mean, pixels with a few bright samples
    /// would count far too much: where one half has such a sample, the other is dark
    /// (docs/notebook/samplers-and-adaptive.md).
    pub fn new(halves: &DualBuffers, from_halves: bool) -> Self {
        let tiles = halves.tiles();
        let of_tile = |index: usize| {
            let mut sum = PixelNoise::ZERO;
            tiles.pixels(index).for_each(|pixel| sum.add(pixel_noise(halves, pixel, from_halves)));
            TileNoise::from(sum.mean(tiles.size(index)))
        };
        let of_tiles = (0..tiles.len()).into_par_iter().with_min_len(64).map(of_tile).collect();
        Self::from_tiles(of_tiles, tiles)
    }

    /// Returns the map that a device measured.
    pub fn measured(noise: &MeasuredNoise<'_>, tiles: &Tiles) -> Self {
        Self::from_tiles(noise.tiles.iter().map(|&mean| TileNoise::from(mean)).collect(), tiles)
    }

    fn from_tiles(of_tiles: Vec<TileNoise>, tiles: &Tiles) -> Self {
        let sizes = (0..tiles.len()).map(|tile| f64::from(tiles.size(tile)));
        // In order: a sum of floating-point numbers depends on it.
        let (sum, pixels) = of_tiles
            .iter()
            .zip(sizes)
            .fold((0.0, 0.0), |(sum, pixels), (tile, size)| (sum + tile.error * size, pixels + size));
        Self::of((sum / f64::max(pixels, 1.0)).sqrt(), of_tiles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use trisect_shared::film::{Compensation, PixelSums};
    use trisect_shared::math::unit_f32;
    use trisect_shared::rng::PathKey;

    /// Halves of uniform samples around 1, of half-width `width` in the left tile and twice that in
    /// the right tile.
    fn halves(samples: u32, width: f32, seed: u32) -> DualBuffers {
        let mut halves = DualBuffers::new(16, 8);
        for half in 0..2 {
            let pixel = |pixel: u32| {
                let (mut sums, mut carry) = (PixelSums::ZERO, Compensation::ZERO);
                let width = if pixel % 16 < 8 { width } else { 2.0 * width };
                for sample in 0..samples {
                    let word = PathKey { seed: seed + half, pixel, sample }.words(0).x;
                    let value = 1.0 + width * (2.0 * unit_f32(word) - 1.0);
                    sums.add(Vec3::splat(value), &mut carry, 0);
                }
                sums.compensate(carry);
                sums
            };
            halves.add(half as usize, &(0..128).map(pixel).collect::<Vec<_>>(), samples);
        }
        halves
    }

    /// Uniform samples of half-width w have variance w² / 3; the weight is 1 / 1.01.
    #[test]
    fn the_noise_of_known_samples() {
        let samples = 64;
        let want = |width: f64| (width * width / 3.0 / (2.0 * f64::from(samples)) / 1.01).sqrt();
        let expected = ((want(0.5).powi(2) + want(1.0).powi(2)) / 2.0).sqrt();
        for from_halves in [false, true] {
            let noise_map = NoiseMap::new(&halves(samples, 0.5, 1), from_halves);
            let off = noise_map.error / expected - 1.0;
            // 128 pixels: the variance within halves is within 1 %, that of their difference within
            // 9 %.
            assert!(off.abs() < if from_halves { 0.3 } else { 0.05 }, "{off}");
            let noise = Noise::of(&halves(samples, 0.5, 1), from_halves);
            assert!(noise.percentile_99 > noise.error && noise.error == noise_map.error);
            let ratio = noise_map.tiles[1].variance[0] / noise_map.tiles[0].variance[0];
            assert!((ratio / 4.0 - 1.0).abs() < 0.1, "{ratio}");
        }
        // Negative control: a quarter of the samples doubles the error.
        let quarter = NoiseMap::new(&halves(samples / 4, 0.5, 1), false).error / expected;
        assert!((quarter / 2.0 - 1.0).abs() < 0.1, "{quarter}");
    }

    #[test]
    fn one_sample_each_is_enough_for_a_guess() {
        let noise_map = NoiseMap::new(&halves(1, 0.5, 3), false);
        assert!(noise_map.error.is_finite() && noise_map.error > 0.1);
    }
}
