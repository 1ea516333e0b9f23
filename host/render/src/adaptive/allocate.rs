//! Distributes samples over tiles in proportion to their noise: the noise map of one half gives the
//! sample counts of the other. `renderer`, `goal` and `budget` call it.

use super::Tiles;
use super::noise_map::NoiseMap;
use rayon::prelude::*;
use trisect_shared::rng::PathKey;

/// Minimum samples of a tile relative to the mean, because a noise map may miss rare bright paths.
const MIN_SHARE: f64 = 0.125;

/// Maximum samples of a tile relative to the mean, in case a noise map overestimates its noise.
const MAX_SHARE: f64 = 32.0;

/// Returns the samples of each tile's pixels relative to the mean over all pixels, for a half, from
/// the noise of the other half. The error for a given amount of work is minimal if they are
/// proportional to the root of variance over work (Neyman's allocation).
pub(super) fn relative_samples(noise_map: &NoiseMap, half: usize, tiles: &Tiles) -> Vec<f64> {
    let other = 1 - half;
    let variances: Vec<f64> = noise_map.tiles.iter().map(|tile| tile.variance[other]).collect();
    let around = tiles.around(&variances);
    // A tile counts at least as noisy as its surroundings: it may have missed their bright paths.
    let variance = variances.iter().zip(&around).map(|(own, around)| own.max(*around));
    let work = noise_map.tiles.iter().map(|tile| tile.work[other].max(1.0));
    let mut wanted: Vec<f64> = variance.zip(work).map(|(v, w)| (v / w).sqrt()).collect();
    // The bounds change the mean; a few rounds of normalisation settle it.
    for _ in 0..8 {
        let mean = mean(tiles, |tile| wanted[tile]);
        if mean <= 0.0 {
            return vec![1.0; tiles.len()];
        }
        wanted.iter_mut().for_each(|wanted| *wanted = (*wanted / mean).clamp(MIN_SHARE, MAX_SHARE));
    }
    wanted
}

impl NoiseMap {
    /// Returns the samples of each tile's pixels relative to the mean over all pixels, for each
    /// half ([`relative_samples`]).
    pub fn shares(&self, tiles: &Tiles) -> &[Vec<f64>; 2] {
        self.shares.get_or_init(|| {
            let of = |half| relative_samples(self, half, tiles);
            rayon::join(|| of(0), || of(1)).into()
        })
    }
}

/// Number of tiles that a thread adds up.
const PART: usize = 1024;

/// Function of a tile.
pub(super) type OfTile<'a> = &'a (dyn Fn(usize) -> f64 + Sync);

/// Returns the sum over tiles, of which each pixel counts. It does not depend on the number of
/// threads.
fn sum(tiles: &Tiles, of: impl Fn(usize) -> f64 + Sync) -> f64 {
    let part = |first: usize| {
        let own = first..(first + PART).min(tiles.len());
        own.map(|tile| of(tile) * f64::from(tiles.size(tile))).sum::<f64>()
    };
    let parts: Vec<f64> = (0..tiles.len()).into_par_iter().step_by(PART).map(part).collect();
    parts.iter().sum()
}

/// Returns the mean over tiles, weighted by pixels.
fn mean(tiles: &Tiles, of: impl Fn(usize) -> f64 + Sync) -> f64 {
    let (width, height) = tiles.image();
    sum(tiles, of) / (f64::from(width) * f64::from(height)).max(1.0)
}

/// Returns the relMSE of an image with these samples per pixel in each tile, by half.
pub(super) fn rel_mse(noise_map: &NoiseMap, tiles: &Tiles, counts: [OfTile<'_>; 2]) -> f64 {
    let of = |tile: usize| {
        let variance = noise_map.tiles[tile].variance;
        (0..2).map(|half| 0.25 * variance[half] / counts[half](tile).max(1e-9)).sum::<f64>()
    };
    mean(tiles, of)
}

/// Returns the work in segments if the pixels of each tile take `counts` samples, for a half.
pub(super) fn work(noise_map: &NoiseMap, tiles: &Tiles, half: usize, counts: OfTile<'_>) -> f64 {
    sum(tiles, |tile| noise_map.tiles[tile].work[half].max(1.0) * counts(tile))
}

/// Returns the work of uniform sampling over that of adaptive sampling for the same error. Each
/// half's allocation comes from the other's noise, so the noise of the estimate does not overstate
/// the gain.
pub(super) fn gain(noise_map: &NoiseMap, tiles: &Tiles) -> f64 {
    let shares = noise_map.shares(tiles);
    let one: OfTile<'_> = &|_| 1.0;
    let by = |half: usize| {
        let share = &shares[half];
        move |tile: usize| share[tile]
    };
    let all = |counts: [OfTile<'_>; 2]| {
        rel_mse(noise_map, tiles, counts)
            * (0..2).map(|half| work(noise_map, tiles, half, counts[half])).sum::<f64>()
    };
    let adaptive = all([&by(0), &by(1)]);
    if adaptive > 0.0 { all([one, one]) / adaptive } else { 1.0 }
}

/// Samples that each tile takes next for a given amount of work, by water-filling: all tiles are
/// raised to a common level, the samples per pixel over the tile's share ([`relative_samples`]).
/// Tiles above the level take none.
pub(super) struct Allocation<'a> {
    share: &'a [f64],
    taken: &'a [u32],
    max_samples: f64,
    /// Work by level, linear between steps: one where a tile begins to take samples, and one where
    /// it has its maximum.
    steps: Vec<Step>,
}

/// Step of the work as a function of the level.
struct Step {
    level: f64,
    /// Work below the level.
    work: f64,
    /// Work per unit of level above it.
    slope: f64,
}

impl<'a> Allocation<'a> {
    /// Builds the allocation for the tiles of a half. Each tile has `taken` samples and takes at
    /// most `most` more.
    pub fn new(
        (noise_map, tiles): (&NoiseMap, &Tiles),
        half: usize,
        share: &'a [f64],
        taken: &'a [u32],
        most: f64,
    ) -> Self {
        // Path lengths are the other half's, too: a half's own samples decide nothing about it.
        let each = |tile: usize| noise_map.tiles[tile].work[1 - half].max(1.0) * f64::from(tiles.size(tile));
        // At first `slope` is the change of slope at a step; the loop below turns it into the sum.
        let begin = |tile: usize| {
            let slope = each(tile) * share[tile];
            Step { level: f64::from(taken[tile]) / share[tile], work: 0.0, slope }
        };
        let end = |tile: usize| {
            let slope = -each(tile) * share[tile];
            Step { level: (f64::from(taken[tile]) + most) / share[tile], work: 0.0, slope }
        };
        let all = 0..tiles.len();
        let mut steps: Vec<Step> = match most < f64::MAX {
            true => all.flat_map(|tile| [begin(tile), end(tile)]).collect(),
            false => all.map(begin).collect(),
        };
        steps.par_sort_unstable_by(|a, b| a.level.total_cmp(&b.level));
        let (mut level, mut work, mut slope) = (0.0, 0.0, 0.0);
        for step in &mut steps {
            work += slope * (step.level - level);
            slope = f64::max(slope + step.slope, 0.0);
            (step.work, step.slope, level) = (work, slope, step.level);
        }
        Self { share, taken, max_samples: most, steps }
    }

    /// Builds the allocations of both halves.
    pub fn of_both(
        (noise_map, tiles): (&NoiseMap, &Tiles),
        shares: &'a [Vec<f64>; 2],
        taken: [&'a [u32]; 2],
        most: f64,
    ) -> [Self; 2] {
        let of = |half: usize| Self::new((noise_map, tiles), half, &shares[half], taken[half], most);
        rayon::join(|| of(0), || of(1)).into()
    }

    /// Returns the level that `available` segments of work reach.
    fn level(&self, available: f64) -> f64 {
        let after = self.steps.partition_point(|step| step.work <= available);
        let Some(step) = after.checked_sub(1).and_then(|before| self.steps.get(before)) else { return 0.0 };
        let end = self.steps.get(after).map_or(f64::MAX, |next| next.level);
        // If no tile takes more, any higher level gives the same counts.
        if step.slope > 0.0 {
            (step.level + (available - step.work) / step.slope).min(end)
        } else {
            step.level
        }
    }

    /// Returns a function from a tile to the samples per pixel that it takes for this work.
    pub fn count_of_tile(&self, available: f64) -> impl Fn(usize) -> f64 + use<'_, 'a> {
        let level = self.level(available);
        move |tile| (level * self.share[tile] - f64::from(self.taken[tile])).clamp(0.0, self.max_samples)
    }

    /// Returns the samples per pixel that each tile takes for this work.
    pub fn counts(&self, available: f64) -> Vec<f64> {
        (0..self.share.len()).into_par_iter().with_min_len(PART).map(self.count_of_tile(available)).collect()
    }
}

/// Rounds to whole numbers with the same mean: the fraction of each is the probability that it is
/// rounded up.
pub(super) fn round_stochastically(counts: &[f64], seed: u32, pass: u32) -> Vec<u32> {
    let word = |tile: usize| PathKey { seed, pixel: tile as u32, sample: pass }.words(0x5a).x;
    let round = |(tile, count): (usize, &f64)| {
        let chance = f64::from(word(tile)) / (f64::from(u32::MAX) + 1.0);
        (count + chance).floor().clamp(0.0, f64::from(u32::MAX)) as u32
    };
    counts.par_iter().enumerate().with_min_len(PART).map(round).collect()
}

#[cfg(test)]
mod tests {
    use super::super::noise_map::TileNoise;
    use super::*;

    fn noise_map(variances: &[f64]) -> NoiseMap {
        let tiles =
            variances.iter().map(|&v| TileNoise { variance: [v; 2], work: [2.0; 2], error: 0.0 }).collect();
        NoiseMap::of(0.0, tiles)
    }

    /// Two far-apart regions of variance 1 and 16: sample counts in the ratio 1 : 4, and 25 / 34 of
    /// the work for the same error.
    #[test]
    fn samples_go_where_the_noise_is() {
        let tiles = Tiles::new(8 * 200, 8);
        let variances: Vec<f64> = (0..200).map(|tile| if tile < 100 { 1.0 } else { 16.0 }).collect();
        let noise_map = noise_map(&variances);
        let share = relative_samples(&noise_map, 0, &tiles);
        assert!((share[150] / share[50] - 4.0).abs() < 1e-9, "{} {}", share[150], share[50]);
        assert!((mean(&tiles, |tile| share[tile]) - 1.0).abs() < 1e-9);
        let gain = gain(&noise_map, &tiles);
        assert!((gain - 8.5 / 6.25).abs() < 0.02, "{gain}");
        let even = super::gain(&self::noise_map(&[3.0; 200]), &tiles);
        assert!((even - 1.0).abs() < 1e-9);
    }

    /// Noise of one half attracts samples of the other half, never its own, because a half
    /// that is bright by chance must not decide about itself.
    #[test]
    fn halves_steer_each_other() {
        let tiles = Tiles::new(8 * 200, 8);
        let mut noise = noise_map(&[1.0; 200]);
        noise.tiles[150].variance[0] = 100.0;
        let [first, second] = [0, 1].map(|half| relative_samples(&noise, half, &tiles));
        assert!(first.iter().all(|&share| (share - 1.0).abs() < 1e-9), "{}", first[150]);
        assert!(second[150] > 5.0 && second[50] < 1.0, "{} {}", second[150], second[50]);
    }

    #[test]
    fn what_was_taken_counts() {
        let tiles = Tiles::new(16, 8);
        let noise_map = noise_map(&[1.0, 1.0]);
        let next = |most, samples: f64| {
            Allocation::new((&noise_map, &tiles), 0, &[0.5, 1.5], &[10, 10], most)
                .counts(64.0 * 2.0 * samples)
        };
        // Of 40 samples the tiles should have 10 and 30. Both have 10, so neither has too many.
        assert_eq!(next(f64::MAX, 20.0), [0.0, 20.0]);
        assert_eq!(next(f64::MAX, 40.0), [5.0, 35.0]);
        assert_eq!(next(15.0, 10.0), [0.0, 10.0]);
        assert_eq!(next(15.0, 20.0), [5.0, 15.0]);
        assert_eq!(next(15.0, 1e9), [15.0, 15.0]);
        assert_eq!(next(15.0, 0.0), [0.0, 0.0]);
    }

    /// The work of the counts equals the available work, whatever the tiles already have.
    #[test]
    fn work_is_what_there_is() {
        let tiles = Tiles::new(8 * 300, 8);
        let word = |tile: u32, which: u32| PathKey { seed: 3, pixel: tile, sample: which }.words(0).x;
        let tile = |tile: u32| {
            let work = 1.0 + f64::from(word(tile, 0) % 100) / 10.0;
            TileNoise { variance: [1.0; 2], work: [work; 2], error: 0.0 }
        };
        let noise_map = NoiseMap::of(0.0, (0..300).map(tile).collect());
        let share: Vec<f64> = (0..300).map(|tile| f64::from(1 + word(tile, 1) % 32) / 8.0).collect();
        let taken: Vec<u32> = (0..300).map(|tile| word(tile, 2) % 64).collect();
        for (most, samples) in [(f64::MAX, 1e3), (f64::MAX, 1e6), (256.0, 1e3), (256.0, 1e5), (256.0, 1e9)] {
            let filling = Allocation::new((&noise_map, &tiles), 1, &share, &taken, most);
            let counts = filling.counts(samples);
            let spent = work(&noise_map, &tiles, 0, &|tile| counts[tile]);
            let all = work(&noise_map, &tiles, 0, &|_| most);
            assert!((spent / samples.min(all) - 1.0).abs() < 1e-9, "{most} {samples}: {spent}");
            assert!(counts.iter().all(|&count| (0.0..=most).contains(&count)));
        }
        // Negative control: some tiles have more than their share, and give nothing back.
        let filling = Allocation::new((&noise_map, &tiles), 1, &share, &taken, f64::MAX);
        let counts = filling.counts(1e5);
        assert!(counts.contains(&0.0) && counts.iter().any(|&count| count > 1.0), "{counts:?}");
    }

    #[test]
    fn rounding_keeps_the_mean() {
        let counts = vec![0.3; 10_000];
        let sum: u32 = round_stochastically(&counts, 1, 2).iter().sum();
        // 4 sigma: 183.
        assert!((2817..3183).contains(&sum), "{sum}");
        assert_eq!(round_stochastically(&[4.0, 0.0], 1, 2), [4, 0]);
    }
}
