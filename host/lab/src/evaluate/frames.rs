//! Evaluates frames of animations: the error of each frame, and how much errors flicker.

use super::set::check_images;
use super::{EvaluateError, ImageSet};
use crate::accuracy::view;
use crate::bench::Summary;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use trisect::image::Image;
use trisect::metrics::flip::DEFAULT_PIXELS_PER_DEGREE;
use trisect::metrics::{REL_MSE_EPSILON as EPSILON, hdr_flip};

/// Version of the JSON format. It is raised when a field changes its meaning or is removed.
const FORMAT: u32 = 1;

/// Minimum number of frames.
pub(super) const MIN_FRAMES: usize = 2;

/// Maximum number of frames for which HDR-FLIP is computed.
const FLIPS: usize = 4;

/// Errors and times of the frames of one configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FramesRow {
    /// Name of the configuration.
    pub name: String,
    /// Wall-clock seconds of a frame; `None` if they are not known.
    pub seconds: Option<Summary>,
    /// Seconds of all processors together; `None` if they are not known.
    pub processor_seconds: Option<Summary>,
    /// Mean relMSE of the frames. It contains the noise of the reference's frames.
    pub rel_mse: f64,
    /// relMSE of each frame.
    pub each: Vec<f64>,
    /// Mean HDR-FLIP error of up to four of the frames, evenly spaced.
    pub hdr_flip: f64,
    /// Mean squared change of the error from a frame to the next one, relative as in relMSE: mean
    /// over pixels, channels and pairs of frames of (e − e')² / (r² + 0.01), where r is the mean of
    /// the reference in both frames.
    pub flicker: f64,
    /// Flicker of each pair of consecutive frames.
    pub flicker_each: Vec<f64>,
    /// Flicker over that of errors of the same size that are independent between frames: 1 for
    /// noise with other random numbers in each frame, 0 for errors that stand still. NaN without
    /// errors.
    pub flicker_ratio: f64,
}

/// Results for the frames of one animation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct FramesEvaluation {
    /// Version of the JSON format.
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Number of frames.
    pub frames: usize,
    /// Configurations, in the order in which they were given.
    pub rows: Vec<FramesRow>,
}

/// Errors of the frames of a configuration so far.
pub(super) struct FrameErrors {
    frames: usize,
    /// The frame before, and its reference.
    before: Option<(Image, Image)>,
    each: Vec<f64>,
    flips: Vec<f64>,
    flicker_each: Vec<f64>,
    /// Sum of the flicker that independent errors would have.
    independent: f64,
}

impl FrameErrors {
    /// Starts with an animation of this number of frames.
    pub fn new(frames: usize) -> Self {
        let (each, flips, flicker_each) = (Vec::new(), Vec::new(), Vec::new());
        Self { frames, before: None, each, flips, flicker_each, independent: 0.0 }
    }

    /// Adds the next frame and its reference, each with its name in messages.
    pub fn add(
        &mut self,
        (label, image): (String, Image),
        (reference_label, reference): (String, Image),
    ) -> Result<(), EvaluateError> {
        let reference = [reference];
        check_images((std::slice::from_ref(&reference_label), &reference), (&[], &[]))?;
        check_images((&[label], std::slice::from_ref(&image)), (&[reference_label], &reference))?;
        let [reference] = reference;
        if let Some((before, _)) = &self.before
            && (before.width, before.height) != (image.width, image.height)
        {
            let size = (image.width, image.height);
            let other_size = (before.width, before.height);
            let (image, other) = (format!("frame {}", self.each.len() + 1), "the frame before".to_owned());
            return Err(EvaluateError::Size { image, size, other, other_size });
        }
        if self.each.len().is_multiple_of(self.frames.div_ceil(FLIPS).max(1)) {
            let maps = hdr_flip(&[view(&image)], &view(&reference), DEFAULT_PIXELS_PER_DEGREE)?;
            self.flips.extend(maps.iter().map(|map| map.mean));
        }
        let [own, _] = mean_of_pixels(image.pixels.len(), |pixel, c| {
            let (x, r) = (f64::from(image.pixels[pixel][c]), f64::from(reference.pixels[pixel][c]));
            [(x - r).powi(2) / (r * r + EPSILON), 0.0]
        });
        self.each.push(own);
        if let Some((before, reference_before)) = &self.before {
            let [flicker, independent] = mean_of_pixels(image.pixels.len(), |pixel, c| {
                let of = |image: &Image| f64::from(image.pixels[pixel][c]);
                let (r, r_before) = (of(&reference), of(reference_before));
                let (error, error_before) = (of(&image) - r, of(before) - r_before);
                let weight = 1.0 / ((0.5 * (r + r_before)).powi(2) + EPSILON);
                [weight * (error - error_before).powi(2), weight * (error.powi(2) + error_before.powi(2))]
            });
            self.flicker_each.push(flicker);
            self.independent += independent;
        }
        self.before = Some((image, reference));
        Ok(())
    }

    /// Returns the results of all frames.
    pub fn finish(self, set: &ImageSet) -> FramesRow {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        FramesRow {
            name: set.name.clone(),
            seconds: Summary::of(&set.times.seconds),
            processor_seconds: Summary::of(&set.times.processor_seconds),
            rel_mse: mean(&self.each),
            hdr_flip: mean(&self.flips),
            flicker: mean(&self.flicker_each),
            flicker_ratio: self.flicker_each.iter().sum::<f64>() / self.independent,
            each: self.each,
            flicker_each: self.flicker_each,
        }
    }
}

/// Returns the means over pixels and channels of two values.
fn mean_of_pixels(pixels: usize, of: impl Fn(usize, usize) -> [f64; 2] + Sync) -> [f64; 2] {
    let part = |first: usize| {
        let mut sums = [0.0; 2];
        for pixel in first..(first + 1024).min(pixels) {
            for c in 0..3 {
                let [a, b] = of(pixel, c);
                sums = [sums[0] + a, sums[1] + b];
            }
        }
        sums
    };
    let parts: Vec<[f64; 2]> =
        (0..pixels.div_ceil(1024)).into_par_iter().map(|part_index| part(1024 * part_index)).collect();
    let sums = parts.iter().fold([0.0; 2], |sums, part| [sums[0] + part[0], sums[1] + part[1]]);
    sums.map(|sum| sum / (3 * pixels.max(1)) as f64)
}

/// Checks that a configuration has as many frames as the reference, at least two.
pub(super) fn check_count(set: &str, count: usize, reference: usize) -> Result<(), EvaluateError> {
    let set = set.to_owned();
    match count {
        _ if count < MIN_FRAMES => Err(EvaluateError::FewFrames { set, count, least: MIN_FRAMES }),
        _ if count != reference => Err(EvaluateError::Frames { set, count, reference }),
        _ => Ok(()),
    }
}

impl FramesEvaluation {
    /// Creates an evaluation without rows of frames of this size.
    pub(super) fn new((width, height): (u32, u32), frames: usize) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { format: FORMAT, version, width, height, frames, rows: Vec::new() }
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

/// Evaluates sets of frames, each frame against the reference's frame in its place.
///
/// # Errors
///
/// [`EvaluateError`] for sets with another number of frames than the reference, frames of another
/// size, frames equal to their reference, values that are not finite, and times that are not
/// positive.
pub fn evaluate_frames(sets: &[ImageSet], reference: &[Image]) -> Result<FramesEvaluation, EvaluateError> {
    check_count("the reference", reference.len(), reference.len())?;
    let size = reference.first().map_or((0, 0), |first| (first.width, first.height));
    let mut found = FramesEvaluation::new(size, reference.len());
    for set in sets {
        check_count(&set.name, set.images.len(), reference.len())?;
        set.times.check(&set.name, set.images.len())?;
        let mut errors = FrameErrors::new(reference.len());
        for (place, (image, of)) in set.images.iter().zip(reference).enumerate() {
            let label = set.labels.get(place).cloned();
            let label = label.unwrap_or_else(|| format!("{}, frame {}", set.name, place + 1));
            errors.add((label, image.clone()), (format!("reference, frame {}", place + 1), of.clone()))?;
        }
        found.rows.push(errors.finish(set));
    }
    Ok(found)
}

#[cfg(test)]
mod tests;
