//! Images of one configuration, and their checks.

use super::{EvaluateError, Times};
use trisect::image::Image;

/// Minimum number of images of a configuration.
pub(super) const MIN_IMAGES: usize = 2;

/// Images of one configuration of a renderer: one scene and one number of samples, with a seed of
/// its own for each.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageSet {
    /// Name of the configuration.
    pub name: String,
    /// Images of linear radiance.
    pub images: Vec<Image>,
    /// Name of each image in messages, such as its file.
    pub labels: Vec<String>,
    /// Times of rendering.
    pub times: Times,
}

impl ImageSet {
    /// Names images by the configuration and their places in it, from 1.
    pub fn new(name: impl Into<String>, images: Vec<Image>, times: Times) -> Self {
        let name = name.into();
        let labels = (1..=images.len()).map(|place| format!("{name}, image {place}")).collect();
        Self { name, images, labels, times }
    }

    /// Checks the number of images, and that each is finite, and of the size of the first one of
    /// `reference` but different from all of them and from each other.
    pub(super) fn check(&self, reference: (&[String], &[Image])) -> Result<(), EvaluateError> {
        if self.images.len() < MIN_IMAGES {
            let (set, count) = (self.name.clone(), self.images.len());
            return Err(EvaluateError::TooFew { set, count, least: MIN_IMAGES });
        }
        check_images((&self.labels, &self.images), reference)?;
        self.times.check(&self.name, self.images.len())
    }
}

/// Returns the name of an image.
pub(super) fn label(labels: &[String], place: usize) -> String {
    labels.get(place).cloned().unwrap_or_else(|| format!("reference, image {}", place + 1))
}

/// Checks that each image is finite, of the size of the first one of `others`, and different from
/// all of them and from each other. Images have their names before them.
pub(super) fn check_images(
    (labels, images): (&[String], &[Image]),
    (other_labels, others): (&[String], &[Image]),
) -> Result<(), EvaluateError> {
    for (place, image) in images.iter().enumerate() {
        let size = (image.width, image.height);
        let of = others.first().unwrap_or(&images[0]);
        let other_size = (of.width, of.height);
        if size != other_size || image.pixels.len() != of.pixels.len() {
            let other = label(if others.is_empty() { labels } else { other_labels }, 0);
            return Err(EvaluateError::Size { image: label(labels, place), size, other, other_size });
        }
        let bad = |pixel: &[f32; 3]| pixel.iter().any(|value| !value.is_finite());
        if let Some(first) = image.pixels.iter().position(bad) {
            let count = image.pixels[first..].iter().filter(|pixel| bad(pixel)).count();
            let (x, y) = (first as u32 % image.width, first as u32 / image.width);
            return Err(EvaluateError::NotFinite { image: label(labels, place), count, x, y });
        }
        let equal = |of: &[Image]| of.iter().position(|other| other.pixels == image.pixels);
        let first = equal(&images[..place]).map(|first| label(labels, first));
        if let Some(first) = first.or_else(|| equal(others).map(|first| label(other_labels, first))) {
            return Err(EvaluateError::Equal { first, second: label(labels, place) });
        }
    }
    Ok(())
}
