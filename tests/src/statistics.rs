//! The statistics of equivalence: is the difference of two renders noise?

use trisect::film::Film;

/// Two films compared channel by channel.
#[derive(Clone, Debug)]
pub struct ZTest {
    /// Share of pixel channels with |z| below 4.5.
    pub share: f64,
    /// z of the difference of the global means, by channel.
    pub global: [f64; 3],
    /// Difference of the global means over the mean, by channel.
    pub relative: [f64; 3],
}

/// The limit for one pixel channel. At 4.5 sigma one in 150,000 normal values lies outside; the sums of few samples have heavier
/// tails, and channels of almost no variance (a constant sky, one rare path) have no normal distribution at all: so
/// [`ZTest::passes`] allows 0.25 % of them (Mitsuba 3's z-test allows as many) and relies on the global mean for the rest.
pub const PIXEL_LIMIT: f64 = 4.5;

/// Sigmas that the global mean of a channel may be off: one in 16,000 by chance.
pub const GLOBAL_LIMIT: f64 = 4.0;

impl ZTest {
    /// Compares two renders drawn from different seeds, by the variances that their own films hold.
    pub fn new(a: &Film, b: &Film) -> Self {
        let (mut inside, mut total) = (0u64, 0u64);
        let mut sums = [[0.0; 3]; 3]; // mean of a, mean of b, variance of the difference
        for (a, b) in a.pixels.iter().zip(&b.pixels) {
            let (mean_a, mean_b) = (a.mean(), b.mean());
            let (variance_a, variance_b) = (a.variance_of_mean(), b.variance_of_mean());
            for c in 0..3 {
                let variance = variance_a[c] + variance_b[c];
                // Rounding alone may differ: 256 sums in f32.
                let floor = 1e-5 * mean_a[c].abs().max(mean_b[c].abs());
                let z = (mean_a[c] - mean_b[c]).abs() / variance.sqrt().max(floor).max(1e-12);
                inside += u64::from(z < PIXEL_LIMIT);
                total += 1;
                sums[0][c] += mean_a[c];
                sums[1][c] += mean_b[c];
                sums[2][c] += variance;
            }
        }
        let difference = |c: usize| sums[0][c] - sums[1][c];
        Self {
            share: inside as f64 / total.max(1) as f64,
            global: std::array::from_fn(|c| difference(c) / sums[2][c].sqrt().max(1e-12)),
            relative: std::array::from_fn(|c| difference(c) / sums[1][c]),
        }
    }

    /// Whether the difference is noise.
    pub fn passes(&self) -> bool {
        self.share >= 0.9975 && self.global.iter().all(|z| z.abs() < GLOBAL_LIMIT)
    }
}
