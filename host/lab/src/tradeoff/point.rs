//! Results of a trade-off measurement, as its JSON holds them.

use super::configuration::Configuration;
use super::others::OtherRenderer;
use super::reference::ReferenceInfo;
use super::supervisor::Stop;
use crate::accuracy::{Bias, Errors};
use crate::bench::Summary;
use crate::statistics::{Interval, Welch, mean_and_error, welch};
use serde::{Deserialize, Serialize};

/// Relative error above which an image is of no use. That of a black image is at most 1: an error
/// of 0.94 is nearly that of no image at all, and says nothing about an option's gain.
pub const MAX_USEFUL_ERROR: f64 = 0.5;

/// Version of the JSON format. It is raised when a field changes its meaning or is removed.
pub const FORMAT: u32 = 1;

/// Wall-clock seconds of a render, over its repetitions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Seconds {
    /// Summary of `each`.
    pub all: Summary,
    /// Median of rendering, with sums of the film and, without a denoiser, the image made from
    /// them.
    pub render: f64,
    /// Median of denoising, with the copies to and from the device.
    pub denoise: f64,
    /// Median of scaling to the image's size.
    pub scale: f64,
    /// Rendering, denoising and scaling together, by repetition.
    pub each: Vec<f64>,
}

/// Comparison of a point with the base at the same number of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VsBase {
    /// Time over the base's time.
    pub time: f64,
    /// relMSE over the base's relMSE.
    pub error: f64,
    /// Welch's test of the logarithms of the times, with the machine's drift.
    pub time_test: Welch,
    /// Welch's test of the logarithms of relMSE.
    pub error_test: Welch,
    /// Efficiency over the base's: how many times faster the same error is reached, where the error
    /// is noise.
    pub efficiency: Interval,
    /// True if time, error or bias differ by more than noise.
    pub measurable: bool,
}

/// Measurement of one configuration with one number of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Point {
    /// Knob, as in [`Configuration::knob`](super::Configuration::knob).
    pub knob: String,
    /// Level, as in [`Configuration::level`](super::Configuration::level).
    pub level: String,
    /// True if the configuration has no bias by construction: see
    /// [`Configuration::is_exact`](super::Configuration::is_exact).
    #[serde(default)]
    pub exact: bool,
    /// Samples per rendered pixel.
    pub spp: u32,
    /// Render times.
    pub seconds: Seconds,
    /// Errors against the reference.
    pub errors: Errors,
    /// 1 / (relMSE × seconds).
    pub efficiency: Interval,
    /// Comparison with the base; `None` for the base itself.
    pub against: Option<VsBase>,
    /// True if no other point is at least as fast and as accurate, and better in one of the two.
    pub on_front: bool,
    /// Command line that renders such an image; `None` if none does.
    #[serde(default)]
    pub command: Option<String>,
}

/// Purpose of a recommended point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// An image soon.
    Fast,
    /// An image in between.
    Balanced,
    /// The most accurate image.
    Best,
}

/// Point that is recommended for this scene on this device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Recommended {
    /// Purpose.
    pub purpose: Purpose,
    /// Knob, as in [`Point::knob`].
    pub knob: String,
    /// Level, as in [`Point::level`].
    pub level: String,
    /// Samples per pixel, as in [`Point::spp`].
    pub spp: u32,
}

/// Slope of a configuration's error over time and over samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Slope {
    /// Knob, as in [`Point::knob`].
    pub knob: String,
    /// Level, as in [`Point::level`].
    pub level: String,
    /// Slope of log relative RMSE over log seconds; -1/2 for noise.
    pub over_time: Option<f64>,
    /// Slope of log relative RMSE over log samples.
    pub over_samples: Option<f64>,
}

/// A configuration, or numbers of samples of it, that was not measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Missing {
    /// Knob, as in [`Point::knob`].
    pub knob: String,
    /// Level, as in [`Point::level`].
    pub level: String,
    /// Numbers of samples, if not all, and the cause.
    pub reason: String,
}

/// Results for one scene on one device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Tradeoff {
    /// Version of the JSON format.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// `cpu`, `wgpu` or `cuda`, and the device.
    pub device: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Edges of the scene's image over those of the measured images: 1 unless the time was too
    /// short for the whole size.
    #[serde(default = "whole_size")]
    pub reduction: u32,
    /// Maximum number of segments of a path, for the base.
    pub depth: u32,
    /// Reference that errors are measured against; `None` if the measurement ended before there was
    /// one.
    pub reference: Option<ReferenceInfo>,
    /// Repetitions of each point.
    pub seeds: usize,
    /// Relative standard deviation of the base's time over the measurement: clock rates drift, and
    /// other programs use the machine.
    pub drift: f64,
    /// Recommended points for this scene: fast, balanced and best. Empty if none is good enough.
    #[serde(default)]
    pub recommended: Vec<Recommended>,
    /// Points, in the order of the knobs.
    pub points: Vec<Point>,
    /// Images of other renderers, measured against the same reference.
    #[serde(default)]
    pub others: Vec<OtherRenderer>,
    /// Slopes of each configuration.
    pub slopes: Vec<Slope>,
    /// Configurations and numbers of samples that were not measured.
    pub missing: Vec<Missing>,
    /// Reason why the measurement ended early, if it did.
    #[serde(default)]
    pub ended: Option<Stop>,
    /// Duration of the whole measurement in seconds.
    pub seconds: f64,
}

fn whole_size() -> u32 {
    1
}

impl Purpose {
    /// Returns the purpose as a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Best => "best",
        }
    }
}

impl Tradeoff {
    /// Returns the recommended points, each with its purpose.
    pub fn recommended_points(&self) -> impl Iterator<Item = (Purpose, &Point)> {
        self.recommended.iter().filter_map(|of| {
            let is_it =
                |point: &&Point| (&point.knob, &point.level, point.spp) == (&of.knob, &of.level, of.spp);
            Some((of.purpose, self.points.iter().find(is_it)?))
        })
    }
}

impl Missing {
    pub(super) fn new(mode: &Configuration, reason: String) -> Self {
        Self { knob: mode.knob.to_owned(), level: mode.level.clone(), reason }
    }

    /// Returns one line for people.
    pub fn line(&self) -> String {
        format!("not measured: {} {}: {}", self.knob, self.level, self.reason)
    }
}

impl Point {
    /// Returns knob and level, as [`Configuration::name`](super::Configuration::name) does.
    pub fn name(&self) -> String {
        if self.knob == "base" { self.knob.clone() } else { format!("{} {}", self.knob, self.level) }
    }

    /// Returns the root of relMSE; 0 if the estimate of relMSE is negative by chance.
    pub fn relative_error(&self) -> f64 {
        root(self.errors.rel_mse.value)
    }

    /// Returns the upper end of the interval of [`relative_error`](Self::relative_error).
    pub fn max_relative_error(&self) -> f64 {
        root(self.errors.rel_mse.high)
    }

    /// Returns whether the error is too large for the point to be called better than another one.
    pub fn is_too_inaccurate(&self) -> bool {
        self.relative_error().is_nan() || self.relative_error() > MAX_USEFUL_ERROR
    }

    /// Returns the verdict on the knob in a word or two.
    pub fn verdict(&self) -> &'static str {
        let bias = self.errors.bias();
        match &self.against {
            _ if self.exact && (bias.is_seen() || bias == Bias::Suspected) => "rare paths",
            _ if bias.is_seen() => "biased",
            _ if bias == Bias::Suspected => "bias suspected",
            None if self.knob == "base" => "base",
            None => "measured",
            Some(against) if !against.measurable => "not measurable here",
            Some(_) if self.is_too_inaccurate() => "too inaccurate",
            Some(against) if against.efficiency.low > 1.0 => "better",
            Some(against) if against.efficiency.high < 1.0 => "worse",
            Some(_) => "no clear gain",
        }
    }
}

/// Returns the root of an estimate, which may be negative by chance. NaN stays NaN.
fn root(value: f64) -> f64 {
    if value < 0.0 { 0.0 } else { value.sqrt() }
}

impl VsBase {
    /// Compares `point` with `base` on a device whose speed varies over the measurement by the
    /// relative standard deviation `drift`.
    pub(super) fn of(point: &Point, base: &Point, drift: f64) -> Self {
        let logs = |values: &[f64]| {
            let logs: Vec<f64> = values.iter().map(|value| value.max(1e-300).ln()).collect();
            let (mean, error) = mean_and_error(&logs);
            (mean, error, logs.len() as f64 - 1.0)
        };
        let drifting = |(mean, error, freedom): (f64, f64, f64)| (mean, error.hypot(drift), freedom);
        let (times, base_times) = (drifting(logs(&point.seconds.each)), drifting(logs(&base.seconds.each)));
        let (errors, base_errors) = (logs(&point.errors.each), logs(&base.errors.each));
        let time_test = welch(times, base_times);
        let error_test = point.errors.differs(&base.errors);
        let change = base_times.0 + base_errors.0 - times.0 - errors.0;
        let parts = [times, base_times, errors, base_errors];
        let error = parts.iter().map(|part| part.1 * part.1).sum::<f64>().sqrt();
        let freedom = parts.iter().map(|part| part.2).sum();
        let least = 0.05;
        let measurable = point.errors.bias().is_seen() || time_test.p < least || error_test.p < least;
        Self {
            time: (times.0 - base_times.0).exp(),
            error: (errors.0 - base_errors.0).exp(),
            time_test,
            error_test,
            efficiency: Interval::of(change, error, freedom).map(f64::exp),
            measurable,
        }
    }
}
