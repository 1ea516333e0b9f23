//! Samples against the accumulator.
//!
//! A pixel's samples are counted and numbered in 32 bits, and summed in f32 over chunks, which f64 merges. A chunk of c terms is off by
//! (c - 1) u of its sum at most, n / c chunks by 2⁻⁵³ n / c: together 1.5e-5 for chunks of 256 and any count up to 2³² - 1. That bounds
//! the mean's error for all counts. It would show where it is greater than the noise, 1 / √n of a mean with a deviation as large:
//! from 4.3e9 samples on, more than can be asked for.

use super::ROUNDING;
use super::finding::{Finding, Limit, Predicted, Supported, Unit};
use crate::render::Settings;
use trisect_shared::film::CHUNK_SAMPLES;

/// The greatest relative error that summing `samples` terms of one sign makes.
pub fn accumulation(samples: u32) -> f64 {
    accumulation_of(samples, CHUNK_SAMPLES)
}

/// The same for chunks of another length: at most `samples` of them are added in f32, then the chunks in f64.
pub fn accumulation_of(samples: u32, chunk: u32) -> f64 {
    let terms = samples.min(chunk).max(1);
    let chunks = (f64::from(samples) / f64::from(chunk.max(1))).ceil();
    f64::from(terms - 1) * ROUNDING + (chunks - 1.0).max(0.0) * 0.5 * f64::EPSILON
}

pub(super) fn check(settings: &Settings, found: &mut Vec<Finding>) {
    found.extend(beyond(settings.samples, CHUNK_SAMPLES));
}

fn beyond(samples: u32, chunk: u32) -> Option<Finding> {
    let error = accumulation_of(samples, chunk);
    let noise = 1.0 / f64::from(samples.max(1)).sqrt();
    (error > noise).then(|| Finding {
        limit: Limit::Samples,
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

    #[test]
    fn no_count_is_beyond_chunks_of_256() {
        for samples in [1, 256, 257, 1 << 25, u32::MAX] {
            assert_eq!(beyond(samples, 256), None, "{samples}");
        }
        assert_eq!(beyond(u32::MAX, CHUNK_SAMPLES), None);
        assert!(accumulation(u32::MAX) < 1.6e-5);
    }

    /// The twin: one sum in f32, which stagnates.
    #[test]
    fn one_sum_in_single_precision_is_reported_and_wrong() {
        let mean = |samples: u32, chunk: u32| {
            let mut total = 0.0f64;
            let mut done = 0;
            while done < samples {
                let terms = chunk.min(samples - done);
                total += f64::from((0..terms).fold(0.0f32, |sum, _| sum + 0.1));
                done += terms;
            }
            total / f64::from(samples)
        };
        let samples = 1 << 25;
        let exact = f64::from(0.1f32);
        let finding = beyond(samples, u32::MAX).unwrap();
        assert_eq!((finding.limit, finding.predicted.value), (Limit::Samples, 1.0));
        assert!((mean(samples, u32::MAX) / exact - 1.0).abs() > 0.3);
        let bound = accumulation_of(samples, 256);
        assert!((mean(samples, 256) / exact - 1.0).abs() < bound && bound < 1.6e-5);
    }
}
