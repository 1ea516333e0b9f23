//! A render within a time budget: its state, and its steps from the first sample to the image.

use super::filter::{Choice, Filter, Filtered};
use super::goal::{self, decide};
use super::noise_map::NoiseMap;
use super::pass_cost::{Calibration, PassCostModel, PassTime};
use super::preparation::{BudgetPlan, Preparation};
use super::renderer::AdaptiveRenderer;
use super::sampling_pass::{Launches, PassBudget};
use super::strategy::choose_strategy;
use super::{Adaptive, FilterTrial, Noise, Trial, allocate};
use crate::Error;
use crate::render::{RenderObserver, Renderer, Settings};
use std::time::Duration;
use trisect_image::Image;
use web_time::Instant;

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
    /// Error of a denoiser that might have been chosen.
    pub denoiser_error: Option<String>,
    /// Time from the first sample to the image.
    pub time: Duration,
    /// Time before the budget begins, to compile kernels and calibrate passes.
    pub preparing: Duration,
}

/// State of a render within a time.
pub(super) struct BudgetRun<'a, 'p> {
    pub renderer: AdaptiveRenderer<'a>,
    /// True if the settings ask for AOVs.
    keeps_aovs: bool,
    start: Instant,
    /// Whole time, in seconds.
    whole: f64,
    filter: Option<Filter<'p>>,
    denoiser_error: Option<String>,
    choice: Option<Choice>,
    calibration: Option<Calibration>,
    clock: PassCostModel,
    noise_map: NoiseMap,
    /// Mean samples per pixel when the noise was measured.
    measured_at: f64,
    /// Seconds that measuring the noise takes.
    look: f64,
    adaptive: bool,
    gain: f64,
    /// Shares of the time at which passes end.
    parts: Vec<f64>,
    /// Work of one sample of each pixel.
    of_one: f64,
    /// Work so far.
    work: f64,
}

impl<'a, 'p> BudgetRun<'a, 'p> {
    /// Chooses the strategy, takes the first samples, and decides whether tiles get different
    /// numbers of samples. Also returns the trials of strategies.
    pub fn begin(
        renderer: &'a mut Renderer,
        settings: &Settings,
        plan: BudgetPlan<'p>,
        prepared: Preparation<'p>,
        (start, observer): (Instant, &'a mut dyn RenderObserver),
    ) -> Result<(Self, Vec<Trial>), Error> {
        let Preparation { plain, known, mut halves, filters, denoiser_error, calibration } = prepared;
        let whole = plan.time.as_secs_f64();
        let trial_time = (plan.time.mul_f64(TRIAL_SHARE), plan.time);
        let (best, trials, expected) = choose_strategy(renderer, (&plain, &known), trial_time, observer)?;
        let wanted = !plan.free.denoise || expected > FILTER_FROM;
        let slower = calibration.map_or(0.0, |calibration| calibration.aov_share());
        let fits = |filter: &Filter| wanted && filter.fits(whole, plan.free.denoise, expected, slower);
        let filter = filters.into_iter().find(fits).map(|filter| filter.with_trials(whole));
        let with_aovs = settings.guides || filter.is_some();
        if !with_aovs {
            halves.drop_aovs();
        }
        let mut renderer =
            AdaptiveRenderer::with(renderer, &Settings { guides: with_aovs, ..best }, halves, observer);
        renderer.prepare_film();
        let (pass, taken) = match calibration.and_then(|calibration| calibration.pass(with_aovs)) {
            Some(pass) => (pass, 0),
            None => (PassTime::of_one(&mut renderer)?, 1),
        };
        let clock =
            PassCostModel { chunk: pass.beside, tile_launch: TILE_LAUNCH_COST * pass.beside, rate: 0.0 };
        // If the host takes long for each pass, there are only few passes, and no time to measure
        // the noise.
        let looks = plan.adaptive == Adaptive::On
            || pass.beside < pass.each
            || (pass.beside + pass.each) * MIN_PASSES_FOR_NOISE_MAP < whole;
        let more = ((FIRST * whole - pass.beside) / pass.each).clamp(2.0, f64::from(MAX_FIRST_SAMPLES))
            as u32
            - taken;
        let needed = f64::from(more) * pass.each + pass.beside;
        if looks && more > 0 && start.elapsed().as_secs_f64() + needed < whole {
            renderer.render_uniform(more)?;
        }
        let looking = Instant::now();
        let noise_map =
            if looks { renderer.noise_map()? } else { NoiseMap::uniform(renderer.halves.tiles()) };
        let look = looking.elapsed().as_secs_f64();
        let left = 1.0 - (PARTS.len() as f64 * (look + clock.tile_launch) / whole).min(1.0);
        let (adaptive, gain) =
            if looks { decide(plan.adaptive, &noise_map, &renderer, left) } else { (false, Some(1.0)) };
        let gain = gain.unwrap_or_else(|| goal::gain(&noise_map, &renderer));
        let tiles = renderer.halves.tiles();
        let of_one: f64 = (0..2).map(|half| allocate::work(&noise_map, tiles, half, &|_| 1.0)).sum();
        let choice = filter.as_ref().map(|_| Filter::choice(plan.free.denoise));
        let run = Self {
            measured_at: renderer.mean_samples(),
            renderer,
            keeps_aovs: settings.guides,
            start,
            whole,
            filter,
            denoiser_error,
            choice,
            calibration,
            clock: PassCostModel { rate: of_one / pass.each, ..clock },
            noise_map,
            look,
            adaptive,
            gain,
            parts: PARTS.to_vec(),
            of_one,
            work: 0.0,
        };
        Ok((run, trials))
    }

    /// Takes at least one sample, or there is no image, and divides the time into passes.
    pub fn first_samples(&mut self) -> Result<(), Error> {
        let beside = if self.adaptive { self.look + self.clock.tile_launch } else { self.clock.chunk };
        self.parts = parts(beside / self.whole, self.adaptive);
        let first =
            self.parts.first().copied().unwrap_or(1.0) * self.whole - self.start.elapsed().as_secs_f64();
        let none = self.renderer.halves.samples() == 0;
        if none && self.clock.fits(first, Launches { chunks: 1, tile_launches: 0 }) < self.of_one {
            self.renderer.render_uniform(1)?;
        }
        self.work = 0.5 * self.renderer.mean_samples() * self.of_one;
        if self.work > 0.0 {
            self.clock.rate = self.work / self.renderer.totals.device.as_secs_f64().max(1e-9);
        }
        Ok(())
    }

    /// Runs a pass, and decides on the filter after it. Returns false if no further one fits.
    pub fn pass(&mut self, index: usize) -> Result<bool, Error> {
        let whole = self.whole;
        let part = self.parts.get(index).copied().unwrap_or(1.0);
        let reserve = match (&self.filter, &self.choice) {
            (Some(filter), Some(taken)) => filter.reserve(taken),
            _ => 0.0,
        };
        let image = self.calibration.map_or_else(|| image_seconds(&self.renderer), |measured| measured.image);
        let end = part * (whole - reserve - image);
        let left = end - self.start.elapsed().as_secs_f64();
        let least = match self.adaptive {
            true => Launches { tile_launches: 1, chunks: 0 },
            false => Launches { tile_launches: 0, chunks: 1 },
        };
        // Less than one sample in a hundred pixels.
        if left <= MAX_UNUSED_SHARE * whole || self.clock.fits(left, least) < 0.005 * self.of_one {
            return Ok(index + 1 < self.parts.len());
        }
        // Not if measuring the noise takes as long as it may gain.
        if index > 0 && self.adaptive && self.look < COSTLY * whole {
            self.noise_map = self.renderer.noise_map()?;
            self.measured_at = self.renderer.mean_samples();
        }
        let left = end - self.start.elapsed().as_secs_f64();
        self.renderer.progress = self.start.elapsed().as_secs_f64() / whole;
        self.report();
        let clock = &self.clock;
        let room = |launches| clock.fits(left, launches);
        let own = (LAUNCHES * left / clock.tile_launch.max(1e-9)).clamp(1.0, f64::from(u32::MAX)) as u32;
        let budget = PassBudget { work: &room, max_tile_launches: own };
        let spent = self.renderer.run_pass(&self.noise_map, self.adaptive, &budget)?;
        if spent.work <= 0.0 && index + 1 >= self.parts.len() {
            return Ok(false);
        }
        self.clock.learn(&spent);
        self.work += spent.work;
        self.decide_on_filter()?;
        Ok(true)
    }

    /// Tells the observer the time left, and the error: that of the noise map, less what samples
    /// since then are worth if they are independent.
    fn report(&mut self) {
        let more = self.renderer.mean_samples() / self.measured_at;
        let error = self.noise_map.error / more.sqrt();
        let left = self.whole - self.start.elapsed().as_secs_f64();
        self.renderer.report(error, None, left);
    }

    /// Tries the filter, while that is undecided. Without it no AOVs are needed.
    fn decide_on_filter(&mut self) -> Result<(), Error> {
        let (Some(filter), Some(taken)) = (&self.filter, &mut self.choice) else { return Ok(()) };
        if !taken.is_open() {
            return Ok(());
        }
        let left = self.clock.fits(self.whole - self.start.elapsed().as_secs_f64(), Launches::default());
        let more = if self.renderer.should_continue() { (self.work + left) / self.work } else { 1.0 };
        taken.decide(filter, &mut self.renderer, more)?;
        if !taken.may_filter() && !self.keeps_aovs {
            self.renderer.drop_aovs();
            let plain = self.calibration.and_then(|calibration| calibration.pass(false));
            if let Some(PassTime { each, beside }) = plain {
                (self.clock.chunk, self.clock.rate) = (beside, self.of_one / each);
            }
        }
        Ok(())
    }

    /// Filters the image if that was chosen.
    pub fn finish(mut self, trials: Vec<Trial>, preparing: Duration) -> Result<BudgetResult<'a>, Error> {
        let trial = self.choice.as_ref().and_then(Choice::trial);
        let filtered = match (self.filter, self.choice) {
            (Some(filter), Some(taken)) => filter.finish(&mut self.renderer, &taken)?,
            _ => None,
        };
        let (image, filtered) = match filtered {
            Some((image, filtered)) => (image, Some(filtered)),
            None => (self.renderer.image()?, None),
        };
        let time = self.start.elapsed();
        self.renderer.finish();
        Ok(BudgetResult {
            noise: self.renderer.noise()?.1,
            renderer: self.renderer,
            adaptive: self.adaptive,
            gain: self.gain,
            trials,
            image,
            filtered,
            filter: trial,
            denoiser_error: self.denoiser_error,
            time,
            preparing,
        })
    }
}

/// Returns the shares of the time at which passes end, by the host's cost of a pass as a share of
/// the time.
fn parts(beside: f64, adaptive: bool) -> Vec<f64> {
    let before_last = 1.0 - (LAST.0 * beside).clamp(LAST.1[0], LAST.1[1]);
    match () {
        () if beside <= COSTLY => PARTS.to_vec(),
        () if adaptive && beside <= MIDDLE.0 => vec![MIDDLE.1, before_last, 1.0],
        () => vec![before_last, 1.0],
    }
}

/// Returns the seconds to make the image from the sums, estimated at a few nanoseconds per pixel.
fn image_seconds(renderer: &AdaptiveRenderer) -> f64 {
    5e-9 * renderer.settings.pixels() as f64
}
