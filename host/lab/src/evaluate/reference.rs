//! References of one image, whose noise is unknown, or of several, whose noise is estimated.

use super::EvaluateError;
use super::set::{check_images, label};
use crate::accuracy::{Truth, mean_of};
use rayon::prelude::*;
use trisect::image::Image;
use trisect::metrics::{MetricsError, REL_MSE_EPSILON as EPSILON};

/// Reference images, each with a seed of its own, in the form in which sets are compared with them.
#[derive(Clone, Debug)]
pub struct ReferenceImages {
    /// Name of each image in messages.
    pub(super) labels: Vec<String>,
    pub(super) images: Vec<Image>,
    /// Means of the images at even and at odd places; empty for one image.
    halves: Vec<Image>,
    /// Mean of both halves.
    mean: Image,
    /// Variance of that mean, by pixel and channel; 0 for one image.
    variance: Vec<[f32; 3]>,
}

impl ReferenceImages {
    /// Prepares one image or several; `labels` names them in messages and may be empty.
    ///
    /// # Errors
    ///
    /// [`EvaluateError`] without an image, and for images that are equal, of several sizes, or not
    /// finite.
    pub fn new(images: Vec<Image>, labels: &[String]) -> Result<Self, EvaluateError> {
        let Some(first) = images.first() else {
            return Err(EvaluateError::TooFew { set: "the reference".to_owned(), count: 0, least: 1 });
        };
        let labels: Vec<String> = (0..images.len()).map(|place| label(labels, place)).collect();
        check_images((&labels, &images), (&[], &[]))?;
        let pixels = first.pixels.len();
        if images.len() == 1 {
            let (mean, variance) = (first.clone(), vec![[0.0; 3]; pixels]);
            return Ok(Self { labels, images, halves: Vec::new(), mean, variance });
        }
        let halves = vec![half(&images, 0), half(&images, 1)];
        let mean = mean_of(&halves[0], &halves[1]);
        let variance = (0..pixels).into_par_iter().map(|pixel| variance_of_mean(&images, pixel)).collect();
        Ok(Self { labels, images, halves, mean, variance })
    }

    /// Returns the number of images.
    pub fn count(&self) -> usize {
        self.images.len()
    }

    /// Returns the mean of both halves of the images.
    pub fn image(&self) -> &Image {
        &self.mean
    }

    /// Returns the root of the relMSE of the reference itself, estimated from its images; `None`
    /// for one image.
    pub fn error(&self) -> Option<f64> {
        let of = |(variance, mean): (&[f32; 3], &[f32; 3])| -> f64 {
            let channel = |c: usize| {
                let r = f64::from(mean[c]);
                f64::from(variance[c]) / (r * r + EPSILON)
            };
            (0..3).map(channel).sum()
        };
        let sum: f64 = self.variance.iter().zip(&self.mean.pixels).map(of).sum();
        let is_known = self.images.len() > 1;
        is_known.then(|| (sum / (3.0 * self.variance.len() as f64)).sqrt())
    }

    /// Returns the reference as the estimators take it.
    pub(super) fn truth(&self) -> Result<Truth<'_>, MetricsError> {
        let halves = match &self.halves[..] {
            [a, b] => [a, b],
            _ => [&self.mean; 2],
        };
        Truth::of_halves(halves, &self.variance, &self.mean, &self.images)
    }
}

/// Returns the mean of every second image, from the image at `first` on.
fn half(images: &[Image], first: usize) -> Image {
    let own: Vec<&Image> = images.iter().skip(first).step_by(2).collect();
    let count = own.len() as f64;
    let mean = |pixel: usize| {
        std::array::from_fn(|c| {
            let sum: f64 = own.iter().map(|image| f64::from(image.pixels[pixel][c])).sum();
            (sum / count) as f32
        })
    };
    let pixels = (0..images[0].pixels.len()).into_par_iter().map(mean).collect();
    Image { width: images[0].width, height: images[0].height, pixels }
}

/// Returns the variance of the mean of both halves in a pixel, by the variance between images.
fn variance_of_mean(images: &[Image], pixel: usize) -> [f32; 3] {
    let n = images.len() as f64;
    let (a, b) = (images.len().div_ceil(2) as f64, (images.len() / 2) as f64);
    std::array::from_fn(|c| {
        let values = images.iter().map(|image| f64::from(image.pixels[pixel][c]));
        let mean = values.clone().sum::<f64>() / n;
        let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
        (squares / (n - 1.0) * 0.25 * (1.0 / a + 1.0 / b)) as f32
    })
}
