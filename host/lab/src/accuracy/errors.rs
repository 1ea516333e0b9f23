//! Estimates the errors of a configuration from repetitions with different seeds, and separates
//! noise from the bias that any number of samples would leave. Method:
//! docs/explanation/noise-and-bias.md.

use super::means::means;
use super::truth::Truth;
use crate::statistics::{Interval, Welch, jackknife_error, mean_and_error, sidak, welch};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trisect::image::Image;
use trisect::metrics::{MetricsError, REL_MSE_EPSILON as EPSILON};

/// A bias is reported if chance alone would show as much in at most one of a thousand cases.
pub const SIGNIFICANCE: f64 = 1e-3;

/// Error of a configuration with one number of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Errors {
    /// Repetitions.
    pub seeds: usize,
    /// relMSE: mean over pixels and channels of (x − r)² / (r² + 0.01), estimated without the
    /// reference's own noise.
    pub rel_mse: Interval,
    /// Part of relMSE that is noise and falls with more samples.
    pub variance: Interval,
    /// Part of relMSE that more samples do not lower. May be negative by chance if there is no
    /// bias.
    pub squared_bias: Interval,
    /// Root mean square difference from the reference.
    pub rmse: Interval,
    /// Mean LDR-FLIP, over the repetitions for which it was computed.
    pub flip: Interval,
    /// Mean of all pixels and channels over the reference's, less 1.
    pub brightness: Interval,
    /// Probability that the means of the whole image and of up to 64 blocks differ from the
    /// reference's at least as much without a bias.
    pub means_p: f64,
    /// Probability of a [`squared_bias`](Self::squared_bias) at least as large without a bias
    /// (one-sided).
    pub bias_p: f64,
    /// True if a bias was seen: the smaller of the two probabilities, with Šidák's correction, is
    /// below [`SIGNIFICANCE`], and the squared bias or the brightness has an interval without 0 and
    /// is not printed as 0.000 %.
    pub biased: bool,
    /// relMSE of each repetition, for tests against other configurations.
    pub each: Vec<f64>,
    /// Pixels with a NaN or infinite value in any image. They are left out.
    pub left_out: usize,
}

/// Sums of products over a range of pixels.
#[derive(Clone)]
struct Products {
    /// For each pair of repetitions s and t: the sum of (x_s − a)(x_t − b) / (r² + 0.01), with the
    /// reference's halves a and b. The errors of a and b are independent, so the mean of a product
    /// is the mean squared difference from the truth.
    relative: Vec<f64>,
    /// For each repetition s: the sum of (x_s − a)(x_s − b).
    plain: Vec<f64>,
    /// Variance that the reference's noise adds to a sum of relative products, and of plain ones.
    reference: [f64; 2],
    values: f64,
    left_out: usize,
}

impl Products {
    fn new(seeds: usize) -> Self {
        let (relative, plain) = (vec![0.0; seeds * seeds], vec![0.0; seeds]);
        Self { relative, plain, reference: [0.0; 2], values: 0.0, left_out: 0 }
    }

    fn of(images: &[Image], truth: &Truth, pixels: std::ops::Range<usize>) -> Self {
        let n = images.len();
        let mut sums = Self::new(n);
        let (mut from_a, mut from_b) = (vec![0.0; n], vec![0.0; n]);
        for pixel in pixels {
            let [a, b] = truth.halves.map(|half| half.pixels[pixel]);
            let finite = |value: [f32; 3]| value.iter().all(|v| v.is_finite());
            if ![a, b].into_iter().all(finite) || !images.iter().all(|image| finite(image.pixels[pixel])) {
                sums.left_out += 1;
                continue;
            }
            for c in 0..3 {
                let (a, b) = (f64::from(a[c]), f64::from(b[c]));
                let r = 0.5 * (a + b);
                let weight = 1.0 / (r * r + EPSILON);
                for (s, image) in images.iter().enumerate() {
                    let x = f64::from(image.pixels[pixel][c]);
                    (from_a[s], from_b[s]) = (x - a, x - b);
                    sums.plain[s] += from_a[s] * from_b[s];
                }
                for (row, &from_a) in sums.relative.chunks_exact_mut(n).zip(&from_a) {
                    let scaled = weight * from_a;
                    row.iter_mut().zip(&from_b).for_each(|(sum, &from_b)| *sum += scaled * from_b);
                }
                let noise = reference_noise(f64::from(truth.variance[pixel][c]), &from_a, &from_b);
                sums.reference[0] += weight * weight * noise;
                sums.reference[1] += noise;
                sums.values += 1.0;
            }
        }
        sums
    }

    fn add(mut self, other: &Self) -> Self {
        self.relative.iter_mut().zip(&other.relative).for_each(|(a, b)| *a += b);
        self.plain.iter_mut().zip(&other.plain).for_each(|(a, b)| *a += b);
        self.reference.iter_mut().zip(other.reference).for_each(|(a, b)| *a += b);
        self.values += other.values;
        self.left_out += other.left_out;
        self
    }
}

/// Returns the variance that noise of a reference adds to the mean over repetitions of
/// (x_s − a)(x_t − b) in a pixel, from the variance of the mean of a and b and the differences
/// x_s − a and x_t − b. With the errors e and f of a and b, and the bias d, that is the variance of
/// e f − d (e + f).
fn reference_noise(variance: f64, from_a: &[f64], from_b: &[f64]) -> f64 {
    if variance == 0.0 {
        return 0.0;
    }
    let n = from_a.len() as f64;
    let sums = from_a.iter().sum::<f64>() * from_b.iter().sum::<f64>();
    let own: f64 = from_a.iter().zip(from_b).map(|(a, b)| a * b).sum();
    let squared_bias = (sums - own) / (n * (n - 1.0));
    // The variance of each half is twice that of their mean.
    (2.0 * variance).powi(2) + 4.0 * variance * squared_bias
}

/// Returns the mean over pairs of different repetitions, without the repetition `without`.
fn between(relative: &[f64], n: usize, without: Option<usize>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for s in (0..n).filter(|&s| Some(s) != without) {
        for t in (0..n).filter(|&t| t != s && Some(t) != without) {
            sum += relative[s * n + t];
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { f64::NAN }
}

/// Returns the mean over pairs of a repetition with itself, without the repetition `without`.
fn within(relative: &[f64], n: usize, without: Option<usize>) -> f64 {
    let each = (0..n).filter(|&s| Some(s) != without);
    each.clone().map(|s| relative[s * n + s]).sum::<f64>() / each.count().max(1) as f64
}

impl Errors {
    /// Estimates the errors of images of one scene with different seeds, all of the reference's
    /// size. `flips` has the mean FLIP of some of them.
    ///
    /// # Errors
    ///
    /// [`MetricsError`] for images of another size, or fewer than two.
    pub fn of(images: &[Image], truth: &Truth, flips: &[f64]) -> Result<Self, MetricsError> {
        let n = images.len();
        if n < 2 {
            return Err(MetricsError::TooFewImages { count: n });
        }
        let r = truth.image;
        for image in images {
            let (size, of) =
                ((image.width as usize, image.height as usize), (r.width as usize, r.height as usize));
            if size != of || image.pixels.len() != r.pixels.len() {
                return Err(MetricsError::SizeMismatch { image: size, reference: of });
            }
        }
        let pixels = r.pixels.len();
        let parts = (0..pixels.div_ceil(1024)).into_par_iter();
        let parts: Vec<Products> =
            parts.map(|i| Products::of(images, truth, i * 1024..((i + 1) * 1024).min(pixels))).collect();
        let sums = parts.iter().fold(Products::new(n), Products::add);
        let values = sums.values.max(1.0);
        let relative: Vec<f64> = sums.relative.iter().map(|sum| sum / values).collect();
        let freedom = n as f64 - 1.0;

        let each: Vec<f64> = (0..n).map(|s| relative[s * n + s]).collect();
        let bias = between(&relative, n, None);
        let leave_out =
            |of: &dyn Fn(Option<usize>) -> f64| -> Vec<f64> { (0..n).map(|s| of(Some(s))).collect() };
        // A squared bias that is negative by chance does not make the reference's part negative.
        let [of_reference, of_plain] = sums.reference.map(|sum| sum.max(0.0).sqrt() / values);
        let of_mean = |each: &[f64], reference: f64| {
            let (mean, error) = mean_and_error(each);
            Interval::of(mean, error.hypot(reference), freedom)
        };
        let of_bias = |without| between(&relative, n, without);
        let bias_error = jackknife_error(&leave_out(&of_bias)).hypot(of_reference);
        let of_variance = |without| within(&relative, n, without) - between(&relative, n, without);
        let variance_error = jackknife_error(&leave_out(&of_variance));
        let squared: Vec<f64> = sums.plain.iter().map(|sum| sum / values).collect();
        // One-sided: a squared bias below 0 counts as none.
        let bias_p = 0.5 * welch((bias, bias_error, freedom), (0.0, 0.0, f64::INFINITY)).p;
        let bias_p = if bias > 0.0 { bias_p } else { 1.0 - bias_p };
        let (brightness, means_p) = means(images, truth);
        let errors = Self {
            seeds: n,
            rel_mse: of_mean(&each, of_reference),
            variance: Interval::of(of_variance(None), variance_error, freedom),
            squared_bias: Interval::of(bias, bias_error, freedom),
            rmse: of_mean(&squared, of_plain).map(|value| value.max(0.0).sqrt()),
            flip: Interval::of_mean(flips),
            brightness,
            means_p,
            bias_p,
            biased: false,
            each,
            left_out: sums.left_out,
        };
        Ok(Self { biased: errors.bias().is_seen(), ..errors })
    }

    /// Returns whether chance would show as much difference in at most one of a thousand cases.
    pub(super) fn is_significant(&self) -> bool {
        sidak(self.means_p.min(self.bias_p), 2) < SIGNIFICANCE
    }

    /// Tests whether two configurations differ in relMSE: Welch's test of the logarithms by
    /// repetition, because repetitions vary by a factor.
    pub fn differs(&self, other: &Self) -> Welch {
        let of = |errors: &Self| {
            let logs: Vec<f64> = errors.each.iter().map(|each| each.max(1e-300).ln()).collect();
            let (mean, error) = mean_and_error(&logs);
            (mean, error, logs.len() as f64 - 1.0)
        };
        welch(of(self), of(other))
    }

    /// Returns 1 / (relMSE × seconds), with the interval that follows from relMSE's.
    pub fn efficiency(&self, seconds: f64) -> Interval {
        self.rel_mse.map(|error| 1.0 / (error.max(1e-300) * seconds))
    }
}

#[cfg(test)]
mod tests;
