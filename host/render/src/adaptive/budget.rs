//! Rendering of the best image within a time budget, for [`Goal::Time`](super::Goal::Time): chooses
//! the sampling strategy by trials, takes samples in passes, and filters the image if that helps.

use super::filter::{Choice, Filter, Filtered};
use super::goal::decide;
use super::noise_map::NoiseMap;
use super::pass_cost::{PassCostModel, PassTime, calibrate};
use super::renderer::{AdaptiveRenderer, Launches, PassBudget};
use super::strategy::{candidates, choose_strategy, warm_up};
use super::{Adaptive, DualBuffers, FilterTrial, Free, Noise, Trial, allocate};
use crate::Error;
use crate::denoise::DenoiseSettings;
use crate::render::{RenderObserver, Renderer, Settings, SettingsError};
use std::time::{Duration, Instant};
use trisect_device::BackendError;
use trisect_image::Image;

/// Share of the time for the trial of each strategy, once for each half.
const TRIAL_SHARE: f64 = 0.004;

/// Error below which no filter is considered: its own error would be larger
/// (docs/notebook/tradeoff-fronts.md).
const FILTER_FROM: f64 = 0.01;

/// Share of the time that has passed when adaptive sampling is decided.
const FIRST: f64 = 0.08;

/// Maximum samples of each half before that decision.
const MAX_FIRST_SAMPLES: u32 = 64;

/// Shares of the time at which passes end. Each pass measures the speed for the next; the last one
/// is short, so that it ends on time.
const PARTS: &[f64] = &[0.5, 0.85, 0.96, 1.0];

/// Host cost of a pass, as a share of the time, above which there are only two passes, or three
/// (see `MIDDLE`).
const COSTLY: f64 = 0.01;

/// Share of the time for the last of few passes: this factor times the host cost of a pass, within
/// these bounds.
const LAST: (f64, [f64; 2]) = (3.0, [0.12, 0.4]);

/// For adaptive sampling: maximum host cost of a pass, as a share of the time, for which there are
/// three passes, and the share at which the first ends. It measures the speed of tile launches.
const MIDDLE: (f64, f64) = (0.1, 0.55);

/// Host cost of a launch with a sample count for each tile, relative to a pass for all pixels:
/// first sample indices are written to the device, and no half is summed while the other is
/// rendered.
const TILE_LAUNCH_COST: f64 = 3.0;

/// Maximum share of a pass for launches for the tiles with the most samples.
const LAUNCHES: f64 = 0.06;

/// Maximum share of the time that may stay unused at the end.
const MAX_UNUSED_SHARE: f64 = 0.015;

/// Minimum number of passes of one sample that fit the time, for the noise to be measured.
const MIN_PASSES_FOR_NOISE_MAP: f64 = 12.0;

/// Maximum number of passes; each ends closer to the end of the time.
const MAX_PASSES: usize = 32;

/// Image made within the time.
pub(super) struct BudgetResult<'a> {
    pub renderer: AdaptiveRenderer<'a>,
    pub noise: Noise,
    pub adaptive: bool,
    pub gain: f64,
    pub trials: Vec<Trial>,
    /// Image, filtered if that was chosen.
    pub image: Image,
    /// Filter, if the image was filtered.
    pub filtered: Option<Filtered>,
    pub filter: Option<FilterTrial>,
    /// Time from the first sample to the image.
    pub time: Duration,
    /// Time before the budget begins, to compile kernels and calibrate passes.
    pub preparing: Duration,
}

/// Budget, and what may be chosen.
#[derive(Clone, Copy)]
pub(super) struct BudgetPlan<'a> {
    pub time: Duration,
    pub adaptive: Adaptive,
    pub free: Free,
    /// Filter, or the one that may be chosen.
    pub denoise: Option<&'a DenoiseSettings>,
}

/// Takes samples, and filters the image if that helps, within the given time. The time begins when
/// the kernels are compiled and the passes are calibrated.
///
/// # Errors
///
/// Errors of rendering.
pub(super) fn render_within<'a>(
    renderer: &'a mut Renderer,
    settings: &Settings,
    plan: BudgetPlan,
    observer: &'a mut dyn RenderObserver,
) -> Result<BudgetResult<'a>, Error> {
    let preparing = Instant::now();
    let plain = Settings { guides: false, ..settings.clone() };
    let mut known = Vec::new();
    warm_up(renderer, &plain, observer)?;
    for way in candidates(&plain, plan.free) {
        // Compiling alternatives must not take longer than the image, or a second.
        if preparing.elapsed() > plan.time.max(Duration::from_secs(1)) {
            break;
        }
        warm_up(renderer, &way, observer)?;
        known.push(way);
    }
    let whole = plan.time.as_secs_f64();
    let mut halves = DualBuffers::new(settings.width, settings.height);
    let mut filter = None;
    if let Some(denoise) = plan.denoise {
        let ways = std::iter::once(&plain).chain(&known);
        let guided = ways.map(|way| Settings { guides: true, ..way.clone() }).collect::<Vec<_>>();
        filter = match prepare_filter(renderer, (settings, &guided), denoise, &mut halves, observer) {
            // If the filter was only an option, the image goes without it.
            Err(error) if plan.free.denoise && is_too_large(&error) => None,
            ready => Some(ready?),
        };
    }
    let filter = filter.filter(|filter| filter.may_fit(whole, plan.free.denoise));
    let with_guides = Settings { guides: settings.guides || filter.is_some(), ..plain.clone() };
    if !with_guides.guides {
        halves.drop_aovs();
    }
    let rehearsal;
    (halves, rehearsal) = calibrate(renderer, &plain, &with_guides, halves, observer)?;
    let preparing = preparing.elapsed();

    let start = Instant::now();
    let (best, trials, expected) =
        choose_strategy(renderer, (&plain, &known), (plan.time.mul_f64(TRIAL_SHARE), plan.time), observer)?;
    let wanted = !plan.free.denoise || expected > FILTER_FROM;
    let slower = rehearsal.map_or(0.0, |rehearsal| rehearsal.aov_share());
    let filter = filter.filter(|filter| wanted && filter.fits(whole, plan.free.denoise, expected, slower));
    let filter = filter.map(|filter| filter.with_trials(whole));
    let with_aovs = settings.guides || filter.is_some();
    if !with_aovs {
        halves.drop_aovs();
    }
    let mut renderer =
        AdaptiveRenderer::with(renderer, &Settings { guides: with_aovs, ..best }, halves, observer);
    let (pass, taken) = match rehearsal.and_then(|rehearsal| rehearsal.pass(with_aovs)) {
        Some(pass) => (pass, 0),
        None => (PassTime::of_one(&mut renderer)?, 1),
    };
    let mut clock =
        PassCostModel { chunk: pass.beside, tile_launch: TILE_LAUNCH_COST * pass.beside, rate: 0.0 };
    // If the host takes long for each pass, there are only few passes, and no time to measure the
    // noise.
    let looks = plan.adaptive == Adaptive::On
        || pass.beside < pass.each
        || (pass.beside + pass.each) * MIN_PASSES_FOR_NOISE_MAP < whole;
    let more =
        ((FIRST * whole - pass.beside) / pass.each).clamp(2.0, f64::from(MAX_FIRST_SAMPLES)) as u32 - taken;
    let fits = looks && start.elapsed().as_secs_f64() + f64::from(more) * pass.each + pass.beside < whole;
    let more = if fits { more } else { 0 };
    if more > 0 {
        renderer.render_uniform(more)?;
    }
    let looking = Instant::now();
    let mut noise_map = if looks { renderer.noise_map() } else { NoiseMap::uniform(renderer.halves.tiles()) };
    let look = looking.elapsed().as_secs_f64();
    let left = 1.0 - (PARTS.len() as f64 * (look + clock.tile_launch) / whole).min(1.0);
    let (adaptive, gain) =
        if looks { decide(plan.adaptive, &noise_map, &renderer, left) } else { (false, 1.0) };
    let beside = if adaptive { look + clock.tile_launch } else { clock.chunk };
    let before_last = 1.0 - (LAST.0 * beside / whole).clamp(LAST.1[0], LAST.1[1]);
    let few = [MIDDLE.1, before_last, 1.0];
    let parts = match () {
        () if beside <= COSTLY * whole => PARTS,
        () if adaptive && beside <= MIDDLE.0 * whole => &few[..],
        () => &few[1..],
    };
    let of_one: f64 = {
        let tiles = renderer.halves.tiles();
        (0..2).map(|half| allocate::work(&noise_map, tiles, half, &|_| 1.0)).sum()
    };
    clock.rate = of_one / pass.each;
    let first = parts.first().copied().unwrap_or(1.0) * whole - start.elapsed().as_secs_f64();
    // At least one sample, or there is no image.
    if renderer.halves.samples() == 0 && clock.fits(first, Launches { chunks: 1, tile_launches: 0 }) < of_one
    {
        renderer.render_uniform(1)?;
    }
    let mut work = 0.5 * renderer.mean_samples() * of_one;
    if work > 0.0 {
        clock.rate = work / renderer.totals.device.as_secs_f64().max(1e-9);
    }
    let mut choice = filter.as_ref().map(|_| Filter::choice(plan.free.denoise));
    for index in 0..MAX_PASSES {
        if !renderer.should_continue() {
            break;
        }
        let part = parts.get(index).copied().unwrap_or(1.0);
        let reserve = match (&filter, &choice) {
            (Some(filter), Some(taken)) => filter.reserve(taken),
            _ => 0.0,
        };
        let end = part * (whole - reserve - image_seconds(&renderer));
        let left = end - start.elapsed().as_secs_f64();
        let least = match adaptive {
            true => Launches { tile_launches: 1, chunks: 0 },
            false => Launches { tile_launches: 0, chunks: 1 },
        };
        // Less than one sample in a hundred pixels.
        if left <= MAX_UNUSED_SHARE * whole || clock.fits(left, least) < 0.005 * of_one {
            if index + 1 < parts.len() {
                continue;
            }
            break;
        }
        // Not if measuring the noise takes as long as it may gain.
        if index > 0 && adaptive && look < COSTLY * whole {
            noise_map = renderer.noise_map();
        }
        let left = end - start.elapsed().as_secs_f64();
        renderer.progress = start.elapsed().as_secs_f64() / whole;
        let room = |launches| clock.fits(left, launches);
        let own = (LAUNCHES * left / clock.tile_launch.max(1e-9)).clamp(1.0, f64::from(u32::MAX)) as u32;
        let spent =
            renderer.run_pass(&noise_map, adaptive, &PassBudget { work: &room, max_tile_launches: own })?;
        if spent.work <= 0.0 && index + 1 >= parts.len() {
            break;
        }
        clock.learn(&spent);
        work += spent.work;
        if let (Some(filter), Some(taken)) = (&filter, &mut choice)
            && taken.is_open()
        {
            let left = clock.fits(whole - start.elapsed().as_secs_f64(), Launches::default());
            let more = if renderer.should_continue() { (work + left) / work } else { 1.0 };
            taken.decide(filter, &mut renderer, more)?;
            if !taken.may_filter() && !settings.guides {
                renderer.drop_aovs();
                if let Some(PassTime { each, beside }) = rehearsal.and_then(|rehearsal| rehearsal.pass(false))
                {
                    (clock.chunk, clock.rate) = (beside, of_one / each);
                }
            }
        }
    }
    let trial = choice.as_ref().and_then(Choice::trial);
    let filtered = match (filter, choice) {
        (Some(filter), Some(taken)) => filter.finish(&mut renderer, &taken)?,
        _ => None,
    };
    let (image, filtered) = match filtered {
        Some((image, filtered)) => (image, Some(filtered)),
        None => (renderer.halves.image(), None),
    };
    let time = start.elapsed();
    renderer.finish();
    let noise = renderer.noise();
    Ok(BudgetResult {
        noise,
        renderer,
        adaptive,
        gain,
        trials,
        image,
        filtered,
        filter: trial,
        time,
        preparing,
    })
}

/// Compiles the kernels that a filter needs with each strategy, and measures the filter.
fn prepare_filter<'a>(
    renderer: &mut Renderer,
    (settings, ways): (&Settings, &[Settings]),
    denoise: &'a DenoiseSettings,
    halves: &mut DualBuffers,
    observer: &mut dyn RenderObserver,
) -> Result<Filter<'a>, Error> {
    ways.iter().try_for_each(|way| warm_up(renderer, way, observer))?;
    halves.allocate_aovs();
    Filter::try_out(renderer, settings, denoise, halves)
}

fn is_too_large(error: &Error) -> bool {
    matches!(
        error,
        Error::Settings(SettingsError::TooLarge { .. }) | Error::Backend(BackendError::TooLarge { .. })
    )
}

/// Returns the seconds to make the image from the sums, estimated at a few nanoseconds per pixel.
fn image_seconds(renderer: &AdaptiveRenderer) -> f64 {
    5e-9 * renderer.settings.pixels() as f64
}
