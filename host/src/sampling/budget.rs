//! The best image within a time.

use super::filter::{Choice, Filter, Filtered};
use super::goal::decide;
use super::race::{race, warm, ways};
use super::survey::Survey;
use super::taker::Taker;
use super::{Adaptive, FilterTrial, Free, Halves, Noise, Trial, allocate};
use crate::Error;
use crate::denoise::Denoise;
use crate::image::Image;
use crate::render::{Observer, Renderer, Settings};
use std::time::{Duration, Instant};

/// What of the time each way of sampling is tried for, once for each half.
const TRY: f64 = 0.004;

/// The error above which a filter may help: below, its own is greater (docs/tradeoff.md).
const FILTER_FROM: f64 = 0.01;

/// What of the time goes by before where samples go is decided.
const FIRST: f64 = 0.08;

/// Samples of each half before that, at most.
const MOST_FIRST: u32 = 64;

/// Parts of the time after which the speed is measured anew: the last is short, so that it ends when it should.
const PARTS: [f64; 3] = [0.5, 0.88, 1.0];

/// What of the time may be left at the end.
const LEFT: f64 = 0.015;

/// Passes of one sample that a time must have room for, for the noise to be looked at.
const LOOKS_FROM: f64 = 12.0;

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
    /// The image, where it was not filtered.
    pub plain: Option<Image>,
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
    warm(renderer, &plain, observer)?;
    for way in ways(&plain, plan.free) {
        // Nobody waits longer for a choice than for the image.
        if preparing.elapsed() > plan.time {
            break;
        }
        warm(renderer, &way, observer)?;
        known.push(way);
    }
    let mut filter = None;
    if let Some(denoise) = plan.denoise {
        for way in std::iter::once(&plain).chain(&known) {
            warm(renderer, &Settings { guides: true, ..way.clone() }, observer)?;
        }
        filter = Some(Filter::try_out(renderer, settings, denoise)?);
    }
    let asked = settings.guides || filter.is_some();
    // Memory, too, is made ready before.
    let mut halves = Halves::new(settings.width, settings.height);
    if asked {
        halves.make_guides();
    }
    let preparing = preparing.elapsed();

    let start = Instant::now();
    let whole = plan.time.as_secs_f64();
    let (best, trials, expected) =
        race(renderer, (&plain, &known), (plan.time.mul_f64(TRY), plan.time), observer)?;
    let wanted = !plan.free.denoise || expected > FILTER_FROM;
    let filter = filter.filter(|filter| wanted && filter.fits(whole, plan.free.denoise, expected));
    let filter = filter.map(|filter| filter.with_trials(whole));
    let asked = settings.guides || filter.is_some();
    if !asked {
        halves.drop_guides();
    }
    let mut taker = Taker::with(renderer, &Settings { guides: asked, ..best }, halves, observer);
    let first = Instant::now();
    taker.uniform(1)?;
    let one = first.elapsed().as_secs_f64();
    // Of what that took, the device's part grows with samples; the rest comes with each pass.
    let mut clock = Clock { beside: (one - taker.took.device.as_secs_f64()).max(0.0), ..Clock::default() };
    // Where the host takes long for each pass, there is time for a few only, and none for looking at them.
    let looks = clock.beside < 0.5 * one || one * LOOKS_FROM < whole;
    let each = (one - clock.beside).max(1e-9);
    let more = ((FIRST * whole - clock.beside) / each).clamp(1.0, f64::from(MOST_FIRST)) as u32 - 1;
    if more > 0 && start.elapsed().as_secs_f64() + f64::from(more) * each + clock.beside < whole {
        taker.uniform(more)?;
    }
    let mut survey = if looks { taker.survey() } else { Survey::blind(taker.halves.tiles()) };
    let (adaptive, gain) = if looks { decide(plan.adaptive, &survey, &taker) } else { (false, 1.0) };
    let of_one: f64 = {
        let tiles = taker.halves.tiles();
        (0..2).map(|half| allocate::work(&survey, tiles, half, &|_| 1.0)).sum()
    };
    let mut work = 0.5 * taker.mean_samples() * of_one;
    clock.rate = work / taker.took.device.as_secs_f64().max(1e-9);
    let mut choice = filter.as_ref().map(|_| Filter::choice(plan.free.denoise));
    for index in 0..MOST_PASSES {
        let part = PARTS.get(index).copied().unwrap_or(1.0);
        let reserve = match (&filter, &choice) {
            (Some(filter), Some(taken)) if taken.may_be() => filter.seconds,
            _ => 0.0,
        };
        let end = part * (whole - reserve - image_seconds(&taker));
        let left = end - start.elapsed().as_secs_f64();
        // Less than one sample of one pixel in a hundred.
        if left <= LEFT * whole || clock.fits(left) < 0.005 * of_one {
            if index + 1 < PARTS.len() {
                continue;
            }
            break;
        }
        if index > 0 && adaptive {
            survey = taker.survey();
        }
        let more = clock.fits(end - start.elapsed().as_secs_f64());
        taker.progress = start.elapsed().as_secs_f64() / whole;
        let before = taker.took.device;
        let took = taker.spend(&survey, adaptive, more)?.as_secs_f64();
        clock.learn(more, took, (taker.took.device - before).as_secs_f64());
        work += more;
        if let (Some(filter), Some(taken)) = (&filter, &mut choice)
            && taken.is_open()
        {
            let final_work = work + clock.fits(whole - start.elapsed().as_secs_f64());
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
    let plain = if filtered.is_none() { Some(taker.halves.image()) } else { None };
    let time = start.elapsed();
    taker.finish();
    let noise = taker.noise();
    Ok(Made { noise, taker, adaptive, gain, trials, filtered, plain, filter: trial, time, preparing })
}

/// How long a pass takes.
#[derive(Default)]
struct Clock {
    /// Whatever it renders.
    beside: f64,
    /// Work a second, beside that.
    rate: f64,
}

impl Clock {
    /// Work that fits a time.
    fn fits(&self, seconds: f64) -> f64 {
        ((seconds - self.beside) * self.rate).max(0.0)
    }

    fn learn(&mut self, work: f64, seconds: f64, device: f64) {
        if work > 0.0 && device > 0.0 {
            self.rate = work / device;
            self.beside = (seconds - device).max(0.0);
        }
    }
}

/// Making the image of the sums: a few nanoseconds a pixel.
fn image_seconds(taker: &Taker) -> f64 {
    5e-9 * taker.settings.pixels() as f64
}
