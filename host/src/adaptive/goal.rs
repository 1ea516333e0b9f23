//! Samples until the noise is as low as asked for.

use super::noise_map::NoiseMap;
use super::renderer::{AdaptiveRenderer, PassBudget};
use super::{Adaptive, Noise, allocate};
use crate::Error;

/// Samples of each half before anything is decided: the variance of fewer says little.
const FIRST: u32 = 8;

/// A gain below this is within what a survey may be off.
const MIN_GAIN: f64 = 1.15;

/// The same for Sobol's points, which are no longer evenly spread where tiles take some of them.
const MIN_GAIN_SOBOL: f64 = 1.6;

/// The part of the samples that are missing that a step takes.
const STEP: f64 = 0.5;

/// Samples of a step over those that were taken, at most.
const MAX_STEP: f64 = 0.6;

/// The same of one that goes all the way.
const LAST_STEP: f64 = 0.1;

/// What was reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    pub noise: Noise,
    pub adaptive: bool,
    /// By how much adaptive samples should beat uniform ones, by the last survey.
    pub gain: f64,
}

/// Whether samples go where the noise is. `left`: what of the time that leaves for rendering, over what as many samples for each pixel would.
pub(super) fn decide(
    wanted: Adaptive,
    survey: &NoiseMap,
    taker: &AdaptiveRenderer,
    left: f64,
) -> (bool, f64) {
    // One sample has no variance: only the halves' difference tells the noise, by which a half would steer itself.
    if (0..2).any(|half| taker.halves.taken(half).iter().any(|&taken| taken < 2)) {
        return (false, 1.0);
    }
    let gain = allocate::gain(survey, taker.halves.tiles());
    let adaptive = match wanted {
        Adaptive::On => true,
        Adaptive::Off => false,
        Adaptive::Auto => gain * left > if taker.apart() { MIN_GAIN_SOBOL } else { MIN_GAIN },
    };
    (adaptive, gain)
}

/// Takes samples until the estimated error is at most `target`, or each pixel has `most` in the mean. Each survey is better than the last,
/// and rare bright paths make early ones say too much: so no step goes all the way but a short one.
///
/// # Errors
///
/// As rendering.
pub(super) fn reach(
    taker: &mut AdaptiveRenderer,
    target: f64,
    most: u32,
    adaptive: Adaptive,
) -> Result<Reached, Error> {
    // So few that most of them go where the noise is, if that is to be known at all.
    let first = FIRST.min(most / 4).max(2.min(most / 2)).max(1);
    taker.render_uniform(first)?;
    loop {
        let survey = taker.noise_map();
        let (adaptive, gain) = decide(adaptive, &survey, taker, 1.0);
        let samples = taker.mean_samples();
        taker.progress = (target / survey.error).powi(2).max(samples / f64::from(most));
        // A hundredth of a sample is not worth another pass.
        let is_enough = samples + 0.01 >= f64::from(most) || !taker.should_continue();
        if survey.error <= target || is_enough || !survey.error.is_finite() {
            return Ok(Reached { noise: taker.noise(), adaptive, gain });
        }
        let one: f64 = (0..2).map(|half| allocate::work(&survey, taker.halves.tiles(), half, &|_| 1.0)).sum();
        let left = (f64::from(most) - samples) * 0.5 * one;
        let now = samples * 0.5 * one;
        let missing = missing(&survey, taker, target, adaptive, now);
        let step = if missing < LAST_STEP * now { missing } else { (STEP * missing).min(MAX_STEP * now) };
        let more = step.min(left);
        taker.run_pass(&survey, adaptive, &PassBudget { work: &|_| more, max_tile_launches: u32::MAX })?;
    }
}

/// Work until the target, by a survey: at least a fiftieth of what was done by `now`, so that it is reached in a few steps.
fn missing(survey: &NoiseMap, taker: &AdaptiveRenderer, target: f64, adaptive: bool, now: f64) -> f64 {
    let tiles = taker.halves.tiles();
    let ratio = (survey.error / target).powi(2);
    if !adaptive {
        return (now * (ratio - 1.0)).max(0.02 * now);
    }
    let shapes = [0, 1].map(|half| allocate::relative_samples(survey, half, tiles));
    let fillings = [0, 1].map(|half| {
        let taken = taker.halves.taken(half);
        allocate::Allocation::new((survey, tiles), half, &shapes[half], taken, f64::MAX)
    });
    let after = |more: f64| {
        let next = [0, 1].map(|half: usize| fillings[half].next(0.5 * more));
        let count = |half: usize, tile| f64::from(taker.halves.taken(half)[tile]) + next[half](tile);
        allocate::error(survey, tiles, [&|tile| count(0, tile), &|tile| count(1, tile)])
    };
    // Relative to the survey's own sum, whose variances are those within halves.
    let wanted = after(0.0) / ratio;
    let (mut low, mut high) = (0.0, now * (ratio - 1.0).max(0.02));
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if after(middle) > wanted { low = middle } else { high = middle }
    }
    high.max(0.02 * now)
}
