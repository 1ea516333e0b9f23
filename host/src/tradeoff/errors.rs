//! What repetitions of a render show of its error: how much of it is noise, and how much would stay with any number of samples.

use super::reference::{Reference, Truth};
use super::supervisor::{Supervisor, check};
use crate::Error;
use crate::image::Image;
use crate::metrics::{ImageView, MetricsError, REL_MSE_EPSILON as EPSILON};
use crate::statistics::{Interval, Welch, jackknife_error, mean_and_error, quantile, sidak, welch};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Least edge in pixels of the blocks whose means are compared.
const MIN_BLOCK: u32 = 16;

/// Blocks across an image, at most: in smaller ones of few samples, rare bright paths are missing in all repetitions at once, which then agree with each other and not with
/// the truth (seen at 1920x1080, 1 to 16 samples, 4 seeds: Sobol's points were called biased).
const MAX_BLOCKS: u32 = 8;

/// A bias is called one if chance would show as much in one of a thousand.
pub const SIGNIFICANCE: f64 = 1e-3;

/// The error of one way of rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Repetitions.
    pub seeds: usize,
    /// Mean over pixels and channels of (x − r)² / (r² + 0.01).
    pub rel_mse: Interval,
    /// What of it is noise: goes with more samples.
    pub variance: Interval,
    /// What of it stays. May be negative by chance, where there is none.
    pub squared_bias: Interval,
    /// Root of the mean square difference.
    pub rmse: Interval,
    /// Mean LDR-FLIP; of as many repetitions as it was computed for.
    pub flip: Interval,
    /// Mean of all pixels and channels over the reference's, less 1.
    pub brightness: Interval,
    /// The chance of means so different from the reference's without any bias: of the whole, and of up to 64 blocks.
    pub means_p: f64,
    /// The chance of so great a [`squared_bias`](Self::squared_bias) without any.
    pub bias_p: f64,
    /// Whether one of the two is below [`SIGNIFICANCE`], shared between them.
    pub biased: bool,
    /// relMSE by repetition, for tests against others.
    pub each: Vec<f64>,
    /// Pixels with a NaN or infinite value in some image, left out.
    pub left_out: usize,
}

/// Sums over some pixels.
#[derive(Clone)]
struct Products {
    /// Of each pair of repetitions s and t: (x_s − a)(x_t − b) over r² + 0.01, with the reference's halves a and b. Each has an error of its own, so that
    /// the mean of a product is that of the squared difference from the truth.
    relative: Vec<f64>,
    /// (x_s − a)(x_s − b).
    plain: Vec<f64>,
    /// What of the relative products the reference's noise may be.
    reference: f64,
    values: f64,
    left_out: usize,
}

impl Products {
    fn new(seeds: usize) -> Self {
        let (relative, plain) = (vec![0.0; seeds * seeds], vec![0.0; seeds]);
        Self { relative, plain, reference: 0.0, values: 0.0, left_out: 0 }
    }

    fn of(images: &[Image], reference: &Reference, pixels: std::ops::Range<usize>) -> Self {
        let n = images.len();
        let mut sums = Self::new(n);
        let (mut from_a, mut from_b) = (vec![0.0; n], vec![0.0; n]);
        for pixel in pixels {
            let (a, b) = (reference.halves[0].pixels[pixel], reference.halves[1].pixels[pixel]);
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
                // Each half has twice the variance of their mean.
                let noise = 2.0 * f64::from(reference.variance[pixel][c]) * weight;
                sums.reference += noise * noise;
                sums.values += 1.0;
            }
        }
        sums
    }

    fn add(mut self, other: &Self) -> Self {
        self.relative.iter_mut().zip(&other.relative).for_each(|(a, b)| *a += b);
        self.plain.iter_mut().zip(&other.plain).for_each(|(a, b)| *a += b);
        self.reference += other.reference;
        self.values += other.values;
        self.left_out += other.left_out;
        self
    }
}

/// Mean over pairs of different repetitions, but for one of them.
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

/// The same of pairs of one with itself.
fn within(relative: &[f64], n: usize, without: Option<usize>) -> f64 {
    let each = (0..n).filter(|&s| Some(s) != without);
    each.clone().map(|s| relative[s * n + s]).sum::<f64>() / each.count().max(1) as f64
}

impl Errors {
    /// Of images of one scene by different random numbers, all of the reference's size, and the
    /// FLIP of some of them.
    ///
    /// # Errors
    ///
    /// [`MetricsError`] for images of another size, or fewer than two.
    pub fn of(images: &[Image], truth: &Truth, flips: &[f64]) -> Result<Self, MetricsError> {
        let n = images.len();
        if n < 2 {
            return Err(MetricsError::TooFewImages { count: n });
        }
        let Truth { reference, image: r, .. } = truth;
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
            parts.map(|i| Products::of(images, reference, i * 1024..((i + 1) * 1024).min(pixels))).collect();
        let sums = parts.iter().fold(Products::new(n), Products::add);
        let values = sums.values.max(1.0);
        let relative: Vec<f64> = sums.relative.iter().map(|sum| sum / values).collect();
        let freedom = n as f64 - 1.0;

        let each: Vec<f64> = (0..n).map(|s| relative[s * n + s]).collect();
        let bias = between(&relative, n, None);
        let leave_out =
            |of: &dyn Fn(Option<usize>) -> f64| -> Vec<f64> { (0..n).map(|s| of(Some(s))).collect() };
        let of_reference = sums.reference.sqrt() / values;
        let of_bias = |without| between(&relative, n, without);
        let bias_error = jackknife_error(&leave_out(&of_bias)).hypot(of_reference);
        let of_variance = |without| within(&relative, n, without) - between(&relative, n, without);
        let variance_error = jackknife_error(&leave_out(&of_variance));
        let squared: Vec<f64> = sums.plain.iter().map(|sum| sum / values).collect();
        // One-sided: less than none is none.
        let bias_p = 0.5 * welch((bias, bias_error, freedom), (0.0, 0.0, f64::INFINITY)).p;
        let bias_p = if bias > 0.0 { bias_p } else { 1.0 - bias_p };
        let (brightness, means_p) = means(images, truth);
        Ok(Self {
            seeds: n,
            rel_mse: Interval::of_mean(&each),
            variance: Interval::of(of_variance(None), variance_error, freedom),
            squared_bias: Interval::of(bias, bias_error, freedom),
            rmse: Interval::of_mean(&squared).map(|value| value.max(0.0).sqrt()),
            flip: Interval::of_mean(flips),
            brightness,
            means_p,
            bias_p,
            biased: sidak(means_p.min(bias_p), 2) < SIGNIFICANCE,
            each,
            left_out: sums.left_out,
        })
    }

    /// Whether two ways differ in relMSE, by the logarithms of what each repetition has: their spread is a factor.
    pub fn differs(&self, other: &Self) -> Welch {
        let of = |errors: &Self| {
            let logs: Vec<f64> = errors.each.iter().map(|each| each.max(1e-300).ln()).collect();
            let (mean, error) = mean_and_error(&logs);
            (mean, error, logs.len() as f64 - 1.0)
        };
        welch(of(self), of(other))
    }

    /// 1 / (relMSE × seconds), with what the error's interval leaves of it.
    pub fn efficiency(&self, seconds: f64) -> Interval {
        self.rel_mse.map(|error| 1.0 / (error.max(1e-300) * seconds))
    }
}

/// Returns the mean LDR-FLIP of each of the first `count` images; [`Error::Cancelled`] if the
/// supervisor ends it between two of them.
pub(super) fn flips(
    images: &[Image],
    truth: &Truth,
    count: usize,
    supervisor: &dyn Supervisor,
) -> Result<Vec<f64>, Error> {
    let of = |image: &Image| {
        check(supervisor)?;
        Ok(truth.seen.flip(&view(image))?.mean)
    };
    images.iter().take(count).map(of).collect()
}

pub(super) fn view(image: &Image) -> ImageView<'_> {
    ImageView { width: image.width as usize, height: image.height as usize, pixels: &image.pixels }
}

/// Means of blocks and of the whole, all channels together, of an image.
fn blocks(width: u32, height: u32, value: impl Fn(usize) -> f64 + Sync) -> Vec<(f64, f64)> {
    let edge = width.max(height).div_ceil(MAX_BLOCKS).max(MIN_BLOCK);
    let across = width.div_ceil(edge);
    let of = |block: u32| {
        let (x, y) = (block % across * edge, block / across * edge);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in y..(y + edge).min(height) {
            for x in x..(x + edge).min(width) {
                let value = value(y as usize * width as usize + x as usize);
                if value.is_finite() {
                    sum += value;
                    count += 1.0;
                }
            }
        }
        (sum, count)
    };
    (0..across * height.div_ceil(edge)).into_par_iter().map(of).collect()
}

/// Means of blocks and of the whole of each of several images, in the same order.
pub(super) struct Means {
    /// By block: of each image.
    blocks: Vec<Vec<f64>>,
    whole: Vec<f64>,
}

impl Means {
    pub fn of(images: &[Image]) -> Self {
        let all: Vec<Vec<(f64, f64)>> = images
            .iter()
            .map(|image| blocks(image.width, image.height, |pixel| gray(image.pixels[pixel])))
            .collect();
        let mean = |(sum, count): (f64, f64)| sum / count.max(1.0);
        let count = all.first().map_or(0, Vec::len);
        Self {
            blocks: (0..count).map(|block| all.iter().map(|of| mean(of[block])).collect()).collect(),
            whole: all.iter().map(|of| mean(total(of))).collect(),
        }
    }
}

/// Channels of a pixel share their paths: as if they were one.
fn gray(value: [f32; 3]) -> f64 {
    value.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0
}

fn total(blocks: &[(f64, f64)]) -> (f64, f64) {
    blocks.iter().fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1))
}

/// A mean with its standard error and degrees of freedom.
type Measured = (f64, f64, f64);

fn measured(values: &[f64]) -> Measured {
    let (mean, error) = mean_and_error(values);
    (mean, error, values.len() as f64 - 1.0)
}

/// Welch's test, blind to what sums in f32 and their rounding may be off.
fn test(a: Measured, b: Measured) -> Welch {
    let rounding = 1e-6 * a.0.abs().max(b.0.abs());
    let off = a.0 - b.0;
    let a_mean = if off.abs() <= rounding { b.0 } else { a.0 - rounding * off.signum() };
    welch((a_mean, a.1, a.2), b)
}

/// By how much two wholes differ, relative; and the chance that they and their blocks differ as much.
fn compare(whole: (Measured, Measured), of_blocks: Vec<f64>) -> (Interval, f64) {
    let (a, b) = whole;
    let found = test(a, b);
    let least = of_blocks.iter().copied().fold(1.0, f64::min);
    let p = sidak(found.p.min(sidak(least, of_blocks.len())), 2);
    let scale = b.0.abs().max(1e-300);
    let half = quantile(crate::statistics::CONFIDENCE, found.freedom.max(1.0)) * a.1.hypot(b.1) / scale;
    let value = (a.0 - b.0) / scale;
    (Interval { value, low: value - half, high: value + half }, p)
}

/// The mean over all pixels less the reference's, relative; and the chance that means differ as much as they do.
fn means(images: &[Image], truth: &Truth) -> (Interval, f64) {
    let own = Means::of(images);
    let Truth { reference, image: r, .. } = truth;
    let of_reference = blocks(r.width, r.height, |pixel| gray(r.pixels[pixel]));
    let noise = blocks(r.width, r.height, |pixel| gray(reference.variance[pixel]));
    let known = |(sum, count): (f64, f64), variance: f64| {
        let count = count.max(1.0);
        (sum / count, variance.max(0.0).sqrt() / count, f64::INFINITY)
    };
    let each = own.blocks.iter().zip(of_reference.iter().zip(&noise));
    let of_blocks = each.map(|(own, (&block, noise))| test(measured(own), known(block, noise.0)).p).collect();
    compare((measured(&own.whole), known(total(&of_reference), total(&noise).0)), of_blocks)
}

/// The mean over all pixels of some images less that of others, relative; and the chance that means differ as much, if they converge to one image.
pub(super) fn difference(a: &Means, b: &Means) -> (Interval, f64) {
    let of_blocks = a.blocks.iter().zip(&b.blocks).map(|(a, b)| test(measured(a), measured(b)).p).collect();
    compare((measured(&a.whole), measured(&b.whole)), of_blocks)
}

#[cfg(test)]
mod tests;
