//! Adaptive sampling: decides how many samples an image takes, and where, until its noise is below
//! a target or a time budget is over.
//!
//! The image is the mean of two [halves](DualBuffers) that share no random number. The noise of one
//! half decides where the other takes its samples.

mod advice;
mod allocate;
mod budget;
mod budget_run;
mod dual_buffers;
mod filter;
mod goal;
mod grace_period;
mod mean;
mod noise_map;
mod pass_cost;
mod percentile;
mod preparation;
mod renderer;
mod sampling_pass;
mod strategy;

pub use crate::error::SamplingError;
pub use crate::film::{TILE, Tiles};
pub use crate::stats::{FilterTrial, GoalProgress, Noise, Sampling, Strategy, Trial};
pub use dual_buffers::DualBuffers;
pub use mean::mean_and_error;

use crate::Error;
use crate::denoise::Denoiser;
use crate::film::Film;
use crate::render::{RenderObserver, Renderer, Sampler, Settings, Summation};
use crate::stats::RenderStats;
use renderer::AdaptiveRenderer;
use std::time::Duration;
use trisect_image::Image;
use web_time::Instant;

/// Goal that ends a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Ends when the estimated root of the relMSE is at most `target`, or the mean samples per
    /// pixel reach `max_samples`.
    Error {
        /// Target error as a fraction, such as 0.01 for 1 %.
        target: f64,
        /// Maximum samples per pixel.
        max_samples: u32,
    },
    /// Ends after this time: from the first sample, after kernels were compiled, to the image.
    Time(Duration),
}

/// Maximum of the mean samples per pixel of a render to a target error, unless another is given.
pub const DEFAULT_MAX_SAMPLES: u32 = 1 << 20;

/// Distribution of samples over pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Adaptive {
    /// Equal number of samples for each pixel.
    Off,
    /// More samples in tiles with more noise.
    On,
    /// On if the noise so far says that it pays.
    Auto,
}

/// Settings that a render with a goal may choose; true if free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Free {
    /// True if the render may switch Russian roulette on or off.
    pub roulette: bool,
    /// True if the render may choose the first segment of Russian roulette.
    pub roulette_depth: bool,
    /// True if the render may choose the sampler.
    pub sampler: bool,
    /// True if the render may denoise or not; [`Goal::Error`] ignores it.
    pub denoise: bool,
}

/// Goal of a render, and what may be chosen to reach it.
#[derive(Clone, Debug)]
pub struct Request {
    /// Goal that ends the render.
    pub goal: Goal,
    /// Distribution of samples over pixels.
    pub adaptive: Adaptive,
    /// Settings that may be chosen.
    pub free: Free,
    /// Denoiser to use; with [`Free::denoise`] those of which the first that fits the time is
    /// tried. [`Goal::Error`] ignores them.
    pub denoisers: Vec<Denoiser>,
}

/// Result of a render with a goal.
pub struct Sampled {
    /// Sums of the image: those of both halves in one film.
    pub film: Film,
    /// Image; with [`Goal::Time`] denoised, if that was requested or chosen.
    pub image: Image,
    /// Statistics of the render.
    pub stats: RenderStats,
}

/// Renders until the goal is reached or the observer ends the render. In either case the image has
/// all samples taken so far. `settings.samples` is ignored.
///
/// # Errors
///
/// [`SamplingError`] for an invalid goal, and the errors of [`Renderer::render`].
pub fn render(
    renderer: &mut Renderer,
    settings: &Settings,
    request: &Request,
    observer: &mut dyn RenderObserver,
) -> Result<Sampled, Error> {
    check(request.goal)?;
    settings.check_with(DualBuffers::BYTES_PER_PIXEL)?;
    match request.goal {
        Goal::Error { target, max_samples: most } => {
            let preparing = Instant::now();
            let (settings, trials) = advice::choose(renderer, settings, (target, request.free), observer)?;
            let mut renderer = AdaptiveRenderer::new(renderer, &settings, observer)?;
            let preparing = preparing.elapsed();
            let start = Instant::now();
            let reached = goal::reach(&mut renderer, target, most, request.adaptive)?;
            let image = renderer.image()?;
            let seconds = start.elapsed().as_secs_f64();
            renderer.finish();
            let met = reached.noise.error <= target;
            let sampling = Sampling {
                goal: "error",
                asked: target,
                met,
                ended: !met && !renderer.should_continue(),
                adaptive: reached.adaptive,
                adaptive_gain: reached.gain,
                trials,
                seconds,
                preparing_seconds: preparing.as_secs_f64(),
                ..report_of(&renderer, reached.noise)
            };
            sampled(renderer, sampling, None, image)
        }
        Goal::Time(time) => {
            let plan = preparation::BudgetPlan {
                time,
                adaptive: request.adaptive,
                free: request.free,
                denoisers: &request.denoisers,
            };
            let made = budget::render_within(renderer, settings, plan, observer)?;
            let seconds = made.time.as_secs_f64();
            let report = report_of(&made.renderer, made.noise);
            let met = (seconds / time.as_secs_f64() - 1.0).abs() <= 0.05;
            let denoise = made.filtered.as_ref().map(|filtered| filtered.denoise);
            // Without a trial, the filtered image is not known to be better than the samples.
            let expected = made.filtered.as_ref().map(|f| f.expected).filter(|e| e.is_finite());
            let sampling = Sampling {
                goal: "time",
                asked: time.as_secs_f64(),
                met,
                ended: !met && report.ended,
                expected_error: expected.unwrap_or(made.noise.error),
                adaptive: made.adaptive,
                adaptive_gain: made.gain,
                way: Strategy { denoise, ..report.way },
                filter: made.filter,
                denoiser_error: made.denoiser_error,
                trials: made.trials,
                seconds,
                preparing_seconds: made.preparing.as_secs_f64(),
                ..report
            };
            let done = made.filtered.as_ref().map(|filtered| (filtered.denoise, filtered.seconds));
            sampled(made.renderer, sampling, done, made.image)
        }
    }
}

/// Renders until the goal is reached. Returns both halves, the estimated noise of their mean, and
/// the seconds taken.
///
/// # Errors
///
/// Same as [`render`].
pub fn render_dual_buffers(
    renderer: &mut Renderer,
    settings: &Settings,
    goal: Goal,
    adaptive: Adaptive,
    observer: &mut dyn RenderObserver,
) -> Result<(DualBuffers, Noise, f64), Error> {
    check(goal)?;
    settings.check_with(DualBuffers::BYTES_PER_PIXEL)?;
    // The caller gets the halves.
    let settings = &Settings { sums: Summation::Host, ..settings.clone() };
    let start = Instant::now();
    let (renderer, noise) = match goal {
        Goal::Error { target, max_samples: most } => {
            let mut renderer = AdaptiveRenderer::new(renderer, settings, observer)?;
            let noise = goal::reach(&mut renderer, target, most, adaptive)?.noise;
            (renderer, noise)
        }
        Goal::Time(time) => {
            let plan = preparation::BudgetPlan { time, adaptive, free: Free::default(), denoisers: &[] };
            let made = budget::render_within(renderer, settings, plan, observer)?;
            (made.renderer, made.noise)
        }
    };
    Ok((renderer.halves, noise, start.elapsed().as_secs_f64()))
}

/// Checks that a goal is valid.
///
/// # Errors
///
/// [`SamplingError`] names the invalid value.
pub fn check(goal: Goal) -> Result<(), SamplingError> {
    match goal {
        Goal::Error { target, .. } if !(target > 0.0 && target < 1.0) => {
            Err(SamplingError::Target { target: format!("{} %", 100.0 * target) })
        }
        Goal::Time(time) if !(0.001..=1e6).contains(&time.as_secs_f64()) => {
            Err(SamplingError::Time { seconds: time.as_secs_f64().to_string() })
        }
        _ => Ok(()),
    }
}

/// Returns a report with the fields that the samples determine; the others have defaults.
fn report_of(renderer: &AdaptiveRenderer, noise: Noise) -> Sampling {
    let both =
        renderer.halves.taken(0).iter().zip(renderer.halves.taken(1)).map(|(a, b)| a.saturating_add(*b));
    let Settings { sampler, roulette, .. } = renderer.settings;
    Sampling {
        goal: "",
        asked: 0.0,
        met: false,
        ended: !renderer.should_continue(),
        noise,
        expected_error: noise.error,
        mean_samples: renderer.mean_samples(),
        least_samples: both.clone().min().unwrap_or(0),
        most_samples: both.max().unwrap_or(0),
        adaptive: false,
        adaptive_gain: 1.0,
        way: Strategy { sampler, roulette, denoise: None },
        filter: None,
        denoiser_error: None,
        trials: Vec::new(),
        seconds: 0.0,
        preparing_seconds: 0.0,
    }
}

fn sampled(
    mut renderer: AdaptiveRenderer,
    sampling: Sampling,
    filtered: Option<(Denoiser, f64)>,
    image: Image,
) -> Result<Sampled, Error> {
    let film = renderer.film()?;
    renderer.inner.drop_halves();
    let samples = sampling.mean_samples.round().clamp(1.0, f64::from(u32::MAX)) as u32;
    let settings = Settings { samples, ..renderer.settings.clone() };
    let mut stats = renderer.inner.statistics(&settings)?;
    stats.device_seconds = renderer.totals.device.as_secs_f64();
    stats.submissions = renderer.totals.submissions;
    (stats.sums, stats.sums_refused) = renderer.inner.summed();
    stats.finish(film.counts(), Duration::from_secs_f64(sampling.seconds), Duration::ZERO, Duration::ZERO);
    if let Some((denoise, seconds)) = filtered {
        (stats.denoise, stats.denoise_seconds) = (Some(denoise), seconds);
        stats.denoise_library = denoise.library();
    }
    stats.sampling = Some(sampling);
    Ok(Sampled { film, image, stats })
}

impl Sampling {
    /// Returns a summary for people.
    pub fn summary(&self) -> String {
        let percent = |error: f64| format!("{:.3} %", 100.0 * error);
        let way = self.way;
        let mut text = format!(
            "{:.1} samples a pixel ({} to {}), {}: estimated error {} (99 of 100 pixels below {})",
            self.mean_samples,
            self.least_samples,
            self.most_samples,
            if self.adaptive { "more where there is more noise" } else { "the same for each" },
            percent(self.noise.error),
            percent(self.noise.percentile_99),
        );
        let sampler = if way.sampler == Sampler::Sobol { "Sobol's samples" } else { "independent samples" };
        let roulette = if way.roulette { "roulette" } else { "no roulette" };
        if self.goal == "error" && !self.trials.is_empty() {
            text += &format!(
                "\nchose {sampler}, {roulette}; took {:.3} s (and {:.3} s before, to compile and to choose)",
                self.seconds, self.preparing_seconds,
            );
        }
        if self.goal == "time" {
            let filter = match way.denoise {
                Some(denoise) => denoise.name().to_owned(),
                None => "no denoiser".to_owned(),
            };
            text += &format!(
                "\nchose {sampler}, {roulette}, {filter} in {:.3} of {:.3} s (and {:.3} s before, to compile); expects an error of {}",
                self.seconds,
                self.asked,
                self.preparing_seconds,
                percent(self.expected_error),
            );
        }
        text
    }

    /// Returns a warning if the goal was not met.
    pub fn warning(&self) -> Option<String> {
        let percent = |error: f64| format!("{:.3} %", 100.0 * error);
        match self.goal {
            _ if self.met || self.ended => None,
            "error" => Some(format!(
                "the error is {}, not {}: pixels have {:.0} samples, and more need a greater `max_spp`",
                percent(self.noise.error),
                percent(self.asked),
                self.mean_samples
            )),
            _ => Some(format!("took {:.3} s, not {:.3} s", self.seconds, self.asked)),
        }
    }
}
