//! Noise of an image, from the sums of two halves that share no random number.
//!
//! The host and the kernels compute it by the same operations, so that samples that go where the
//! noise is give the same image wherever the noise was measured.

use crate::film::PixelSums;
use crate::math::{all_finite, max};
use glam::Vec3;

/// Number that is added to squared means before something is divided by them, as in the image
/// metric relMSE (Rousselle et al., "Adaptive Sampling and Reconstruction using Greedy Error
/// Minimization", 2011).
pub const EPSILON: f32 = 0.01;

/// Squared relative error of a pixel, and the relative variance and work of each half's samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelNoise {
    /// Squared error of the mean of both halves over mean² + 0.01, mean over channels.
    pub error: f32,
    /// Variance of one sample over mean² + 0.01, mean over channels, by half.
    pub variance: (f32, f32),
    /// Segments per sample, by half.
    pub work: (f32, f32),
}

/// Mean, variance and work of a half's samples of a pixel.
#[derive(Clone, Copy)]
struct Half {
    count: f32,
    mean: Vec3,
    /// Variance of the mean, from the samples; 0 with fewer than two.
    variance: Vec3,
    work: f32,
    /// False without samples, or if a sum is NaN or infinite.
    is_usable: bool,
}

#[inline(always)]
fn sum(v: Vec3) -> f32 {
    v.x + v.y + v.z
}

/// Returns 1 / (3 (mean² + 0.01)) of each channel.
#[inline(always)]
fn weight(mean: Vec3) -> Vec3 {
    let of = |mean: f32| 1.0 / (3.0 * (mean * mean + EPSILON));
    Vec3::new(of(mean.x), of(mean.y), of(mean.z))
}

impl Half {
    #[inline(always)]
    fn of(sums: PixelSums) -> Self {
        let count = sums.samples as f32;
        let is_usable = sums.samples > 0 && all_finite(sums.radiance) && all_finite(sums.squares);
        let inverse = if sums.samples > 0 { 1.0 / count } else { 0.0 };
        let work = sums.segments as f32 * inverse;
        let (mut mean, mut variance) = (Vec3::ZERO, Vec3::ZERO);
        if is_usable {
            mean = sums.radiance * inverse;
        }
        if is_usable && sums.samples > 1 {
            let off = (sums.squares * inverse - mean * mean) * (1.0 / (count - 1.0));
            variance = Vec3::new(max(off.x, 0.0), max(off.y, 0.0), max(off.z, 0.0));
        }
        Self { count, mean, variance, work, is_usable }
    }
}

impl PixelNoise {
    /// No noise.
    pub const ZERO: Self = Self { error: 0.0, variance: (0.0, 0.0), work: (0.0, 0.0) };

    /// Returns the noise of a pixel with these sums. Its error follows from the variances within
    /// the halves; or from the difference of the halves if `from_halves`, or if one has fewer than
    /// two samples. More samples would not lower the noise of a pixel that is not finite: it
    /// counts as 0.
    #[inline(always)]
    pub fn of(first: PixelSums, second: PixelSums, from_halves: bool) -> Self {
        let (a, b) = (Half::of(first), Half::of(second));
        let none = Self { work: (a.work, b.work), ..Self::ZERO };
        if !a.is_usable || !b.is_usable {
            return none;
        }
        let off = a.mean - b.mean;
        let difference = off * off * 0.25;
        let both = weight((a.mean + b.mean) * 0.5);
        // A variance that decides about the other half must not depend on that half. The difference
        // of the halves does, but there is no other estimate for few samples.
        let (mut variances, mut weights) = ((a.variance, b.variance), (both, both));
        if a.count < 2.0 {
            variances.0 = difference * 2.0;
        } else {
            weights.0 = weight(a.mean);
        }
        if b.count < 2.0 {
            variances.1 = difference * 2.0;
        } else {
            weights.1 = weight(b.mean);
        }
        let squared = if from_halves || a.count < 2.0 || b.count < 2.0 {
            difference
        } else {
            (variances.0 + variances.1) * 0.25
        };
        let error = sum(both * squared);
        let variance = (sum(variances.0 * a.count * weights.0), sum(variances.1 * b.count * weights.1));
        if all_finite(Vec3::new(error, variance.0, variance.1)) {
            Self { error, variance, ..none }
        } else {
            none
        }
    }

    /// Adds that of another pixel of a tile, in the order of pixels.
    #[inline(always)]
    pub fn add(&mut self, other: Self) {
        self.error += other.error;
        self.variance.0 += other.variance.0;
        self.variance.1 += other.variance.1;
        self.work.0 += other.work.0;
        self.work.1 += other.work.1;
    }

    /// Returns the mean over so many pixels.
    #[inline(always)]
    pub fn mean(&self, pixels: u32) -> Self {
        let share = 1.0 / pixels as f32;
        Self {
            error: self.error * share,
            variance: (self.variance.0 * share, self.variance.1 * share),
            work: (self.work.0 * share, self.work.1 * share),
        }
    }
}
