//! Where samples bring most.

use super::Tiles;
use super::survey::{Survey, Tile};
use trisect_shared::rng::PathKey;

/// Samples of a tile over the mean, at least: what a survey found quiet may have hidden something.
const LEAST: f64 = 0.125;

/// Samples of a tile over the mean, at most: one pass's worth of surprise.
const MOST: f64 = 32.0;

/// Samples of each tile's pixels over the mean of all, for a half: by what the other half found. The error of so much work is least where they are as
/// the root of the variance over the work (Neyman's allocation).
pub(super) fn shape(survey: &Survey, half: usize, tiles: &Tiles) -> Vec<f64> {
    let other = 1 - half;
    let own: Vec<f64> = survey.tiles.iter().map(|tile| tile.variance[other]).collect();
    let around = tiles.around(&own);
    // A quiet tile beside a loud one saw less than there is.
    let variance = own.iter().zip(&around).map(|(own, around)| own.max(*around));
    let work = survey.tiles.iter().map(|tile| tile.work[other].max(1.0));
    let mut wanted: Vec<f64> = variance.zip(work).map(|(v, w)| (v / w).sqrt()).collect();
    // What the bounds take or give, the others share: a few rounds settle it.
    for _ in 0..8 {
        let mean = mean(&wanted, tiles);
        if mean <= 0.0 {
            return vec![1.0; tiles.len()];
        }
        wanted.iter_mut().for_each(|wanted| *wanted = (*wanted / mean).clamp(LEAST, MOST));
    }
    wanted
}

/// By pixels.
fn mean(values: &[f64], tiles: &Tiles) -> f64 {
    let (mut sum, mut pixels) = (0.0, 0.0);
    for (tile, value) in values.iter().enumerate() {
        let size = f64::from(tiles.size(tile));
        sum += value * size;
        pixels += size;
    }
    sum / pixels.max(1.0)
}

/// The squared error of an image whose halves' tiles have these numbers of samples.
pub(super) fn error(survey: &Survey, tiles: &Tiles, counts: [&dyn Fn(usize) -> f64; 2]) -> f64 {
    let of = |tile: usize| {
        let variance = survey.tiles[tile].variance;
        (0..2).map(|half| 0.25 * variance[half] / counts[half](tile).max(1e-9)).sum::<f64>()
    };
    mean(&(0..tiles.len()).map(of).collect::<Vec<_>>(), tiles)
}

/// Work of so many samples of each tile's pixels, for a half.
pub(super) fn work(survey: &Survey, tiles: &Tiles, half: usize, counts: &dyn Fn(usize) -> f64) -> f64 {
    let of =
        |tile: usize, found: &Tile| found.work[half].max(1.0) * counts(tile) * f64::from(tiles.size(tile));
    survey.tiles.iter().enumerate().map(|(tile, found)| of(tile, found)).sum()
}

/// How many times the work uniform samples take for the error that adaptive ones have. Each half's allocation comes from the other's noise, so
/// that what is noise in it does not flatter it.
pub(super) fn gain(survey: &Survey, tiles: &Tiles) -> f64 {
    let shapes = [0, 1].map(|half| shape(survey, half, tiles));
    let one: &dyn Fn(usize) -> f64 = &|_| 1.0;
    let by = |half: usize| {
        let shape = &shapes[half];
        move |tile: usize| shape[tile]
    };
    let all = |counts: [&dyn Fn(usize) -> f64; 2]| {
        error(survey, tiles, counts) * (0..2).map(|half| work(survey, tiles, half, counts[half])).sum::<f64>()
    };
    let adaptive = all([&by(0), &by(1)]);
    if adaptive > 0.0 { all([one, one]) / adaptive } else { 1.0 }
}

/// Samples that each tile takes next, for `available` work: those that bring all of them nearest to `shape`, and at most `most` each.
pub(super) fn next(
    survey: &Survey,
    tiles: &Tiles,
    half: usize,
    shape: &[f64],
    taken: &[u32],
    most: f64,
    available: f64,
) -> Vec<f64> {
    let missing = |level: f64, tile: usize| (level * shape[tile] - f64::from(taken[tile])).clamp(0.0, most);
    // The other half's path lengths, too: a half's own samples decide nothing about it.
    let cost = |level: f64| work(survey, tiles, 1 - half, &|tile| missing(level, tile));
    let (mut low, mut high) = (0.0, 1.0);
    while cost(high) < available && high < 1e9 {
        high *= 2.0;
    }
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if cost(middle) < available { low = middle } else { high = middle }
    }
    (0..tiles.len()).map(|tile| missing(low, tile)).collect()
}

/// Whole numbers of the same mean: the rest of each decides by chance whether it is rounded up.
pub(super) fn whole(counts: &[f64], seed: u32, pass: u32) -> Vec<u32> {
    let word = |tile: usize| PathKey { seed, pixel: tile as u32, sample: pass }.words(0x5a).x;
    let round = |(tile, count): (usize, &f64)| {
        let chance = f64::from(word(tile)) / (f64::from(u32::MAX) + 1.0);
        (count + chance).floor().clamp(0.0, f64::from(u32::MAX)) as u32
    };
    counts.iter().enumerate().map(round).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn survey(variances: &[f64]) -> Survey {
        let tiles =
            variances.iter().map(|&v| Tile { variance: [v; 2], work: [2.0; 2], error: 0.0 }).collect();
        Survey { error: 0.0, tiles }
    }

    /// Two far-apart regions of variance 1 and 16: counts as 1 to 4, and 25 / 34 of the work for the same error.
    #[test]
    fn samples_go_where_the_noise_is() {
        let tiles = Tiles::new(8 * 200, 8);
        let variances: Vec<f64> = (0..200).map(|tile| if tile < 100 { 1.0 } else { 16.0 }).collect();
        let survey = survey(&variances);
        let shape = shape(&survey, 0, &tiles);
        assert!((shape[150] / shape[50] - 4.0).abs() < 1e-9, "{} {}", shape[150], shape[50]);
        assert!((mean(&shape, &tiles) - 1.0).abs() < 1e-9);
        let gain = gain(&survey, &tiles);
        assert!((gain - 8.5 / 6.25).abs() < 0.02, "{gain}");
        let even = super::gain(&self::survey(&[3.0; 200]), &tiles);
        assert!((even - 1.0).abs() < 1e-9);
    }

    /// What one half found noisy is where the other takes its samples, never itself: there it knows that it was bright by chance.
    #[test]
    fn halves_steer_each_other() {
        let tiles = Tiles::new(8 * 200, 8);
        let mut found = survey(&[1.0; 200]);
        found.tiles[150].variance[0] = 100.0;
        let [first, second] = [0, 1].map(|half| shape(&found, half, &tiles));
        assert!(first.iter().all(|&share| (share - 1.0).abs() < 1e-9), "{}", first[150]);
        assert!(second[150] > 5.0 && second[50] < 1.0, "{} {}", second[150], second[50]);
    }

    #[test]
    fn what_was_taken_counts() {
        let tiles = Tiles::new(16, 8);
        let survey = survey(&[1.0, 1.0]);
        let more = next(&survey, &tiles, 0, &[0.5, 1.5], &[10, 10], f64::MAX, 64.0 * 2.0 * 20.0);
        // 10 and 30 would be 40 in all; 20 are there, of which none too many.
        // 24 halvings of an interval of 64.
        assert!(more[0] == 0.0 && (more[1] - 20.0).abs() < 1e-4, "{more:?}");
    }

    #[test]
    fn rounding_keeps_the_mean() {
        let counts = vec![0.3; 10_000];
        let sum: u32 = whole(&counts, 1, 2).iter().sum();
        // 4 sigma: 183.
        assert!((2817..3183).contains(&sum), "{sum}");
        assert_eq!(whole(&[4.0, 0.0], 1, 2), [4, 0]);
    }
}
