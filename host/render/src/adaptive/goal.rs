//! Rendering until the noise is below a target, for [`Goal::Error`](super::Goal::Error).

use super::noise_map::NoiseMap;
use super::renderer::AdaptiveRenderer;
use super::sampling_pass::PassBudget;
use super::{Adaptive, Noise, allocate};
use crate::Error;
use web_time::Instant;

/// Samples of each half before the first decision: the variance of fewer says little.
const FIRST: u32 = 8;

/// Minimum estimated gain for adaptive sampling; a smaller one is within the error of a noise map.
const MIN_GAIN: f64 = 1.15;

/// Minimum estimated gain with Sobol samples, which are no longer evenly spread if tiles take only
/// some of them.
const MIN_GAIN_SOBOL: f64 = 1.6;

/// Share of the missing samples that a step takes.
const STEP: f64 = 0.5;

/// Maximum samples of a step, relative to those already taken.
const MAX_STEP: f64 = 0.6;

/// Maximum samples of a step that takes all missing samples, relative to those already taken.
const LAST_STEP: f64 = 0.1;

/// Samples per pixel that are not worth another pass.
const ENOUGH: f64 = 0.01;

/// Samples that a pass aims at beyond the maximum, relative to it, so that no other pass follows
/// for a few samples.
const BEYOND: f64 = 0.002;

/// Maximum work of a sample where samples went relative to the mean over the image.
const MAX_COSTLIER: f64 = 2.0;

/// Result of a render with a target error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    pub noise: Noise,
    pub adaptive: bool,
    /// Estimated gain of adaptive over uniform sampling, by the last noise map.
    pub gain: f64,
}

/// Decides whether samples are distributed by noise; returns the decision, and the estimated gain
/// if that was needed. `left` is the share of the time that adaptive passes leave for rendering,
/// relative to uniform passes.
pub(super) fn decide(
    wanted: Adaptive,
    noise_map: &NoiseMap,
    renderer: &AdaptiveRenderer,
    left: f64,
) -> (bool, Option<f64>) {
    match wanted {
        Adaptive::On => (has_variance(renderer), None),
        Adaptive::Off => (false, None),
        Adaptive::Auto => {
            let gain = gain(noise_map, renderer);
            let least = if renderer.variance_from_halves() { MIN_GAIN_SOBOL } else { MIN_GAIN };
            (gain * left > least, Some(gain))
        }
    }
}

/// Returns the estimated gain of adaptive over uniform sampling.
pub(super) fn gain(noise_map: &NoiseMap, renderer: &AdaptiveRenderer) -> f64 {
    if has_variance(renderer) { allocate::gain(noise_map, renderer.halves.tiles()) } else { 1.0 }
}

/// Returns whether all pixels have a variance: one sample has none. Only the difference of the
/// halves would give the noise, and that depends on both halves: each would steer itself.
fn has_variance(renderer: &AdaptiveRenderer) -> bool {
    (0..2).all(|half| renderer.halves.taken(half).iter().all(|&taken| taken >= 2))
}

/// Takes samples until the estimated error is at most `target`, or the mean samples per pixel reach
/// `most`. Each noise map is better than the last, and rare bright paths make early ones
/// overestimate. So only a short step takes all missing samples.
///
/// # Errors
///
/// Errors of rendering.
pub(super) fn reach(
    renderer: &mut AdaptiveRenderer,
    target: f64,
    most: u32,
    adaptive: Adaptive,
) -> Result<Reached, Error> {
    // Few, so that most samples are distributed by noise, but enough to estimate the noise.
    let first = FIRST.min(most / 4).max(2.min(most / 2)).max(1);
    let start = Instant::now();
    renderer.render_uniform(first)?;
    // Samples where the noise is may take more work than the mean.
    let mut costlier = 1.0;
    loop {
        let samples = renderer.mean_samples();
        let is_enough = samples + ENOUGH >= f64::from(most) || !renderer.should_continue();
        let (noise_map, noise) = match is_enough {
            true => renderer.noise().map(|(noise_map, noise)| (noise_map, Some(noise)))?,
            false => (renderer.noise_map()?, None),
        };
        let (adaptive, estimated) = decide(adaptive, &noise_map, renderer, 1.0);
        renderer.progress = (target / noise_map.error).powi(2).max(samples / f64::from(most));
        if noise_map.error <= target || is_enough || !noise_map.error.is_finite() {
            let gain = estimated.unwrap_or_else(|| gain(&noise_map, renderer));
            let noise = noise.map_or_else(|| renderer.noise().map(|(_, noise)| noise), Ok)?;
            return Ok(Reached { noise, adaptive, gain });
        }
        let left = seconds_left(start.elapsed().as_secs_f64(), renderer.progress);
        renderer.report(noise_map.error, Some(target), left);
        let one: f64 =
            (0..2).map(|half| allocate::work(&noise_map, renderer.halves.tiles(), half, &|_| 1.0)).sum();
        let left = ((1.0 + BEYOND) * f64::from(most) - samples) * 0.5 * one * costlier;
        let now = samples * 0.5 * one;
        // More does not change the step.
        let most_missing = left.min(MAX_STEP * now) / STEP;
        let missing = missing(&noise_map, renderer, target, adaptive, (now, most_missing));
        let step = if missing < LAST_STEP * now { missing } else { (STEP * missing).min(MAX_STEP * now) };
        let more = step.min(left);
        renderer.run_pass(
            &noise_map,
            adaptive,
            &PassBudget { work: &|_| more, max_tile_launches: u32::MAX },
        )?;
        let taken = (renderer.mean_samples() - samples) * 0.5 * one;
        costlier = (more / taken).clamp(1.0, MAX_COSTLIER);
    }
}

/// Returns the seconds that are left if `progress` of the image, from 0 to 1, took `seconds`. The
/// error of Sobol samples falls faster than that of independent samples, for which this is meant.
fn seconds_left(seconds: f64, progress: f64) -> f64 {
    seconds * (1.0 / progress - 1.0).max(0.0)
}

/// Returns the work that is missing until the target, by a noise map: at least a fiftieth of the
/// work done, `now`, so that few steps reach the target, and at most `most`.
fn missing(
    noise_map: &NoiseMap,
    renderer: &AdaptiveRenderer,
    target: f64,
    adaptive: bool,
    (now, most): (f64, f64),
) -> f64 {
    let tiles = renderer.halves.tiles();
    let ratio = (noise_map.error / target).powi(2);
    if !adaptive {
        return (now * (ratio - 1.0)).max(0.02 * now).min(most);
    }
    let taken = [0, 1].map(|half| renderer.halves.taken(half));
    let shares = noise_map.shares(tiles);
    let fillings = allocate::Allocation::of_both((noise_map, tiles), shares, taken, f64::MAX);
    let after = |more: f64| {
        let next = [0, 1].map(|half: usize| fillings[half].count_of_tile(0.5 * more));
        let count = |half: usize, tile| f64::from(taken[half][tile]) + next[half](tile);
        allocate::rel_mse(noise_map, tiles, [&|tile| count(0, tile), &|tile| count(1, tile)])
    };
    // Relative to the noise map's own sum, which has the variances within halves.
    let wanted = after(0.0) / ratio;
    let (mut low, mut high) = (0.0, (now * (ratio - 1.0).max(0.02)).min(most));
    if after(high) > wanted {
        return high;
    }
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if after(middle) > wanted { low = middle } else { high = middle }
    }
    high.max(0.02 * now).min(most)
}
