//! Which way of sampling is best in this scene: each is tried on some rows.

use super::halves::Halves;
use super::survey::Survey;
use super::taker::of_half;
use super::{Free, Trial};
use crate::Error;
use crate::backend::DeviceKind;
use crate::film::Rows;
use crate::render::{Observer, Renderer, Sampler, Settings};
use crate::statistics::mean_and_error;
use std::time::{Duration, Instant};
use trisect_shared::film::CHUNK_SAMPLES;

/// Rows whose kernels are compiled: those of a tile.
const WARM: u32 = 8;

/// Rows that are tried, at least.
const LEAST_ROWS: u32 = 4;

/// The segment from which on roulette is tried: from the first one it makes more noise than it saves (docs/tradeoff.md).
const ROULETTE_FROM: u32 = 4;

/// Pixels that keep a GPU busy.
const BUSY: u64 = 150_000;

/// What another way must cost at most, of what the first does: less is within the noise of a trial.
const BETTER: f64 = 0.85;

/// Standard errors by which a way must be better.
const CLEAR: f64 = 2.5;

/// The ways that are free to choose, beside that of the settings.
pub(super) fn ways(settings: &Settings, free: Free) -> Vec<Settings> {
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

/// Compiles what a way needs. The image's size is that of the render, so that its memory is there, too.
pub(super) fn warm(
    renderer: &mut Renderer,
    way: &Settings,
    observer: &mut dyn Observer,
) -> Result<(), Error> {
    let rows = Rows::from(0..way.height.min(WARM));
    renderer.render_sums(&of_half(way, 0), &rows, 0..1, observer).map(|_| ())
}

/// Some rows of the image, evenly spread.
fn some(renderer: &Renderer, settings: &Settings) -> Rows {
    let least = match renderer.backend().device().kind {
        DeviceKind::Gpu => BUSY.div_ceil(u64::from(settings.width)) as u32,
        _ => LEAST_ROWS,
    };
    let of = (settings.height / least.max(LEAST_ROWS)).max(1);
    Rows::interleaved(settings.height, 0, of / 2, of)
}

/// Whether one way's tiles cost less than another's by more than chance: where a few bright pixels make all the noise, a trial says nothing.
fn is_clear(base: &[f64], other: &[f64]) -> bool {
    let less: Vec<f64> = base.iter().zip(other).map(|(base, other)| base - other).collect();
    let (mean, error) = mean_and_error(&less);
    mean > CLEAR * error
}

/// Tries the first way and the others for about `slice` each. Returns the best, what each showed, and the error that the best should have
/// after `time`.
pub(super) fn race(
    renderer: &mut Renderer,
    (first, others): (&Settings, &[Settings]),
    (slice, time): (Duration, Duration),
    observer: &mut dyn Observer,
) -> Result<(Settings, Vec<Trial>, f64), Error> {
    let rows = some(renderer, first);
    // As many samples for each: what Sobol's points gain depends on it. By the device's time: a launch has its own, which more samples do not take again.
    let mut samples = 1;
    let mut beside;
    loop {
        let start = Instant::now();
        let sums = renderer.render_sums(&of_half(first, 0), &rows, 0..samples, observer)?;
        let took = sums.device;
        beside = start.elapsed().saturating_sub(took);
        if took * 3 > slice || samples == CHUNK_SAMPLES {
            break;
        }
        let fits = slice.as_secs_f64() / 2.0 / took.as_secs_f64().max(1e-6);
        let grown = f64::from(samples) * fits.clamp(1.0, 16.0);
        // A power of two, for Sobol's points.
        let grown = 1 << (grown.max(1.0).log2() as u32).min(CHUNK_SAMPLES.ilog2());
        if grown <= samples {
            break;
        }
        samples = grown;
    }
    // Where launches take longer than what they render, one way alone shows how noisy the image is.
    let others = if beside > 4 * slice { &[] } else { others };
    let ways: Vec<&Settings> = std::iter::once(first).chain(others).collect();
    let mut trials = Vec::new();
    let mut costs: Vec<Vec<f64>> = Vec::new();
    let mut halves = Halves::new(first.width, rows.len());
    for &way in &ways {
        halves.clear();
        let mut device = Duration::ZERO;
        for half in 0..2 {
            let sums = renderer.render_sums(&of_half(way, half), &rows, 0..samples, observer)?;
            device += sums.device;
            halves.add(half, sums.pixels, samples);
        }
        let seconds = device.as_secs_f64();
        let survey = Survey::new(&halves, way.sampler == Sampler::Sobol);
        costs.push(survey.tiles.iter().map(|tile| tile.error * seconds).collect());
        let error = survey.error;
        trials.push(Trial {
            way: name(way),
            samples: 2 * samples,
            seconds,
            error,
            cost: error * error * seconds,
        });
    }
    let base = trials[0].cost;
    let best = (0..ways.len()).min_by(|&a, &b| trials[a].cost.total_cmp(&trials[b].cost)).unwrap_or(0);
    let taken = if trials[best].cost < BETTER * base && is_clear(&costs[0], &costs[best]) { best } else { 0 };
    // Of the whole image after `time`, if noise falls as noise does.
    let of_image = f64::from(first.height) / f64::from(rows.len().max(1));
    let taken_trial = &trials[taken];
    let passes = time.as_secs_f64() / (taken_trial.seconds * of_image).max(1e-9);
    let expected = taken_trial.error / passes.max(1e-9).sqrt();
    Ok((ways[taken].clone(), trials, expected))
}
