//! Two independent halves of an image: the noise of one may steer the other without bias.

use super::Tiles;
use crate::film::{AovTotals, Film, PixelTotals, SampleCoverage, TASK, Totals};
use crate::render::mean_of_halves;
use rayon::prelude::*;
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// Two films of the same scene with different random numbers. The image is the mean of both halves,
/// each with weight 1/2, whatever its number of samples. So the number of samples of one half,
/// which the noise of the other decides, does not change its weight (Rousselle et al., "Adaptive
/// Sampling and Reconstruction using Greedy Error Minimization", 2011, keep two buffers for the
/// same reason).
#[derive(Clone, Debug)]
pub struct DualBuffers {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    tiles: Tiles,
    pixels: [Vec<PixelTotals>; 2],
    /// AOV sums in `f32`: the filter's edge stopping needs no more precision.
    aovs: [Vec<AovSums>; 2],
    /// Number of samples per pixel of each tile, by half.
    taken: [Vec<u32>; 2],
}

impl DualBuffers {
    /// Memory per pixel in bytes, including AOV sums.
    pub const BYTES_PER_PIXEL: u64 = 2 * (size_of::<PixelTotals>() + size_of::<AovSums>()) as u64;

    /// Creates halves without samples.
    pub fn new(width: u32, height: u32) -> Self {
        let tiles = Tiles::new(width, height);
        let pixels = width as usize * height as usize;
        let empty = || rayon::iter::repeat_n(PixelTotals::EMPTY, pixels).with_min_len(TASK).collect();
        let taken = [vec![0; tiles.len()], vec![0; tiles.len()]];
        Self { width, height, pixels: [empty(), empty()], aovs: [Vec::new(), Vec::new()], taken, tiles }
    }

    /// Creates halves without samples, whose sums are on the device.
    pub(super) fn on_device(width: u32, height: u32) -> Self {
        let tiles = Tiles::new(width, height);
        let taken = [vec![0; tiles.len()], vec![0; tiles.len()]];
        Self { width, height, pixels: Default::default(), aovs: Default::default(), taken, tiles }
    }

    /// Returns whether the sums are on the device: only the numbers of samples are here.
    pub(super) fn is_on_device(&self) -> bool {
        self.pixels[0].is_empty() && !self.tiles.is_empty()
    }

    /// Counts `samples` samples of each pixel of a half.
    pub(super) fn take(&mut self, half: usize, samples: u32) {
        self.taken[half].iter_mut().for_each(|taken| *taken = taken.saturating_add(samples));
    }

    /// Counts the samples of a pass in which each tile has its own number of samples, `counts`.
    pub(super) fn take_tiles(&mut self, half: usize, counts: &[u32]) {
        let taken = self.taken[half].iter_mut().zip(counts);
        taken.for_each(|(taken, count)| *taken = taken.saturating_add(*count));
    }

    /// Returns the tiles of the image.
    pub fn tiles(&self) -> &Tiles {
        &self.tiles
    }

    /// Returns the number of samples per pixel of each tile, for a half.
    pub fn taken(&self, half: usize) -> &[u32] {
        &self.taken[half]
    }

    /// Returns the sums of a half.
    pub fn pixels(&self, half: usize) -> &[PixelTotals] {
        &self.pixels[half]
    }

    /// Returns the samples of all pixels of both halves.
    pub fn samples(&self) -> u64 {
        let of = |half: usize| (0..self.tiles.down()).map(move |row| (half, row));
        let rows = of(0).chain(of(1));
        rows.map(|(half, row)| self.tiles.samples_of_row(row, &self.taken[half])).sum()
    }

    /// Adds sums of `samples` samples of each pixel to a half.
    pub fn add(&mut self, half: usize, sums: &[PixelSums], samples: u32) {
        let pixels = self.pixels[half].par_iter_mut().zip(sums).with_min_len(TASK);
        pixels.for_each(|(total, sums)| total.merge(sums, samples));
        self.take(half, samples);
    }

    /// Adds the AOV sums of a pass of `samples` samples to a half. The caller adds those of every
    /// pass or of none.
    pub fn add_aovs(&mut self, half: usize, guides: &[AovSums], samples: u32) {
        self.allocate_aovs();
        let pixels = self.aovs[half].par_iter_mut().zip(guides).with_min_len(TASK);
        pixels.for_each(|(total, guides)| merge(total, guides, samples));
    }

    /// Adds the AOV sums of a pass in which each tile has its own number of samples, `counts`.
    pub fn add_tile_aovs(&mut self, half: usize, guides: &[AovSums], counts: &[u32]) {
        self.allocate_aovs();
        let tiles = &self.tiles;
        let pixels = self.aovs[half].par_iter_mut().zip(guides).enumerate().with_min_len(TASK);
        pixels.for_each(|(pixel, (total, guides))| {
            let count = counts[tiles.of_pixel(pixel)];
            if count > 0 {
                merge(total, guides, count);
            }
        });
    }

    /// Allocates AOV sums where they are missing. It fills them in parallel, because the first
    /// touch of fresh memory is slow.
    pub fn allocate_aovs(&mut self) {
        let pixels = self.pixels[0].len().max(self.pixels[1].len());
        for guides in self.aovs.iter_mut().filter(|guides| guides.len() != pixels) {
            *guides = rayon::iter::repeat_n(AovSums::ZERO, pixels).with_min_len(TASK).collect();
        }
    }

    /// Writes the sums and AOV sums of a half in the kernels' format, rounded to f32.
    pub fn sums(&self, half: usize, sums: &mut [PixelSums], guides: &mut [AovSums]) {
        let pixels = sums.par_iter_mut().zip(&self.pixels[half]).with_min_len(TASK);
        pixels.for_each(|(sums, pixel)| *sums = pixel.sums());
        let pixels = guides.par_iter_mut().zip(&self.aovs[half]).with_min_len(TASK);
        pixels.for_each(|(to, guides)| *to = *guides);
    }

    /// Writes the sums and AOV sums of both halves as [`film`](Self::film) combines them.
    pub fn all_sums(&self, sums: &mut [PixelSums], guides: &mut [AovSums]) {
        let [a, b] = &self.pixels;
        let pixels = sums.par_iter_mut().zip(a).zip(b).with_min_len(TASK);
        pixels.for_each(|((sums, a), b)| *sums = both(a, b).sums());
        let [a, b] = &self.aovs;
        let pixels = guides.par_iter_mut().zip(a).zip(b).with_min_len(TASK);
        pixels.for_each(|((sum, a), b)| {
            *sum = *a;
            merge(sum, b, b.hits + b.misses);
        });
    }

    /// Frees the AOV sums, on another thread because freeing is slow.
    pub fn drop_aovs(&mut self) {
        let guides = std::mem::take(&mut self.aovs);
        rayon::spawn(move || drop(guides));
    }

    /// Removes all samples, and keeps the memory.
    pub fn clear(&mut self) {
        for half in 0..2 {
            self.pixels[half].par_iter_mut().with_min_len(TASK).for_each(|total| *total = PixelTotals::EMPTY);
            self.aovs[half].par_iter_mut().with_min_len(TASK).for_each(|guides| *guides = AovSums::ZERO);
            self.taken[half].fill(0);
        }
    }

    /// Adds sums of a pass in which each tile has its own number of samples, `counts`. Sums of
    /// tiles without samples are ignored.
    pub fn add_tile_samples(&mut self, half: usize, sums: &[PixelSums], counts: &[u32]) {
        let tiles = &self.tiles;
        let pixels = self.pixels[half].par_iter_mut().zip(sums).enumerate().with_min_len(TASK);
        pixels.for_each(|(pixel, (total, sums))| {
            let count = counts[tiles.of_pixel(pixel)];
            if count > 0 {
                total.merge(sums, count);
            }
        });
        self.take_tiles(half, counts);
    }

    /// Returns the image in linear radiance.
    pub fn image(&self) -> Image {
        let [a, b] = &self.pixels;
        let of = |(a, b): (&PixelTotals, &PixelTotals)| {
            mean_of_halves((a.mean(), a.samples), (b.mean(), b.samples)).map(|value| value as f32)
        };
        let pixels = a.par_iter().zip(b).with_min_len(TASK).map(of).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// Returns a film whose pixels have the mean of the image and the variance of that mean. If the
    /// halves have equal numbers of samples, its sums are the plain sums of both. Its coverage is
    /// empty.
    pub fn film(&self) -> Film {
        let [a, b] = &self.pixels;
        let pixels = Totals::of_each(a.len(), |pixel| both(&a[pixel], &b[pixel]));
        let aovs = Totals::of_each(self.aovs[0].len(), |pixel| {
            let mut totals = AovTotals::EMPTY;
            for (half, aovs) in (0..).zip(&self.aovs) {
                let aovs = &aovs[pixel];
                totals.merge(aovs, half, aovs.hits + aovs.misses);
            }
            totals
        });
        let coverage = SampleCoverage::new(self.height);
        Film { width: self.width, height: self.height, pixels, aovs, coverage }
    }
}

/// Adds AOV sums of `samples` samples; sums that no kernel wrote make the total NaN.
fn merge(total: &mut AovSums, guides: &AovSums, samples: u32) {
    if guides.hits > samples || guides.misses > samples {
        *total =
            AovSums { hits: total.hits, misses: total.misses.saturating_add(samples), ..AovSums::UNWRITTEN };
        return;
    }
    total.add(*guides);
}

/// Returns totals of both halves of a pixel: the plain sums if the halves have equal numbers of
/// samples or one has none, otherwise sums whose mean is the average of the halves' means.
pub(super) fn both(a: &PixelTotals, b: &PixelTotals) -> PixelTotals {
    let mut sum = *a;
    sum.add(b);
    if a.samples == b.samples || a.samples.min(b.samples) == 0 {
        return sum;
    }
    let n = sum.samples as f64;
    let means = [a, b].map(PixelTotals::mean);
    let variances = [a, b].map(PixelTotals::variance_of_mean);
    let too_few = a.samples.min(b.samples) < 2;
    for c in 0..3 {
        let mean = 0.5 * (means[0][c] + means[1][c]);
        let variance = match too_few {
            true => 0.25 * (means[0][c] - means[1][c]).powi(2),
            false => 0.25 * (variances[0][c] + variances[1][c]),
        };
        sum.radiance[c] = (mean * n).into();
        sum.squares[c] = (n * (variance * (n - 1.0) + mean * mean)).into();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn sums(values: &[f32]) -> PixelSums {
        let mut sums = PixelSums::ZERO;
        let mut carry = trisect_shared::film::Compensation::ZERO;
        values.iter().for_each(|&value| sums.add(Vec3::splat(value), &mut carry, 0));
        sums.compensate(carry);
        sums
    }

    /// Each half has weight 1/2, and the film has the variance of the mean.
    #[test]
    fn halves_weigh_the_same() {
        let mut halves = DualBuffers::new(1, 1);
        halves.add(0, &[sums(&[1.0, 3.0])], 2);
        halves.add_tile_samples(1, &[sums(&[4.0, 5.0, 6.0, 9.0])], &[4]);
        assert_eq!(halves.samples(), 6);
        assert_eq!(halves.image().pixels, [[4.0; 3]]);
        let film = halves.film();
        let pixel = film.pixels.exact()[0];
        assert!((pixel.mean()[0] - 4.0).abs() < 1e-12);
        let want = 0.25 * (2.0 / 2.0 + (4.0 + 1.0 + 0.0 + 9.0) / 3.0 / 4.0);
        assert!((pixel.variance_of_mean()[0] - want).abs() < 1e-12, "{pixel:?}");
        // Negative control: the mean over all samples would differ.
        assert!(((1.0 + 3.0 + 4.0 + 5.0 + 6.0 + 9.0) / 6.0f64 - 4.0).abs() > 0.1);
    }

    /// If a half has one sample, the variance comes from the difference of the halves.
    #[test]
    fn one_sample_has_no_variance() {
        let mut halves = DualBuffers::new(1, 1);
        halves.add(0, &[sums(&[1.0])], 1);
        halves.add_tile_samples(1, &[sums(&[2.0, 4.0, 6.0])], &[3]);
        let variance = halves.film().pixels.exact()[0].variance_of_mean()[0];
        assert!((variance - 0.25 * 9.0).abs() < 1e-12, "{variance}");
    }

    #[test]
    fn a_tile_without_samples_stays_as_it_was() {
        let mut halves = DualBuffers::new(9, 1);
        halves.add(0, &[sums(&[1.0]); 9], 1);
        let before = halves.pixels(0).to_vec();
        let mut request = [PixelSums { samples: 7, ..PixelSums::UNWRITTEN }; 9];
        request[8] = sums(&[2.0, 2.0]);
        halves.add_tile_samples(0, &request, &[0, 2]);
        assert_eq!(halves.pixels(0)[..8], before[..8]);
        assert_eq!(halves.pixels(0)[8].samples, 3);
        assert_eq!(halves.taken(0), [1, 3]);
    }
}
