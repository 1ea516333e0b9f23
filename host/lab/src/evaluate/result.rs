//! Results of an evaluation, as its JSON holds them.

use super::{EvaluateError, ImageSet, ReferenceImages};
use crate::accuracy::{Errors, SpectrumBand, Truth, flips_of, spectrum, view};
use crate::bench::Summary;
use crate::statistics::Interval;
use serde::{Deserialize, Serialize};
use trisect::image::Image;
use trisect::metrics::flip::DEFAULT_PIXELS_PER_DEGREE;
use trisect::metrics::{ImageView, hdr_flip};

/// Version of the JSON format. It is raised when a field changes its meaning or is removed.
const FORMAT: u32 = 1;

/// Errors and times of one configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Row {
    /// Name of the configuration.
    pub name: String,
    /// Wall-clock seconds of an image; `None` if they are not known.
    pub seconds: Option<Summary>,
    /// Seconds of all processors together; `None` if they are not known.
    pub processor_seconds: Option<Summary>,
    /// Errors against the reference.
    pub errors: Errors,
    /// Mean HDR-FLIP error of the images of which [`Errors::flip`] is: the maximum over exposures,
    /// so that values above 1 count, too.
    pub hdr_flip: Interval,
    /// 1 / (relMSE × median seconds); `None` without times.
    pub efficiency: Option<Interval>,
    /// Relative noise of an image that takes one second, if the variance falls with the time: the
    /// root of variance × median seconds. `None` without times.
    pub noise_at_one_second: Option<Interval>,
    /// relMSE by spatial frequency, ascending.
    #[serde(default)]
    pub spectrum: Vec<SpectrumBand>,
}

/// Description of the reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EvaluationReference {
    /// Number of images.
    pub images: usize,
    /// Root of the relMSE of the reference itself, which the errors do not contain. `None` for one
    /// image: its noise is unknown, and is part of relMSE, squared bias and RMSE.
    pub error: Option<f64>,
}

/// Results for the images of one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Evaluation {
    /// Version of the JSON format.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Reference that errors are measured against.
    pub reference: EvaluationReference,
    /// Configurations, in the order in which they were given.
    pub rows: Vec<Row>,
}

impl Row {
    /// Evaluates a set against a reference, and checks that its images are none of the named ones
    /// that `truth` was made of.
    pub(super) fn of(
        set: &ImageSet,
        reference: (&[String], &[Image]),
        truth: &Truth,
    ) -> Result<Self, EvaluateError> {
        set.check(reference)?;
        let flips = flips_of(truth.image.pixels.len() as u64, set.images.len());
        let views: Vec<ImageView> = set.images.iter().take(flips).map(view).collect();
        let flip = |image| truth.seen.flip(image).map(|map| map.mean);
        let flips: Vec<f64> = views.iter().map(flip).collect::<Result<_, _>>()?;
        let hdr = hdr_flip(&views, &view(truth.image), DEFAULT_PIXELS_PER_DEGREE)?;
        let hdr: Vec<f64> = hdr.iter().map(|map| map.mean).collect();
        let errors = Errors::of(&set.images, truth, &flips)?;
        let seconds = Summary::of(&set.times.seconds);
        let median = seconds.map(|seconds| seconds.median);
        let at_one_second = |seconds: f64| errors.variance.map(|v| (v.max(0.0) * seconds).sqrt());
        Ok(Self {
            name: set.name.clone(),
            seconds,
            processor_seconds: Summary::of(&set.times.processor_seconds),
            hdr_flip: Interval::of_mean(&hdr),
            efficiency: median.map(|seconds| errors.efficiency(seconds)),
            noise_at_one_second: median.map(at_one_second),
            spectrum: spectrum(&set.images, truth),
            errors,
        })
    }
}

impl Evaluation {
    /// Creates an evaluation without rows.
    pub(super) fn new(reference: &ReferenceImages) -> Self {
        let image = reference.image();
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            width: image.width,
            height: image.height,
            reference: EvaluationReference { images: reference.count(), error: reference.error() },
            rows: Vec::new(),
        }
    }

    /// Returns the results as JSON.
    ///
    /// # Errors
    ///
    /// [`EvaluateError::Encode`].
    pub fn json(&self) -> Result<String, EvaluateError> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|error| EvaluateError::Encode { message: error.to_string() })
    }
}
