//! Report of a render with a goal.

use crate::denoise::Denoiser;
use crate::settings::Sampler;
use serde::Serialize;
use std::time::Duration;

/// Noise of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Noise {
    /// Root of the estimated relMSE: of the mean over pixels and channels of variance / (mean² +
    /// 0.01).
    pub error: f64,
    /// Error that 99 of 100 pixels are below.
    pub percentile_99: f64,
}

/// State of a render with a goal, before one of its passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalProgress {
    /// Estimated root of the relMSE of the image so far; NaN if it was not measured.
    pub error: f64,
    /// Requested error as a fraction, if the goal is an error.
    pub target: Option<f64>,
    /// Estimated time until the goal, or until the maximum number of samples; `None` if unknown.
    pub left: Option<Duration>,
}

/// Trial of a sampling strategy on some rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Trial {
    /// Strategy, in words.
    pub way: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Device time, in seconds.
    pub seconds: f64,
    /// Root of the estimated relMSE, as in [`Noise::error`].
    pub error: f64,
    /// error² × seconds relative to the first strategy, from this trial and the prior knowledge of
    /// such strategies. The lowest is best.
    pub cost: f64,
}

/// Expected effect of the denoiser, from the two halves of the image during the render.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FilterTrial {
    /// Expected root of the relMSE at the end, denoised.
    pub filtered: f64,
    /// Expected root of the relMSE at the end, not denoised.
    pub plain: f64,
}

/// Report of how the samples were taken, and of the error to expect.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Sampling {
    /// Kind of the goal: `error` or `time`.
    pub goal: &'static str,
    /// Requested error as a fraction, or time in seconds.
    pub asked: f64,
    /// True if the goal was met: an error at most the target, or a time within 5 %.
    pub met: bool,
    /// True if the observer ended the render before the goal was met.
    pub ended: bool,
    /// Estimated noise of the samples.
    pub noise: Noise,
    /// Expected root of the relMSE of the image as it was written.
    pub expected_error: f64,
    /// Mean samples per pixel.
    pub mean_samples: f64,
    /// Minimum samples of a pixel.
    pub least_samples: u32,
    /// Maximum samples of a pixel.
    pub most_samples: u32,
    /// True if samples were distributed by noise.
    pub adaptive: bool,
    /// Estimated work of uniform sampling over that of adaptive sampling for the same error.
    pub adaptive_gain: f64,
    /// Strategy that was chosen.
    pub way: Strategy,
    /// Expected effect of the denoiser, if there was a trial.
    pub filter: Option<FilterTrial>,
    /// Error of a denoiser that might have been chosen, and could not be used.
    pub denoiser_error: Option<String>,
    /// Trials of strategies.
    pub trials: Vec<Trial>,
    /// Seconds from the first sample to the image.
    pub seconds: f64,
    /// Seconds before the first sample, to compile kernels and allocate memory.
    pub preparing_seconds: f64,
}

/// Strategy of sampling and denoising.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Strategy {
    /// Sampler.
    pub sampler: Sampler,
    /// True if Russian roulette was on.
    pub roulette: bool,
    /// Denoiser, if the image was denoised.
    pub denoise: Option<Denoiser>,
}
