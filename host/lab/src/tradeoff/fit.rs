//! Chooses numbers of samples that fit a measurement into a given time.

use std::time::Duration;

/// Numbers of samples and repetitions that approximately fit a given time.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Samples per pixel, ascending.
    pub levels: Vec<u32>,
    /// Repetitions (seeds).
    pub seeds: usize,
    /// Time for the reference.
    pub reference: Duration,
}

/// Share of the time for the reference.
pub const REFERENCE_SHARE: f64 = 0.35;

/// Minimum and maximum time for rendering a reference.
const REFERENCE_TIMES: (Duration, Duration) = (Duration::from_millis(1), Duration::from_secs(1_000_000));

/// Numbers of samples per pixel for each configuration.
const LEVELS: u32 = 3;

/// Divides `time`: [`REFERENCE_SHARE`] for the reference, the rest for `modes` configurations with
/// three numbers of samples, each four times the one before, and `seeds` repetitions.
///
/// `each`: seconds per sample of each pixel; `fixed`: fixed seconds of an image; `analysis`:
/// seconds that an image takes besides rendering.
pub fn fit(time: Duration, modes: usize, seeds: usize, (each, fixed): (f64, f64), analysis: f64) -> Fit {
    let reference = time.mul_f64(REFERENCE_SHARE).clamp(REFERENCE_TIMES.0, REFERENCE_TIMES.1);
    let rest = time.as_secs_f64() * (1.0 - REFERENCE_SHARE) * 0.8;
    let images = (modes * seeds) as f64;
    let overhead = images * f64::from(LEVELS) * (fixed + analysis);
    // All levels take 1 + 1/4 + 1/16 times the highest. Some configurations take twice as long as
    // the base.
    let most = ((rest - overhead) / (images * 1.3125 * each)).max(1.0);
    let top = most.log2().floor().clamp(4.0, 16.0) as i32;
    let levels = (0..LEVELS as i32).rev().map(|k| 1u32 << (top - 2 * k).max(0)).collect();
    Fit { levels, seeds, reference }
}
