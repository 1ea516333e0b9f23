//! Random words, means with their noise, and Pearson's test.

use trisect_shared::rng::{PathKey, Words};

/// True in a slow build, which checks every access instead.
pub const SLOW: bool = cfg!(debug_assertions);

/// Returns `many` samples, or a twentieth in a slow build.
pub const fn samples(many: u32) -> u32 {
    if SLOW { many / 20 } else { many }
}

pub fn words(stream: u32, i: u32) -> Words {
    PathKey { seed: stream, pixel: i, sample: 0 }.words(0)
}

/// Mean of samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    pub fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    pub fn value(&self) -> f64 {
        self.sum / self.n
    }

    /// Returns the standard deviation of the mean.
    pub fn error(&self) -> f64 {
        let mean = self.value();
        ((self.squares / self.n - mean * mean).max(0.0) / (self.n - 1.0)).sqrt()
    }

    /// Returns whether the mean is `want`, within 4.5 sigma (1 in 150,000) and `rounding`.
    pub fn is(&self, want: f64, rounding: f64) -> bool {
        (self.value() - want).abs() <= 4.5 * self.error() + rounding
    }
}

/// Returns the probability of a chi-square statistic at least as large (Wilson and Hilferty, 1931:
/// its cube root is almost normal; relative error of p below 0.1 for 30 degrees of freedom and p
/// above 1e-5).
pub fn p_value(statistic: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    let z = ((statistic / freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(z / core::f64::consts::SQRT_2)
}

/// Returns the p-value below which one of `tests` tests fails, so that by chance any of them fails
/// with probability 0.0025 (Šidák, 1967).
pub fn sidak(tests: usize) -> f64 {
    1.0 - (1.0f64 - 0.0025).powf(1.0 / tests as f64)
}

/// Returns the p-value of Pearson's test. Cells are pooled, from the least expected on, until each
/// pool expects five.
pub fn chi_square(observed: &[f64], expected: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let mut pooled: Vec<(f64, f64)> = Vec::new();
    let (mut o, mut e) = (0.0, 0.0);
    for i in order {
        (o, e) = (o + observed[i], e + expected[i]);
        if e >= 5.0 {
            pooled.push((o, e));
            (o, e) = (0.0, 0.0);
        }
    }
    assert!(pooled.len() > 30 && e == 0.0, "{} cells, {e} left", pooled.len());
    p_value(pooled.iter().map(|(o, e)| (o - e).powi(2) / e).sum(), pooled.len() as f64 - 1.0)
}

/// Quantiles from tables: 124.342 is exceeded with p = 0.05 for 100 degrees of freedom, 149.449
/// with 0.001.
#[test]
fn p_values_of_tables() {
    for (statistic, freedom, want) in [(124.342, 100.0, 0.05), (149.449, 100.0, 0.001), (50.892, 30.0, 0.01)]
    {
        let p = p_value(statistic, freedom);
        assert!((p / want - 1.0).abs() < 0.03, "{statistic} {freedom}: {p} for {want}");
    }
}
