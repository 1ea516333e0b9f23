//! Checks the number of samples against the accumulator.
//!
//! A pixel's samples are counted and numbered in 32 bits, and summed over chunks in f32 with a
//! compensation for what is rounded off. The film's sums over chunks are exact. So a mean is off by
//! one rounding of each chunk, u = 2⁻²⁴ relative, for any count. That exceeds the noise, 1 / √n of
//! a mean with as large a deviation, from 2.8e14 samples on: more than can be requested.

use super::ROUNDING;
use super::finding::{Finding, Limit, Predicted, Severity, Supported, Unit};
use crate::ImageSettings;

/// Maximum relative error of summing any number of terms of one sign, with compensation.
pub const ACCUMULATION: f64 = ROUNDING;

/// Returns the maximum relative error of one plain f32 sum of `terms` terms, without compensation.
pub fn plain_accumulation(terms: u32) -> f64 {
    f64::from(terms.saturating_sub(1)) * ROUNDING
}

pub(super) fn check(image: &ImageSettings, found: &mut Vec<Finding>) {
    found.extend(beyond(image.samples, ACCUMULATION));
}

fn beyond(samples: u32, error: f64) -> Option<Finding> {
    let noise = 1.0 / f64::from(samples.max(1)).sqrt();
    (error > noise).then(|| Finding {
        limit: Limit::Samples,
        severity: Severity::Warning,
        triangles: None,
        what: "image.samples".to_owned(),
        quantity: "samples a pixel",
        measured: f64::from(samples),
        supported: Supported::AtMost(error.powi(-2)),
        predicted: Predicted::share(error, Unit::Mean),
        remedy: "render fewer samples with several seeds, and average the images",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use trisect_shared::film::{CHUNK_SAMPLES, Compensation, PixelSums};

    #[test]
    fn no_count_is_beyond_carried_sums() {
        for samples in [1, 256, 257, 1 << 25, u32::MAX] {
            assert_eq!(beyond(samples, ACCUMULATION), None, "{samples}");
        }
    }

    /// Negative control: one plain f32 sum, which stagnates.
    #[test]
    fn one_sum_in_single_precision_is_reported_and_wrong() {
        let samples = 1 << 25;
        let finding = beyond(samples, plain_accumulation(samples)).unwrap();
        assert_eq!((finding.limit, finding.predicted.value), (Limit::Samples, 1.0));
        let mean = (0..samples).fold(0.0f32, |sum, _| sum + 0.1) / samples as f32;
        assert!((f64::from(mean) / f64::from(0.1f32) - 1.0).abs() > 0.3);
    }

    #[test]
    fn a_carried_chunk_rounds_once() {
        let (mut sums, mut carry) = (PixelSums::ZERO, Compensation::ZERO);
        (0..CHUNK_SAMPLES).for_each(|_| sums.add(Vec3::splat(0.1), &mut carry, 0));
        sums.compensate(carry);
        let mean = f64::from(sums.radiance.x) / f64::from(CHUNK_SAMPLES);
        assert!((mean / f64::from(0.1f32) - 1.0).abs() <= ACCUMULATION);
    }
}
