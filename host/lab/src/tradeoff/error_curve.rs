//! Error of a configuration over the number of samples, with a verdict.

use super::point::Missing;
use super::reference::ReferenceInfo;
use super::supervisor::Stop;
use crate::accuracy::{Bias, Errors};
use crate::bench::Line;
use crate::statistics::{Interval, jackknife_error};
use serde::{Deserialize, Serialize};

/// Maximum deviation of a noise-like slope from -1/2.
const TOLERANCE: f64 = 0.05;

/// Minimum number of captures (numbers of samples per pixel) for a slope.
pub(super) const MIN_CAPTURES: usize = 3;

/// Errors of the images at one number of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Capture {
    /// Samples per pixel.
    pub spp: u32,
    /// Errors at that number of samples.
    pub errors: Errors,
}

/// Error of a configuration over the number of samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ErrorCurve {
    /// Name, as returned by [`Configuration::name`](super::Configuration::name).
    pub mode: String,
    /// Errors by number of samples, ascending.
    pub captures: Vec<Capture>,
    /// Slope of log relative RMSE over log samples: -1/2 for independent noise. `None` for fewer
    /// than three numbers of samples.
    pub slope: Option<Interval>,
    /// Relative error that more samples do not lower; `None` if no such bias was seen.
    pub plateau: Option<f64>,
    /// Verdict in words.
    pub verdict: String,
}

/// Comparison of two configurations without a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Pair {
    /// Names, as returned by [`Configuration::name`](super::Configuration::name).
    pub modes: [String; 2],
    /// Mean over all pixels of the first over that of the second, less 1.
    pub brightness: Interval,
    /// Probability that the means of the whole image and of blocks differ at least as much if both
    /// configurations converge to one image (Welch's test, Šidák's correction).
    pub p: f64,
    /// True if `p` is below the significance level.
    pub differ: bool,
}

/// Results of a convergence measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Convergence {
    /// Version of the JSON format.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// Reference that errors are measured against; `None` if the measurement ended before there was
    /// one.
    pub reference: Option<ReferenceInfo>,
    /// Repetitions (seeds) of each configuration.
    pub seeds: usize,
    /// Error curve of each configuration.
    pub courses: Vec<ErrorCurve>,
    /// Comparison of each pair of configurations, each at the largest number of samples that it
    /// reached.
    pub pairs: Vec<Pair>,
    /// Configurations and numbers of samples that were not measured.
    #[serde(default)]
    pub missing: Vec<Missing>,
    /// Reason why the measurement ended early, if it did.
    #[serde(default)]
    pub ended: Option<Stop>,
}

impl ErrorCurve {
    /// Builds the error curve of a configuration from its captures.
    pub fn of(mode: String, captures: Vec<Capture>) -> Self {
        let seeds = captures.first().map_or(0, |capture| capture.errors.each.len());
        let slope = |without: Option<usize>| {
            let point = |capture: &Capture| {
                let each = capture.errors.each.iter().enumerate();
                let kept: Vec<f64> = each.filter(|(s, _)| Some(*s) != without).map(|(_, e)| *e).collect();
                let mean = kept.iter().sum::<f64>() / kept.len().max(1) as f64;
                (f64::from(capture.spp).ln(), 0.5 * mean.ln())
            };
            Line::through(&captures.iter().map(point).collect::<Vec<_>>()).map_or(f64::NAN, |line| line.slope)
        };
        let without: Vec<f64> = (0..seeds).map(|s| slope(Some(s))).collect();
        let slope = Interval::of(slope(None), jackknife_error(&without), seeds as f64 - 1.0);
        let slope = (captures.len() >= MIN_CAPTURES).then_some(slope);
        let last = captures.last().map(|capture| &capture.errors);
        let bias = last.map_or(Bias::NotSeen, Errors::bias);
        let plateau = if let Bias::Size(size) = bias { Some(size) } else { None };
        let verdict = match (bias, slope) {
            (Bias::Size(size), _) => format!("ends at {:.3} %: biased", 100.0 * size),
            (Bias::Brightness(_), _) => format!("{bias}: biased"),
            (Bias::Suspected, _) => bias.to_string(),
            (_, None) => "too few numbers of samples to tell".to_owned(),
            (_, Some(slope)) if slope.low <= -0.5 + TOLERANCE && slope.high >= -0.5 - TOLERANCE => {
                "falls as noise does".to_owned()
            }
            (_, Some(slope)) if slope.value < -0.5 => "falls faster than noise".to_owned(),
            (_, Some(_)) => "falls slower than noise".to_owned(),
        };
        Self { mode, captures, slope, plateau, verdict }
    }

    /// Returns one line for people.
    pub fn line(&self) -> String {
        let errors: Vec<String> = self
            .captures
            .iter()
            .map(|c| format!("{}: {:.3} %", c.spp, 100.0 * c.errors.rel_mse.value.max(0.0).sqrt()))
            .collect();
        let slope = self.slope.map_or(String::new(), |Interval { value, low, high }| {
            format!("slope {value:.3} ({low:.3} to {high:.3}), ")
        });
        format!("{}: {slope}{}; {}", self.mode, self.verdict, errors.join(", "))
    }
}

impl Convergence {
    fn base(&self) -> &str {
        self.courses.first().map_or("", |course| &course.mode)
    }

    /// Returns a summary for people: which configurations differ from the base, and what was not
    /// measured.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "{}: {} seeds; {}\n",
            self.scene,
            self.seeds,
            ReferenceInfo::summary(self.reference.as_ref())
        );
        for pair in self.pairs.iter().filter(|pair| pair.modes[0] == self.base()) {
            let [a, b] = &pair.modes;
            let how = if pair.differ { "converge to different images" } else { "no difference seen" };
            let brightness = 100.0 * pair.brightness.value;
            text += &format!("{a} against {b}: {how} (p = {:.2e}, brightness {brightness:+.4} %)\n", pair.p);
        }
        for missing in &self.missing {
            text += &(missing.line() + "\n");
        }
        text
    }
}
