//! Statistics that decide whether the difference of two renders is noise.

use trisect::film::{Film, PixelTotals};

/// A comparison of two films, channel by channel.
#[derive(Clone, Debug)]
pub struct ZTest {
    /// Share of pixel channels with |z| below 4.5.
    pub share: f64,
    /// z of the difference of the global means, by channel.
    pub global: [f64; 3],
    /// Difference of the global means, relative to that of the second film, by channel.
    pub relative: [f64; 3],
}

/// Maximum |z| of a pixel channel. One in 150,000 normal values is beyond 4.5 sigma. Sums of few
/// samples have heavier tails, and channels of almost no variance (a constant sky, one rare path)
/// have no normal distribution at all. So [`ZTest::passes`] allows 0.25 % of the channels beyond
/// it, as Mitsuba 3's z-test does, and relies on the global mean for the rest.
pub const PIXEL_LIMIT: f64 = 4.5;

/// Maximum deviation of the global mean of a channel, in sigma: one in 16,000 is beyond by chance.
pub const GLOBAL_LIMIT: f64 = 4.0;

impl ZTest {
    /// Compares two renders with different seeds by the variances of their films.
    pub fn new(a: &Film, b: &Film) -> Self {
        let (mut inside, mut total) = (0u64, 0u64);
        let mut sums = [[0.0; 3]; 3]; // mean of a, mean of b, variance of the difference
        for (a, b) in a.pixels.iter().zip(&b.pixels) {
            let (mean_a, mean_b) = (a.mean(), b.mean());
            let (variance_a, variance_b) = (a.variance_of_mean(), b.variance_of_mean());
            for c in 0..3 {
                let variance = variance_a[c] + variance_b[c];
                // The difference may be rounding alone: 256 sums in f32.
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

    /// Returns whether the difference is noise.
    pub fn passes(&self) -> bool {
        self.share >= 0.9975 && self.global.iter().all(|z| z.abs() < GLOBAL_LIMIT)
    }
}

/// Side of the blocks of [`Blocks`], in pixels.
pub const BLOCK: u32 = 8;

/// Means of blocks of pixels, and of all pixels. The noise of a block is nearer to normal than a
/// pixel's, and its variance is better known.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks {
    /// Mean and variance of the mean of each block by channel, row-major; blocks at the right and
    /// the bottom may be smaller.
    pub blocks: Vec<([f64; 3], [f64; 3])>,
    /// Mean and variance of the mean of the whole film.
    pub whole: ([f64; 3], [f64; 3]),
}

impl Blocks {
    /// Computes the blocks of a film with the film's own variances.
    pub fn new(film: &Film) -> Self {
        let pixels = film.pixels.iter().map(|p| (p.mean(), p.variance_of_mean()));
        Self::of(film.width, film.height, pixels.collect())
    }

    /// Computes the blocks of an image by each pixel's mean and variance of the mean.
    pub fn of(width: u32, height: u32, pixels: Vec<([f64; 3], [f64; 3])>) -> Self {
        let mean = |columns: std::ops::Range<u32>, rows: std::ops::Range<u32>| {
            let n = f64::from(columns.len() as u32 * rows.len() as u32);
            let (mut mean, mut variance) = ([0.0; 3], [0.0; 3]);
            for y in rows {
                for x in columns.clone() {
                    let (m, v) = pixels[(y * width + x) as usize];
                    for c in 0..3 {
                        mean[c] += m[c] / n;
                        variance[c] += v[c] / (n * n);
                    }
                }
            }
            (mean, variance)
        };
        let mut blocks = Vec::new();
        for y in (0..height).step_by(BLOCK as usize) {
            for x in (0..width).step_by(BLOCK as usize) {
                blocks.push(mean(x..width.min(x + BLOCK), y..height.min(y + BLOCK)));
            }
        }
        Self { blocks, whole: mean(0..width, 0..height) }
    }

    /// Compares the blocks and the whole by channel: differences in sigma, after a relative
    /// difference of `rounding` is subtracted.
    pub fn compare(&self, other: &Self, rounding: f64) -> BlockTest {
        let z = |a: &([f64; 3], [f64; 3]), b: &([f64; 3], [f64; 3])| -> [f64; 3] {
            std::array::from_fn(|c| {
                let off = (a.0[c] - b.0[c]).abs() - rounding * a.0[c].abs().max(b.0[c].abs());
                off.max(0.0) / (a.1[c] + b.1[c]).sqrt().max(1e-12)
            })
        };
        let each: Vec<f64> = self.blocks.iter().zip(&other.blocks).flat_map(|(a, b)| z(a, b)).collect();
        let inside = each.iter().filter(|&&z| z < PIXEL_LIMIT).count();
        BlockTest {
            worst: each.iter().copied().fold(0.0, f64::max),
            share: inside as f64 / each.len().max(1) as f64,
            whole: z(&self.whole, &other.whole).into_iter().fold(0.0, f64::max),
            ratio: std::array::from_fn(|c| self.whole.0[c] / other.whole.0[c]),
        }
    }
}

/// Comparison of a mean with its known value.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Mean of the channel that deviates most.
    pub mean: f64,
    /// Standard deviation of that mean, by the film's own variances.
    pub sigma: f64,
    /// Deviation in sigma, beyond [`Known::ROUNDING`].
    pub off: f64,
}

impl Known {
    /// Maximum relative rounding error of 256 sums in f32.
    pub const ROUNDING: f64 = 256.0 / 16_777_216.0;

    /// Compares the mean of `pixels` with `want`.
    ///
    /// # Panics
    ///
    /// If there is no pixel, or a sample is missing.
    pub fn of(pixels: impl IntoIterator<Item = PixelTotals>, want: f64) -> Self {
        let (mut mean, mut variance, mut n) = ([0.0; 3], [0.0; 3], 0.0);
        for pixel in pixels {
            assert!(pixel.rejected + pixel.unwritten == 0, "{pixel:?}");
            let (m, v) = (pixel.mean(), pixel.variance_of_mean());
            (0..3).for_each(|c| (mean[c], variance[c]) = (mean[c] + m[c], variance[c] + v[c]));
            n += 1.0;
        }
        let channels = (0..3).map(|c| {
            let (mean, sigma) = (mean[c] / n, variance[c].sqrt() / n);
            let off = ((mean - want).abs() - Self::ROUNDING * want.abs()).max(0.0);
            Self { mean, sigma, off: if off > 0.0 { off / sigma.max(1e-300) } else { off } }
        });
        let most = channels.max_by(|a, b| a.off.total_cmp(&b.off));
        match most {
            Some(known) if n > 0.0 => known,
            _ => panic!("no pixel"),
        }
    }

    /// Returns whether the mean is within [`GLOBAL_LIMIT`] sigma.
    pub fn holds(&self) -> bool {
        self.off < GLOBAL_LIMIT
    }
}

/// Result of [`Blocks::compare`].
#[derive(Clone, Copy, Debug)]
pub struct BlockTest {
    /// Deviation in sigma of the block and channel that differ most.
    pub worst: f64,
    /// Share of blocks and channels within [`PIXEL_LIMIT`].
    pub share: f64,
    /// Deviation in sigma of the whole, of the channel that differs most.
    pub whole: f64,
    /// Ratio of the whole means, by channel.
    pub ratio: [f64; 3],
}

impl BlockTest {
    /// Returns whether the difference is noise: each block within [`PIXEL_LIMIT`], the whole within
    /// [`GLOBAL_LIMIT`].
    pub fn passes(&self) -> bool {
        self.share == 1.0 && self.whole < GLOBAL_LIMIT
    }
}
