//! The best image within a time.

use super::filter::{Choice, Filter, Filtered};
use super::goal::decide;
use super::race::{race, warm, ways};
use super::taker::Taker;
use super::{Adaptive, FilterTrial, Free, Noise, Trial, allocate};
use crate::Error;
use crate::denoise::Denoise;
use crate::render::{Observer, Renderer, Settings};
use std::time::{Duration, Instant};

/// What of the time each way of sampling is tried for, once for each half.
const TRY: f64 = 0.004;

/// What of the time goes by before where samples go is decided.
const FIRST: f64 = 0.08;

/// Samples of each half before that, at most.
const MOST_FIRST: u32 = 64;

/// Parts of the time after which the speed is measured anew: the last is short, so that it ends when it should.
const PARTS: [f64; 3] = [0.5, 0.88, 1.0];

/// What of the time may be left at the end.
const LEFT: f64 = 0.015;

/// Passes, at most: each is closer to the end than the one before.
const MOST_PASSES: usize = 8;

/// What was made in the time.
pub(super) struct Made<'a> {
    pub taker: Taker<'a>,
    pub noise: Noise,
    pub adaptive: bool,
    pub gain: f64,
    pub trials: Vec<Trial>,
    pub filtered: Option<Filtered>,
    pub filter: Option<FilterTrial>,
    /// What the budget is of.
    pub time: Duration,
    /// Compiling kernels, before it.
    pub preparing: Duration,
}

/// What to do with the time.
#[derive(Clone, Copy)]
pub(super) struct Plan<'a> {
    pub time: Duration,
    pub adaptive: Adaptive,
    pub free: Free,
    /// The filter, or what might be one.
    pub denoise: Option<&'a Denoise>,
}

/// Samples for so long, and then the filter if it helps. The clock starts when the kernels are compiled.
///
/// # Errors
///
/// As rendering.
pub(super) fn within<'a>(
    renderer: &'a mut Renderer,
    settings: &Settings,
    plan: Plan,
    observer: &'a mut dyn Observer,
) -> Result<Made<'a>, Error> {
    let preparing = Instant::now();
    let plain = Settings { guides: false, ..settings.clone() };
    let mut known = Vec::new();
    for way in ways(&plain, plan.free) {
        warm(renderer, &way, observer)?;
        known.push(way);
        // Nobody waits longer for a choice than for the image.
        if preparing.elapsed() > plan.time {
            break;
        }
    }
    let mut filter = None;
    if let Some(denoise) = plan.denoise {
        for way in &known {
            warm(renderer, &Settings { guides: true, ..way.clone() }, observer)?;
        }
        filter = Some(Filter::try_out(renderer, settings, denoise)?);
    }
    let preparing = preparing.elapsed();

    let start = Instant::now();
    let whole = plan.time.as_secs_f64();
    let (best, trials) = race(renderer, &known, plan.time.mul_f64(TRY), observer)?;
    let filter = filter.filter(|filter| filter.fits(whole, plan.free.denoise));
    let filter = filter.map(|filter| filter.with_trials(whole));
    let asked = settings.guides || filter.is_some();
    let mut taker = Taker::new(renderer, &Settings { guides: asked, ..best }, observer);
    let first = Instant::now();
    taker.uniform(1)?;
    let one = first.elapsed().as_secs_f64();
    let more = (FIRST * whole / one).clamp(1.0, f64::from(MOST_FIRST)) as u32 - 1;
    if more > 0 && start.elapsed().as_secs_f64() + f64::from(more) * one < whole {
        taker.uniform(more)?;
    }
    let mut spent = first.elapsed().as_secs_f64();
    let mut survey = taker.survey();
    let (adaptive, gain) = decide(plan.adaptive, &survey, &taker);
    let of_one: f64 = {
        let tiles = taker.halves.tiles();
        (0..2).map(|half| allocate::work(&survey, tiles, half, &|_| 1.0)).sum()
    };
    let mut work = 0.5 * taker.mean_samples() * of_one;
    let mut asked = (work, spent);
    let mut choice = filter.as_ref().map(|_| Filter::choice(plan.free.denoise));
    for index in 0..MOST_PASSES {
        let part = PARTS.get(index).copied().unwrap_or(1.0);
        let reserve = match (&filter, &choice) {
            (Some(filter), Some(taken)) if taken.may_be() => filter.seconds,
            _ => 0.0,
        };
        let end = part * (whole - reserve - image_seconds(&taker));
        let left = end - start.elapsed().as_secs_f64();
        let more = left * asked.0 / asked.1;
        // Less than one sample of one pixel in a hundred.
        if left <= LEFT * whole || more < 0.005 * of_one {
            if index + 1 < PARTS.len() {
                continue;
            }
            break;
        }
        if index > 0 && adaptive {
            survey = taker.survey();
        }
        let left = end - start.elapsed().as_secs_f64();
        let more = (left * asked.0 / asked.1).max(0.0);
        taker.progress = start.elapsed().as_secs_f64() / whole;
        let took = taker.spend(&survey, adaptive, more)?.as_secs_f64();
        work += more;
        spent += took;
        asked = (more, took.max(1e-6));
        if let (Some(filter), Some(taken)) = (&filter, &mut choice)
            && taken.is_open()
        {
            let final_work = work + (whole - start.elapsed().as_secs_f64()).max(0.0) * work / spent;
            taken.decide(filter, &mut taker, final_work / work)?;
            if !taken.may_be() && !settings.guides {
                taker.drop_guides();
            }
        }
    }
    let trial = choice.as_ref().and_then(Choice::trial);
    let filtered = match (filter, choice) {
        (Some(filter), Some(taken)) => filter.finish(&mut taker, &taken)?,
        _ => None,
    };
    let time = start.elapsed();
    taker.finish();
    let noise = taker.noise();
    Ok(Made { noise, taker, adaptive, gain, trials, filtered, filter: trial, time, preparing })
}

/// Making the image of the sums: a few nanoseconds a pixel.
fn image_seconds(taker: &Taker) -> f64 {
    5e-9 * taker.settings.pixels() as f64
}
