//! Which way of sampling is best in this scene: each is tried on some rows.

use super::halves::Halves;
use super::survey::Survey;
use super::taker::of_half;
use super::{Free, Trial};
use crate::Error;
use crate::backend::DeviceKind;
use crate::film::Rows;
use crate::render::{Observer, Renderer, Sampler, Settings};
use std::time::{Duration, Instant};
use trisect_shared::film::{CHUNK_SAMPLES, PixelSums};

/// Rows whose kernels are compiled: those of a tile.
const WARM: u32 = 8;

/// Rows that are tried, at least.
const LEAST_ROWS: u32 = 4;

/// Pixels that keep a GPU busy.
const BUSY: u64 = 300_000;

/// What another way must cost at most, of what the first does: less is within the noise of a trial.
const BETTER: f64 = 0.85;

/// The ways that are free to choose, that of the settings first.
pub(super) fn ways(settings: &Settings, free: Free) -> Vec<Settings> {
    let mut ways = vec![settings.clone()];
    for turn in 1..4u8 {
        let (roulette, sampler) = (turn & 1 != 0, turn & 2 != 0);
        if roulette && !free.roulette || sampler && !free.sampler {
            continue;
        }
        let mut way = settings.clone();
        if roulette {
            way.roulette = !settings.roulette;
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
    format!("{sampler}, {}", if way.roulette { "roulette" } else { "no roulette" })
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

/// Tries each way for about `slice`. Returns the best and what each showed.
pub(super) fn race(
    renderer: &mut Renderer,
    ways: &[Settings],
    slice: Duration,
    observer: &mut dyn Observer,
) -> Result<(Settings, Vec<Trial>), Error> {
    let [first, ..] = ways else { return Err(Error::Cancelled) };
    if ways.len() < 2 {
        return Ok((first.clone(), Vec::new()));
    }
    let rows = some(renderer, first);
    // As many samples for each: what Sobol's points gain depends on it.
    let mut samples = 1;
    loop {
        let start = Instant::now();
        renderer.render_sums(&of_half(first, 0), &rows, 0..samples, observer)?;
        let took = start.elapsed();
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
    let mut trials = Vec::new();
    for way in ways {
        let mut halves = Halves::new(first.width, rows.len());
        let start = Instant::now();
        let mut sums: [Vec<PixelSums>; 2] = [Vec::new(), Vec::new()];
        for (half, sums) in sums.iter_mut().enumerate() {
            *sums = renderer.render_sums(&of_half(way, half), &rows, 0..samples, observer)?.pixels.to_vec();
        }
        let seconds = start.elapsed().as_secs_f64();
        (0..2).for_each(|half| halves.add(half, &sums[half], samples));
        let error = Survey::new(&halves, way.sampler == Sampler::Sobol).noise.error;
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
    let taken = if trials[best].cost < BETTER * base { best } else { 0 };
    Ok((ways[taken].clone(), trials))
}
