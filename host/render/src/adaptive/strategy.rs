//! Choice of the best sampling strategy for a scene, by trials on some rows.

use super::dual_buffers::DualBuffers;
use super::grace_period::StopPoll;
use super::mean_and_error;
use super::noise_map::NoiseMap;
use super::renderer::of_half;
use super::{Free, Trial};
use crate::Error;
use crate::film::RowSet;
use crate::render::{RenderObserver, Renderer, Sampler, Settings};
use std::time::Duration;
use trisect_device::DeviceKind;
use trisect_shared::film::CHUNK_SAMPLES;
use web_time::Instant;

/// Number of rows rendered to compile the kernels: those of a tile.
const WARM_UP_ROWS: u32 = 8;

/// Minimum number of rows of a trial.
const MIN_TRIAL_ROWS: u32 = 4;

/// First segment of roulette in a trial: from the first segment on, roulette makes more noise than
/// it saves (docs/notebook/tradeoff-fronts.md).
const ROULETTE_FROM: u32 = 4;

/// Mask of the seed for trials, so that they share no random numbers with the image.
const TRIAL_SEED: u32 = 0x85eb_ca6b;

/// Number of pixels that keep a GPU busy.
const BUSY_PIXELS: u64 = 150_000;

/// Maximum cost of another strategy relative to the first; a smaller gain is not worth the
/// uncertainty.
const BETTER: f64 = 0.95;

/// Prior knowledge of a strategy: mean of the logarithm of its relMSE over that of the first
/// strategy at equal samples, and its standard deviation over scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Prior {
    mean: f64,
    spread: f64,
}

/// Prior of Sobol samples. The mean is the geometric mean over the test scenes
/// (docs/notebook/tradeoff-fronts.md).
const SOBOL: Prior = Prior { mean: -0.8, spread: 0.5 };

/// Standard error of the logarithm of a trial with one sample, if its sampler differs from that of
/// the first strategy.
const EARLY: f64 = 1.5;

/// Prior of roulette from the fourth segment on: slightly more noise, for fewer segments.
const ROULETTE: Prior = Prior { mean: 0.1, spread: 0.2 };

impl Prior {
    /// Returns the prior of a strategy relative to the first one.
    fn of(first: &Settings, way: &Settings) -> Self {
        let mut known = Self { mean: 0.0, spread: 0.0 };
        for (differs, on, what) in [
            (first.sampler != way.sampler, way.sampler == Sampler::Sobol, SOBOL),
            (first.roulette != way.roulette, way.roulette, ROULETTE),
        ] {
            if differs {
                known.mean += if on { what.mean } else { -what.mean };
                known.spread = known.spread.hypot(what.spread);
            }
        }
        known
    }

    /// Returns the mean after a trial has shown a logarithm with a standard error. A trial in which
    /// a few bright pixels make all the noise says nothing.
    fn after(self, shown: f64, error: f64) -> f64 {
        let (before, now) = (self.spread.powi(-2), error.powi(-2));
        match (now.is_finite() && shown.is_finite(), before.is_finite()) {
            (true, true) => (self.mean * before + shown * now) / (before + now),
            (true, false) | (false, _) => self.mean,
        }
    }
}

/// Returns the strategies that may be chosen besides that of the settings.
pub(super) fn candidates(settings: &Settings, free: Free) -> Vec<Settings> {
    let mut ways = Vec::new();
    for turn in 1..4u8 {
        let (roulette, sampler) = (turn & 1 != 0, turn & 2 != 0);
        if roulette && !free.roulette || sampler && !free.sampler {
            continue;
        }
        let mut way = settings.clone();
        if roulette {
            way.roulette = !settings.roulette;
            if free.roulette_depth {
                way.roulette_depth = ROULETTE_FROM.min(settings.depth);
            }
        }
        if sampler {
            way.sampler = match settings.sampler {
                Sampler::Independent => Sampler::Sobol,
                Sampler::Sobol => Sampler::Independent,
            };
        }
        ways.push(way);
    }
    ways
}

fn name(way: &Settings) -> String {
    let sampler = match way.sampler {
        Sampler::Independent => "independent samples",
        Sampler::Sobol => "Sobol's samples",
    };
    let roulette = match way.roulette {
        true => format!("roulette from segment {}", way.roulette_depth),
        false => "no roulette".to_owned(),
    };
    format!("{sampler}, {roulette}")
}

/// Returns the settings of a trial's half. The image uses other random numbers: otherwise a
/// strategy that looks good by the noise of its trial would be chosen together with that noise.
fn of_trial(way: &Settings, half: usize) -> Settings {
    of_half(&Settings { seed: way.seed ^ TRIAL_SEED, ..way.clone() }, half)
}

/// Compiles the kernels of a strategy. The image has the size of the render, so that its memory is
/// allocated, too.
pub(super) fn warm_up(
    renderer: &mut Renderer,
    way: &Settings,
    observer: &mut dyn RenderObserver,
) -> Result<(), Error> {
    let rows = RowSet::from(0..way.height.min(WARM_UP_ROWS));
    renderer.render_chunk(&of_half(way, 0), &rows, 0..1, &mut StopPoll(observer, 0)).map(|_| ())
}

/// Returns rows for trials, evenly spread over the image.
fn trial_rows(renderer: &Renderer, settings: &Settings) -> RowSet {
    let least = match renderer.device().info().kind {
        DeviceKind::Gpu => BUSY_PIXELS.div_ceil(u64::from(settings.width)) as u32,
        _ => MIN_TRIAL_ROWS,
    };
    let of = (settings.height / least.max(MIN_TRIAL_ROWS)).max(1);
    RowSet::interleaved(settings.height, 0, of / 2, of)
}

/// Returns the logarithm of the ratio of two means over tiles, and its standard error (to first
/// order in the deviations of the tiles).
fn log_ratio(of: &[f64], to: &[f64]) -> (f64, f64) {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (of_mean, to_mean) = (mean(of), mean(to));
    let off: Vec<f64> = of.iter().zip(to).map(|(a, b)| a / of_mean - b / to_mean).collect();
    ((of_mean / to_mean).ln(), mean_and_error(&off).1)
}

/// Tries the first strategy and the others for about `slice` each. Returns the best one, the
/// trials, and the expected error of the best after `time`.
pub(super) fn choose_strategy(
    renderer: &mut Renderer,
    (first, others): (&Settings, &[Settings]),
    (slice, time): (Duration, Duration),
    observer: &mut dyn RenderObserver,
) -> Result<(Settings, Vec<Trial>, f64), Error> {
    let rows = trial_rows(renderer, first);
    // The same number of samples for all strategies, because the gain of Sobol samples depends on
    // it. By device time: the host's cost of a launch does not grow with the samples.
    let mut samples = 1;
    let mut beside;
    loop {
        let start = Instant::now();
        let sums =
            renderer.render_chunk(&of_trial(first, 0), &rows, 0..samples, &mut StopPoll(observer, 0))?;
        let took = sums.device;
        beside = start.elapsed().saturating_sub(took);
        if took * 3 > slice || samples == CHUNK_SAMPLES {
            break;
        }
        let fits = slice.as_secs_f64() / 2.0 / took.as_secs_f64().max(1e-6);
        let grown = f64::from(samples) * fits.clamp(1.0, 16.0);
        // A power of two, for Sobol samples.
        let grown = 1 << (grown.max(1.0).log2() as u32).min(CHUNK_SAMPLES.ilog2());
        if grown <= samples {
            break;
        }
        samples = grown;
    }
    // If launches take longer than their rendering, only the first strategy is tried, to see how
    // noisy the image is.
    let others = if beside > 4 * slice { &[] } else { others };
    let ways: Vec<&Settings> = std::iter::once(first).chain(others).collect();
    let mut trials = Vec::new();
    let mut noises: Vec<Vec<f64>> = Vec::new();
    let mut halves = DualBuffers::new(first.width, rows.len());
    for &way in &ways {
        halves.clear();
        let mut device = [Duration::ZERO; 2];
        for (half, device) in device.iter_mut().enumerate() {
            let sums =
                renderer.render_chunk(&of_trial(way, half), &rows, 0..samples, &mut StopPoll(observer, 0))?;
            *device = sums.device;
            halves.add(half, sums.pixels, samples);
        }
        // Both halves are equal work: the slower one was disturbed.
        let seconds = 2.0 * device[0].min(device[1]).as_secs_f64();
        let noise_map = NoiseMap::new(&halves, way.sampler == Sampler::Sobol);
        let error = noise_map.error;
        noises.push(noise_map.tiles.iter().map(|tile| tile.error).collect());
        trials.push(Trial { way: name(way), samples: 2 * samples, seconds, error, cost: 0.0 });
    }
    let base = (trials[0].seconds.max(1e-9), trials[0].error * trials[0].error);
    for ((trial, noise), way) in trials.iter_mut().zip(&noises).zip(&ways) {
        let (shown, error) = log_ratio(noise, &noises[0]);
        // The gain of Sobol samples grows with their number: few samples say little about many.
        let early = if way.sampler == first.sampler { 0.0 } else { EARLY / f64::from(samples).sqrt() };
        let ratio = Prior::of(first, way).after(shown, error.hypot(early)).exp();
        trial.cost = ratio * trial.seconds / base.0;
    }
    let best = (0..ways.len()).min_by(|&a, &b| trials[a].cost.total_cmp(&trials[b].cost)).unwrap_or(0);
    let taken = if trials[best].cost < BETTER { best } else { 0 };
    // Error of the whole image after `time`, if it falls as that of independent samples.
    let of_image = f64::from(first.height) / f64::from(rows.len().max(1));
    let passes = time.as_secs_f64() / (base.0 * of_image);
    let expected = (base.1 * trials[taken].cost / passes.max(1e-9)).sqrt();
    Ok((ways[taken].clone(), trials, expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clear trial counts, one that may be chance does not.
    #[test]
    fn what_is_known_and_what_is_shown() {
        assert!((SOBOL.after(0.3, 0.01) - 0.3).abs() < 0.01);
        assert!((SOBOL.after(0.3, 10.0) - SOBOL.mean).abs() < 0.01);
        assert_eq!(SOBOL.after(f64::NAN, 0.1), SOBOL.mean);
        let same = Prior { mean: 0.0, spread: 0.0 };
        assert_eq!(same.after(0.0, 0.0), 0.0);
        let (ratio, error) = log_ratio(&[2.0, 4.0, 6.0], &[1.0, 2.0, 3.0]);
        assert!((ratio - 2.0f64.ln()).abs() < 1e-12 && error < 1e-12);
        // One tile makes all the noise: the standard error is as large as the value.
        let mut lamp = vec![0.0; 99];
        lamp.push(100.0);
        assert!(log_ratio(&lamp, &[1.0; 100]).1 > 0.9);
    }
}
