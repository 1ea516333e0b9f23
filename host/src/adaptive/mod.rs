//! How many samples an image takes, and where: until its noise is as low as asked for, or until a time is over.
//!
//! The image is the mean of two [halves](DualBuffers) that share no random number. What one shows of the noise decides where the other takes its samples.

mod allocate;
mod budget;
mod dual_buffers;
mod filter;
mod goal;
mod grace_period;
mod noise_map;
mod pass_cost;
mod renderer;
mod strategy;
mod tiles;

pub use dual_buffers::DualBuffers;
pub use noise_map::Noise;
pub use tiles::{TILE, Tiles};

use crate::Error;
use crate::denoise::DenoiseSettings;
use crate::film::Film;
use crate::image::Image;
use crate::render::{RenderObserver, Renderer, Sampler, Settings};
use crate::stats::RenderStats;
use renderer::AdaptiveRenderer;
use serde::Serialize;
use std::time::{Duration, Instant};
use thiserror::Error as ThisError;

/// When an image has enough samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// When the estimated root of its relMSE is at most this, or its pixels have so many samples in the mean.
    Error {
        /// Such as 0.01 for 1 %.
        target: f64,
        /// Samples a pixel.
        max_samples: u32,
    },
    /// When this time is over: from the first sample after the kernels were compiled, to the image.
    Time(Duration),
}

/// Whether pixels get samples by their noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adaptive {
    /// As many samples for each pixel.
    Off,
    /// More where there is more noise.
    On,
    /// Where that should take clearly less work, by the image's own noise.
    Auto,
}

/// What [`Goal::Time`] may choose otherwise than the settings say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Free {
    /// Whether paths end at random.
    pub roulette: bool,
    /// From which segment on.
    pub roulette_depth: bool,
    /// Where random numbers come from.
    pub sampler: bool,
    /// Whether the image is denoised.
    pub denoise: bool,
}

/// How to sample.
#[derive(Clone, Debug)]
pub struct Request {
    /// When to stop.
    pub goal: Goal,
    /// Where samples go.
    pub adaptive: Adaptive,
    /// What may be chosen.
    pub free: Free,
    /// The filter; one that may be, where that is free.
    pub denoise: Option<DenoiseSettings>,
}

/// A request that cannot be met by any image.
#[derive(Clone, Debug, PartialEq, Eq, ThisError)]
pub enum SamplingError {
    /// An error that is none.
    #[error("--target-error is {target}; it must be above 0 and below 100 %")]
    Target {
        /// What was asked for.
        target: String,
    },
    /// All that a seed has.
    #[error("a pixel has had all 4294967295 samples of a seed: render parts with other seeds (--seed)")]
    TooMany,
    /// A time too short for anything.
    #[error("--budget is {seconds} s; it must be from 1 ms to 1000000 s")]
    Time {
        /// What was asked for.
        seconds: String,
    },
}

/// A way of sampling that was tried on some rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// In words.
    pub way: String,
    /// Samples a pixel.
    pub samples: u32,
    /// By the device's timer.
    pub seconds: f64,
    /// As [`Noise::error`].
    pub error: f64,
    /// error² × seconds over the first way's, by this trial and by what is known of such ways: least is best.
    pub cost: f64,
}

/// What a filter was expected to bring, by the two halves of an image midway.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FilterTrial {
    /// The root of the relMSE at the end, filtered.
    pub filtered: f64,
    /// The same of the samples as they are.
    pub plain: f64,
}

/// What samples were taken by, and what the image should be like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sampling {
    /// `error` or `time`.
    pub goal: &'static str,
    /// The error, or the seconds.
    pub asked: f64,
    /// Whether it was met: an error at most, a time within 5 %.
    pub met: bool,
    /// Whether the observer ended it.
    pub ended: bool,
    /// Estimated, of the samples.
    pub noise: Noise,
    /// The root of the relMSE that the image, as it was written, should have.
    pub expected_error: f64,
    /// Of all pixels.
    pub mean_samples: f64,
    /// Of the pixel that has least.
    pub least_samples: u32,
    /// Of the pixel that has most.
    pub most_samples: u32,
    /// Whether pixels got samples by their noise.
    pub adaptive: bool,
    /// Work that as many samples for each pixel would take for the same error, over that of adaptive ones: estimated.
    pub adaptive_gain: f64,
    /// Which way was taken.
    pub way: Strategy,
    /// What trials of the filter let expect, if there were any.
    pub filter: Option<FilterTrial>,
    /// What was tried.
    pub trials: Vec<Trial>,
    /// From the first sample to the image.
    pub seconds: f64,
    /// Compiling kernels, before that.
    pub preparing_seconds: f64,
}

/// The way of sampling that was taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Strategy {
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// Whether paths end at random.
    pub roulette: bool,
    /// How the image was denoised.
    pub denoise: Option<DenoiseSettings>,
}

/// An image that met a request.
pub struct Sampled {
    /// The image's sums, and the two halves' in one.
    pub film: Film,
    /// The image: filtered where [`Goal::Time`] took a filter.
    pub image: Image,
    /// What it took.
    pub stats: RenderStats,
}

/// Renders until the goal is reached, or the observer says that it does not go on: then with what there is. `settings.samples` says nothing here.
///
/// # Errors
///
/// [`SamplingError`] for a goal that is none, and as [`Renderer::render`].
pub fn render(
    renderer: &mut Renderer,
    settings: &Settings,
    request: &Request,
    observer: &mut dyn RenderObserver,
) -> Result<Sampled, Error> {
    check(request.goal)?;
    settings.check_with(DualBuffers::BYTES_PER_PIXEL)?;
    let start = Instant::now();
    match request.goal {
        Goal::Error { target, max_samples: most } => {
            let mut taker = AdaptiveRenderer::new(renderer, settings, observer);
            let reached = goal::reach(&mut taker, target, most, request.adaptive)?;
            taker.finish();
            let met = reached.noise.error <= target;
            let sampling = Sampling {
                goal: "error",
                asked: target,
                met,
                ended: !met && !taker.should_continue(),
                adaptive: reached.adaptive,
                adaptive_gain: reached.gain,
                seconds: start.elapsed().as_secs_f64(),
                ..of(&taker, reached.noise)
            };
            let image = taker.halves.image();
            Ok(sampled(taker, sampling, None, image))
        }
        Goal::Time(time) => {
            let plan = budget::BudgetPlan {
                time,
                adaptive: request.adaptive,
                free: request.free,
                denoise: request.denoise.as_ref(),
            };
            let made = budget::render_within(renderer, settings, plan, observer)?;
            let seconds = made.time.as_secs_f64();
            let found = of(&made.taker, made.noise);
            let met = (seconds / time.as_secs_f64() - 1.0).abs() <= 0.05;
            let denoise = made.filtered.as_ref().map(|filtered| filtered.denoise);
            // What no trial told is not known to be better than the samples.
            let expected = made.filtered.as_ref().map(|f| f.expected).filter(|e| e.is_finite());
            let sampling = Sampling {
                goal: "time",
                asked: time.as_secs_f64(),
                met,
                ended: !met && found.ended,
                expected_error: expected.unwrap_or(made.noise.error),
                adaptive: made.adaptive,
                adaptive_gain: made.gain,
                way: Strategy { denoise, ..found.way },
                filter: made.filter,
                trials: made.trials,
                seconds,
                preparing_seconds: made.preparing.as_secs_f64(),
                ..found
            };
            let done = made.filtered.as_ref().map(|filtered| (filtered.denoise, filtered.seconds));
            Ok(sampled(made.taker, sampling, done, made.image))
        }
    }
}

/// Renders until the goal is reached, and gives both halves with the estimated noise of their mean and the seconds that it took.
///
/// # Errors
///
/// As [`render`].
pub fn render_dual_buffers(
    renderer: &mut Renderer,
    settings: &Settings,
    goal: Goal,
    adaptive: Adaptive,
    observer: &mut dyn RenderObserver,
) -> Result<(DualBuffers, Noise, f64), Error> {
    check(goal)?;
    settings.check_with(DualBuffers::BYTES_PER_PIXEL)?;
    let start = Instant::now();
    let (taker, noise) = match goal {
        Goal::Error { target, max_samples: most } => {
            let mut taker = AdaptiveRenderer::new(renderer, settings, observer);
            let noise = goal::reach(&mut taker, target, most, adaptive)?.noise;
            (taker, noise)
        }
        Goal::Time(time) => {
            let plan = budget::BudgetPlan { time, adaptive, free: Free::default(), denoise: None };
            let made = budget::render_within(renderer, settings, plan, observer)?;
            (made.taker, made.noise)
        }
    };
    Ok((taker.halves, noise, start.elapsed().as_secs_f64()))
}

/// Refuses a goal that is none.
///
/// # Errors
///
/// [`SamplingError`] names it.
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

/// What an image's samples say by themselves.
fn of(taker: &AdaptiveRenderer, noise: Noise) -> Sampling {
    let both = taker.halves.taken(0).iter().zip(taker.halves.taken(1)).map(|(a, b)| a.saturating_add(*b));
    let Settings { sampler, roulette, .. } = taker.settings;
    Sampling {
        goal: "",
        asked: 0.0,
        met: false,
        ended: !taker.should_continue(),
        noise,
        expected_error: noise.error,
        mean_samples: taker.mean_samples(),
        least_samples: both.clone().min().unwrap_or(0),
        most_samples: both.max().unwrap_or(0),
        adaptive: false,
        adaptive_gain: 1.0,
        way: Strategy { sampler, roulette, denoise: None },
        filter: None,
        trials: Vec::new(),
        seconds: 0.0,
        preparing_seconds: 0.0,
    }
}

fn sampled(
    taker: AdaptiveRenderer,
    sampling: Sampling,
    filtered: Option<(DenoiseSettings, f64)>,
    image: Image,
) -> Sampled {
    let film = taker.halves.film();
    let samples = sampling.mean_samples.round().clamp(1.0, f64::from(u32::MAX)) as u32;
    let settings = Settings { samples, ..taker.settings.clone() };
    let mut stats = taker.renderer.stats_of(&settings, taker.totals.kernel);
    stats.device_seconds = taker.totals.device.as_secs_f64();
    stats.submissions = taker.totals.submissions;
    stats.finish(film.counts(), Duration::from_secs_f64(sampling.seconds), Duration::ZERO, Duration::ZERO);
    if let Some((denoise, seconds)) = filtered {
        (stats.denoise, stats.denoise_seconds) = (Some(denoise), seconds);
    }
    stats.sampling = Some(sampling);
    Sampled { film, image, stats }
}

impl Sampling {
    /// Lines for people.
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
        if self.goal == "time" {
            let sampler =
                if way.sampler == Sampler::Sobol { "Sobol's samples" } else { "independent samples" };
            let filter = match way.denoise {
                Some(denoise) => format!("{:?}", denoise.filter).to_lowercase(),
                None => "no denoiser".to_owned(),
            };
            text += &format!(
                "\nchose {sampler}, {}, {filter} in {:.3} of {:.3} s (and {:.3} s before, to compile); expects an error of {}",
                if way.roulette { "roulette" } else { "no roulette" },
                self.seconds,
                self.asked,
                self.preparing_seconds,
                percent(self.expected_error),
            );
        }
        text
    }

    /// What was not as asked for.
    pub fn warning(&self) -> Option<String> {
        let percent = |error: f64| format!("{:.3} %", 100.0 * error);
        match self.goal {
            _ if self.met || self.ended => None,
            "error" => Some(format!(
                "the error is {}, not {}: pixels have {:.0} samples, and more need a greater --max-spp",
                percent(self.noise.error),
                percent(self.asked),
                self.mean_samples
            )),
            _ => Some(format!("took {:.3} s, not {:.3} s", self.seconds, self.asked)),
        }
    }
}

impl Renderer {
    /// Of a render that someone else counts.
    fn stats_of(&self, settings: &Settings, kernel: &'static str) -> RenderStats {
        let variant = trisect_kernels::variant_by_name(kernel).unwrap_or(trisect_kernels::VARIANTS[0]);
        RenderStats::new(self.backend().device(), settings, variant, self.phases().clone())
    }
}
