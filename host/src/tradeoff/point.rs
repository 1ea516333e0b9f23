//! What was found.

use super::configuration::Configuration;
use super::errors::Errors;
use super::reference::ReferenceInfo;
use super::supervisor::Stop;
use crate::bench::Summary;
use crate::statistics::{Interval, Welch, mean_and_error, welch};
use serde::{Deserialize, Serialize};

/// Version of the JSON. A field that changes its meaning, or goes, raises it.
pub const FORMAT: u32 = 1;

/// Wall-clock seconds of a render, over its repetitions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Of all that makes the image.
    pub all: Summary,
    /// Median of rendering, with the sums.
    pub render: f64,
    /// Median of denoising, with the copies to and from the device.
    pub denoise: f64,
    /// Median of scaling to the image's size.
    pub scale: f64,
    /// `all` of each repetition.
    pub each: Vec<f64>,
}

/// A way of rendering beside the base with as many samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VsBase {
    /// Its seconds over the base's.
    pub time: f64,
    /// Its relMSE over the base's.
    pub error: f64,
    /// Whether times differ, by their logarithms.
    pub time_test: Welch,
    /// The same of relMSE.
    pub error_test: Welch,
    /// Its efficiency over the base's: how many times faster it reaches the same error, where that is noise.
    pub efficiency: Interval,
    /// Whether time, error or bias differ by more than noise does.
    pub measurable: bool,
}

/// One way of rendering with one number of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// As [`Configuration::knob`](super::Configuration::knob).
    pub knob: String,
    /// As [`Configuration::level`](super::Configuration::level).
    pub level: String,
    /// As [`Configuration::is_exact`](super::Configuration::is_exact).
    #[serde(default)]
    pub exact: bool,
    /// Samples a pixel of what was rendered.
    pub spp: u32,
    /// What it takes.
    pub seconds: Seconds,
    /// How wrong it is.
    pub errors: Errors,
    /// 1 / (relMSE × seconds).
    pub efficiency: Interval,
    /// Beside the base; none for the base itself.
    pub against: Option<VsBase>,
    /// Whether nothing else is both faster and nearer.
    pub on_front: bool,
}

/// How the error of a way falls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// As [`Point::knob`].
    pub knob: String,
    /// As [`Point::level`].
    pub level: String,
    /// Of log relative RMSE over log seconds; -1/2 for noise.
    pub over_time: Option<f64>,
    /// Over log samples.
    pub over_samples: Option<f64>,
}

/// A way of rendering, or numbers of samples of it, that were not measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    /// As [`Point::knob`].
    pub knob: String,
    /// As [`Point::level`].
    pub level: String,
    /// Why.
    pub reason: String,
}

/// All that was found of a scene on a device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tradeoff {
    /// Of the JSON.
    pub format: u32,
    /// Of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// `cpu`, `wgpu` or `cuda`, and the device.
    pub device: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Segments a path, at most, of the base.
    pub depth: u32,
    /// What errors are measured against; `None` if the end came before there was any.
    pub reference: Option<ReferenceInfo>,
    /// Repetitions of each point.
    pub seeds: usize,
    /// Standard deviation of the base's time from minute to minute, relative: the clock of a machine drifts, and what others do on it.
    pub drift: f64,
    /// In the order of the knobs.
    pub points: Vec<Point>,
    /// Of each way.
    pub slopes: Vec<Slope>,
    /// What could not be measured.
    pub missing: Vec<Missing>,
    /// Why it ended before all was measured, if so.
    #[serde(default)]
    pub ended: Option<Stop>,
    /// Of the whole measurement.
    pub seconds: f64,
}

impl Missing {
    pub(super) fn new(mode: &Configuration, reason: String) -> Self {
        Self { knob: mode.knob.to_owned(), level: mode.level.clone(), reason }
    }

    /// One line for people.
    pub fn line(&self) -> String {
        format!("not measured: {} {}: {}", self.knob, self.level, self.reason)
    }
}

impl Point {
    /// Knob and level, as [`Configuration::name`](super::Configuration::name).
    pub fn name(&self) -> String {
        if self.knob == "base" { self.knob.clone() } else { format!("{} {}", self.knob, self.level) }
    }

    /// The root of the relMSE; of what is none by chance, 0.
    pub fn relative_error(&self) -> f64 {
        self.errors.rel_mse.value.max(0.0).sqrt()
    }

    /// In a word: what turning the knob did.
    pub fn verdict(&self) -> &'static str {
        match &self.against {
            _ if self.errors.bias().is_seen() && self.exact => "rare paths",
            _ if self.errors.bias().is_seen() => "biased",
            None if self.knob == "base" => "base",
            None => "measured",
            Some(against) if !against.measurable => "not measurable here",
            Some(against) if against.efficiency.low > 1.0 => "better",
            Some(against) if against.efficiency.high < 1.0 => "worse",
            Some(_) => "no clear gain",
        }
    }
}

impl VsBase {
    /// `point` beside `base`, on a device whose speed has this standard deviation from minute to minute, relative.
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
