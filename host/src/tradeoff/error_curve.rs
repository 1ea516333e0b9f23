//! Error against the number of samples: the course of each way, and its verdict.

use super::bias::Bias;
use super::errors::Errors;
use super::point::Missing;
use super::reference::ReferenceInfo;
use super::supervisor::Stop;
use crate::bench::Line;
use crate::statistics::{Interval, jackknife_error};
use serde::{Deserialize, Serialize};

/// How far a slope may be from -1/2.
const TOLERANCE: f64 = 0.05;

/// Numbers of samples that tell a slope.
pub(super) const MIN_CAPTURES: usize = 3;

/// Samples that go by before an image is looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capture {
    /// Samples a pixel.
    pub spp: u32,
    /// Then.
    pub errors: Errors,
}

/// How the error of a way of rendering falls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorCurve {
    /// As [`Configuration::name`](super::Configuration::name).
    pub mode: String,
    /// From few samples to many.
    pub captures: Vec<Capture>,
    /// Of log relative RMSE over log samples: -1/2 for independent noise. `None` of fewer than
    /// three numbers of samples.
    pub slope: Option<Interval>,
    /// Where the error ends that no samples lower, relative; none where no bias was seen.
    pub plateau: Option<f64>,
    /// In words.
    pub verdict: String,
}

/// Two ways of rendering beside each other, without a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// As [`Configuration::name`](super::Configuration::name).
    pub modes: [String; 2],
    /// Mean over all pixels of the first over the second's, less 1.
    pub brightness: Interval,
    /// The chance of means that differ as much, of the whole and of blocks, if both converge to one
    /// image (Welch's test, Šidák's correction).
    pub p: f64,
    /// Whether that is too small to believe.
    pub differ: bool,
}

/// All that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Convergence {
    /// Of the JSON.
    pub format: u32,
    /// Of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// What errors are measured against; `None` if the end came before there was any.
    pub reference: Option<ReferenceInfo>,
    /// Repetitions.
    pub seeds: usize,
    /// Each way.
    pub courses: Vec<ErrorCurve>,
    /// Each two of them, with the most samples that each has.
    pub pairs: Vec<Pair>,
    /// What could not be measured.
    #[serde(default)]
    pub missing: Vec<Missing>,
    /// Why it ended before all was measured, if so.
    #[serde(default)]
    pub ended: Option<Stop>,
}

impl ErrorCurve {
    /// Of what was seen.
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
            (_, None) => "too few numbers of samples to tell".to_owned(),
            (_, Some(slope)) if slope.low <= -0.5 + TOLERANCE && slope.high >= -0.5 - TOLERANCE => {
                "falls as noise does".to_owned()
            }
            (_, Some(slope)) if slope.value < -0.5 => "falls faster than noise".to_owned(),
            (_, Some(_)) => "falls slower than noise".to_owned(),
        };
        Self { mode, captures, slope, plateau, verdict }
    }

    /// One line for people.
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

    /// Which ways differ from the base, for people.
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
