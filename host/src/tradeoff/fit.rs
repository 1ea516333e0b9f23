//! Numbers of samples that about fit a time.

use std::time::Duration;

/// Numbers of samples and repetitions that about fit a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Samples a pixel.
    pub levels: Vec<u32>,
    /// Repetitions.
    pub seeds: usize,
    /// For the reference.
    pub reference: Duration,
}

/// Share of the time that the reference gets.
pub const REFERENCE_SHARE: f64 = 0.35;

/// Times that a reference can be rendered for.
const REFERENCE_TIMES: (Duration, Duration) = (Duration::from_millis(1), Duration::from_secs(1_000_000));

/// Numbers of samples a pixel of a way.
const LEVELS: u32 = 3;

/// Shares `time` out: a third for the reference, the rest for `configurations` ways of three numbers of
/// samples, each four times the one before. `analysis`: seconds that an image takes beside
/// rendering.
pub fn fit(time: Duration, modes: usize, seeds: usize, (each, fixed): (f64, f64), analysis: f64) -> Fit {
    let reference = time.mul_f64(REFERENCE_SHARE).clamp(REFERENCE_TIMES.0, REFERENCE_TIMES.1);
    let rest = time.as_secs_f64() * (1.0 - REFERENCE_SHARE) * 0.8;
    let images = (modes * seeds) as f64;
    let overhead = images * f64::from(LEVELS) * (fixed + analysis);
    // 1 + 1/4 + 1/16 of the greatest; ways differ, and some take twice as long.
    let most = ((rest - overhead) / (images * 1.3125 * each)).max(1.0);
    let top = most.log2().floor().clamp(4.0, 16.0) as i32;
    let levels = (0..LEVELS as i32).rev().map(|k| 1u32 << (top - 2 * k).max(0)).collect();
    Fit { levels, seeds, reference }
}
