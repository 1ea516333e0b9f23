//! Compares means of images and of their blocks, which show a bias that the noise of pixels hides.

use super::truth::Truth;
use crate::statistics::{CONFIDENCE, Interval, Welch, mean_and_error, quantile, sidak, welch};
use rayon::prelude::*;
use trisect::image::Image;

/// Minimum edge, in pixels, of the blocks whose means are compared.
const MIN_BLOCK: u32 = 16;

/// Maximum number of blocks across an image. In smaller blocks with few samples, rare bright paths
/// are missing from all repetitions at once. The repetitions then agree with each other but not
/// with the truth, which looks like a bias (docs/notebook/tradeoff-fronts.md).
const MAX_BLOCKS: u32 = 8;

/// Returns the sum over each block of an image and the number of its finite values, block rows from
/// the top.
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

/// Means of the blocks and of the whole image, for several images in the same order.
pub(crate) struct Means {
    /// Mean of each block in each image: `blocks[block][image]`.
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

/// Returns the mean of a pixel's channels. They share paths, so they count as one value.
fn gray(value: [f32; 3]) -> f64 {
    value.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0
}

fn total(blocks: &[(f64, f64)]) -> (f64, f64) {
    blocks.iter().fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1))
}

/// Mean, standard error and degrees of freedom.
type Measured = (f64, f64, f64);

fn measured(values: &[f64]) -> Measured {
    let (mean, error) = mean_and_error(values);
    (mean, error, values.len() as f64 - 1.0)
}

/// Returns Welch's test of two means. Differences within the rounding of f32 sums (1e-6 of the
/// larger mean) count as none.
fn test(a: Measured, b: Measured) -> Welch {
    let rounding = 1e-6 * a.0.abs().max(b.0.abs());
    let off = a.0 - b.0;
    let a_mean = if off.abs() <= rounding { b.0 } else { a.0 - rounding * off.signum() };
    welch((a_mean, a.1, a.2), b)
}

/// Returns the relative difference of two means of the whole image, and the probability that they
/// and the blocks' means differ at least as much by chance.
fn compare(whole: (Measured, Measured), of_blocks: Vec<f64>) -> (Interval, f64) {
    let (a, b) = whole;
    let found = test(a, b);
    let least = of_blocks.iter().copied().fold(1.0, f64::min);
    let p = sidak(found.p.min(sidak(least, of_blocks.len())), 2);
    let scale = b.0.abs().max(1e-300);
    let half = quantile(CONFIDENCE, found.freedom.max(1.0)) * a.1.hypot(b.1) / scale;
    let value = (a.0 - b.0) / scale;
    (Interval { value, low: value - half, high: value + half }, p)
}

/// Returns the relative difference of the image's mean from the reference's, and the probability
/// that the means of image and blocks differ at least as much without a bias.
pub(super) fn means(images: &[Image], truth: &Truth) -> (Interval, f64) {
    let own = Means::of(images);
    if truth.repetitions.len() > 1 {
        return difference(&own, &Means::of(truth.repetitions));
    }
    let r = truth.image;
    let of_reference = blocks(r.width, r.height, |pixel| gray(r.pixels[pixel]));
    let noise = blocks(r.width, r.height, |pixel| gray(truth.variance[pixel]));
    let known = |(sum, count): (f64, f64), variance: f64| {
        let count = count.max(1.0);
        (sum / count, variance.max(0.0).sqrt() / count, f64::INFINITY)
    };
    let each = own.blocks.iter().zip(of_reference.iter().zip(&noise));
    let of_blocks = each.map(|(own, (&block, noise))| test(measured(own), known(block, noise.0)).p).collect();
    compare((measured(&own.whole), known(total(&of_reference), total(&noise).0)), of_blocks)
}

/// Returns the relative difference of the mean over all pixels between two configurations, and the
/// probability that means differ at least as much if both converge to one image.
pub(crate) fn difference(a: &Means, b: &Means) -> (Interval, f64) {
    let of_blocks = a.blocks.iter().zip(&b.blocks).map(|(a, b)| test(measured(a), measured(b)).p).collect();
    compare((measured(&a.whole), measured(&b.whole)), of_blocks)
}
