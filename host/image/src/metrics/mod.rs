//! Measures of the difference between a rendered image and a reference: relMSE, RMSE, PSNR and
//! FLIP. Used by `trisect compare` and the trade-off lab.

mod colour;
mod convolve;
pub mod flip;
mod hdr_flip;
pub mod srgb;

pub use hdr_flip::hdr_flip;

use rayon::prelude::*;
use serde::{Serialize, Serializer};

/// Offset in the denominator of relMSE. It bounds the weight of dark pixels.
pub const REL_MSE_EPSILON: f64 = 0.01;

/// A borrowed image of linear Rec. 709 radiance.
///
/// The fields are public, so every measure checks the shape again.
#[derive(Clone, Copy, Debug)]
pub struct ImageView<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` pixels, row-major, top row first.
    pub pixels: &'a [[f32; 3]],
}

impl<'a> ImageView<'a> {
    /// Views `pixels` as an image of `width` by `height`.
    ///
    /// # Errors
    /// [`MetricsError::Empty`] if the image has no pixel,
    /// [`MetricsError::PixelCount`] if `pixels` does not hold
    /// `width * height` of them.
    pub fn new(width: usize, height: usize, pixels: &'a [[f32; 3]]) -> Result<Self, MetricsError> {
        let view = Self { width, height, pixels };
        view.check().map(|()| view)
    }

    fn check(&self) -> Result<(), MetricsError> {
        let &Self { width, height, pixels } = self;
        if width == 0 || height == 0 {
            return Err(MetricsError::Empty { width, height });
        }
        // A product beyond usize cannot equal any length.
        if width.checked_mul(height) != Some(pixels.len()) {
            return Err(MetricsError::PixelCount { width, height, actual: pixels.len() });
        }
        Ok(())
    }
}

/// Reason why images cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// The image has no pixel.
    #[error("an image of {width}x{height} has no pixel")]
    Empty {
        /// Stated columns.
        width: usize,
        /// Stated rows.
        height: usize,
    },
    /// The pixel slice does not match the stated size.
    #[error("an image of {width}x{height} cannot hold {actual} pixels")]
    PixelCount {
        /// Stated columns.
        width: usize,
        /// Stated rows.
        height: usize,
        /// Length of the slice, in pixels.
        actual: usize,
    },
    /// The two images differ in size.
    #[error("image size {image:?} differs from reference size {reference:?}")]
    SizeMismatch {
        /// Width and height of the image.
        image: (usize, usize),
        /// Width and height of the reference.
        reference: (usize, usize),
    },
    /// Fewer than two images, from which noise cannot be estimated.
    #[error("{count} repetitions of an image; at least 2 are needed")]
    TooFewImages {
        /// Number of images.
        count: usize,
    },
    /// The viewing condition is outside the accepted range.
    #[error("{0} pixels per degree is outside [1, 1000]")]
    PixelsPerDegree(f32),
}

/// Differences between an image (a) and a reference (b).
///
/// A pixel with a NaN or infinite value in either image is left out of every
/// figure except `flip_mean`, where its error is 1, and `non_finite`. If no
/// finite pixel is left, those figures are NaN. NaN and infinity serialise as
/// null.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Comparison {
    /// Root mean square difference over pixels and channels, linear.
    #[serde(serialize_with = "finite_or_null")]
    pub rmse: f64,
    /// Mean over pixels and channels of (a - b)² / (b² + 0.01), linear (the
    /// relative MSE of Rousselle et al. 2011, "Adaptive Sampling and
    /// Reconstruction using Greedy Error Minimization").
    #[serde(serialize_with = "finite_or_null")]
    pub rel_mse: f64,
    /// Peak signal-to-noise ratio in dB on the display range: values clamped
    /// to [0, 1] and sRGB-encoded but not quantised, peak 1. Infinite if the
    /// images agree there.
    #[serde(serialize_with = "finite_or_null")]
    pub psnr_db: f64,
    /// Mean LDR-FLIP error, in [0, 1]; see [`flip::flip`].
    #[serde(serialize_with = "finite_or_null")]
    pub flip_mean: f64,
    /// Maximum absolute difference of one channel, linear.
    #[serde(serialize_with = "finite_or_null")]
    pub max_difference: f64,
    /// Column and row of `max_difference`, from the top left; the first in
    /// row-major order if several, (0, 0) if there is no difference.
    pub max_pixel: (usize, usize),
    /// Mean of each channel of the image, linear.
    #[serde(serialize_with = "each_finite_or_null")]
    pub mean_a: [f64; 3],
    /// Mean of each channel of the reference, linear.
    #[serde(serialize_with = "each_finite_or_null")]
    pub mean_b: [f64; 3],
    /// Number of pixels with a NaN or infinite value in either image.
    pub non_finite: usize,
}

/// Compares `image` with `reference`. Both are linear and of the same size.
///
/// The result does not depend on the number of threads.
///
/// # Errors
///
/// [`MetricsError`] if a view is malformed or empty, or the sizes differ.
pub fn compare(image: &ImageView, reference: &ImageView) -> Result<Comparison, MetricsError> {
    compare_with_map(image, reference).map(|(comparison, _)| comparison)
}

/// Compares `image` with `reference` as [`compare`] does, and also returns the FLIP errors by
/// pixel.
///
/// # Errors
///
/// Errors of [`compare`].
pub fn compare_with_map(
    image: &ImageView,
    reference: &ImageView,
) -> Result<(Comparison, flip::FlipMap), MetricsError> {
    check_pair(image, reference)?;
    let rows = image.pixels.par_chunks(image.width);
    let reference_rows = reference.pixels.par_chunks(image.width);
    let rows: Vec<Sums> = rows.zip(reference_rows).map(|(a, b)| Sums::of_row(a, b)).collect();
    // Row sums are merged in order, because floating-point addition is not associative.
    let total = rows.iter().enumerate().fold(Sums::default(), |sum, (y, row)| sum.with_row(y, row));

    let pixels = total.count as f64;
    let samples = 3.0 * pixels;
    let map = flip::flip(image, reference)?;
    let comparison = Comparison {
        rmse: (total.squared / samples).sqrt(),
        rel_mse: total.relative / samples,
        psnr_db: 10.0 * (samples / total.encoded).log10(),
        flip_mean: map.mean,
        max_difference: if total.count == 0 { f64::NAN } else { total.max },
        max_pixel: total.max_at,
        mean_a: total.a.map(|sum| sum / pixels),
        mean_b: total.b.map(|sum| sum / pixels),
        non_finite: image.pixels.len() - total.count,
    };
    Ok((comparison, map))
}

/// Checks both shapes, and that the sizes are equal.
fn check_pair(image: &ImageView, reference: &ImageView) -> Result<(), MetricsError> {
    image.check()?;
    reference.check()?;
    let size = |view: &ImageView| (view.width, view.height);
    if size(image) != size(reference) {
        return Err(MetricsError::SizeMismatch { image: size(image), reference: size(reference) });
    }
    Ok(())
}

fn is_finite_pair(a: &[f32; 3], b: &[f32; 3]) -> bool {
    a.iter().chain(b).all(|v| v.is_finite())
}

/// Sums over the finite pixels of a set of rows.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: usize,
    squared: f64,
    relative: f64,
    encoded: f64,
    a: [f64; 3],
    b: [f64; 3],
    max: f64,
    max_at: (usize, usize),
}

impl Sums {
    fn of_row(row: &[[f32; 3]], reference: &[[f32; 3]]) -> Self {
        let mut sums = Self::default();
        for (x, (a, b)) in row.iter().zip(reference).enumerate() {
            if !is_finite_pair(a, b) {
                continue;
            }
            sums.count += 1;
            sums.a = plus(sums.a, a.map(f64::from));
            sums.b = plus(sums.b, b.map(f64::from));
            for (&a, &b) in a.iter().zip(b) {
                let (linear, reference) = (f64::from(a) - f64::from(b), f64::from(b));
                let display = [a, b].map(|v| f64::from(srgb::encode(v.clamp(0.0, 1.0))));
                let [display_a, display_b] = display;
                sums.squared += linear * linear;
                sums.relative += linear * linear / (reference * reference + REL_MSE_EPSILON);
                sums.encoded += (display_a - display_b).powi(2);
                if linear.abs() > sums.max {
                    (sums.max, sums.max_at) = (linear.abs(), (x, 0));
                }
            }
        }
        sums
    }

    /// Adds the sums of row `y`, which is below all rows added before.
    fn with_row(self, y: usize, row: &Self) -> Self {
        let higher = row.max > self.max;
        Self {
            count: self.count + row.count,
            squared: self.squared + row.squared,
            relative: self.relative + row.relative,
            encoded: self.encoded + row.encoded,
            a: plus(self.a, row.a),
            b: plus(self.b, row.b),
            max: if higher { row.max } else { self.max },
            max_at: if higher { (row.max_at.0, y) } else { self.max_at },
        }
    }
}

fn plus([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a + x, b + y, c + z]
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Serialises NaN and infinity as null, because JSON has neither.
fn finite_or_null<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    finite(*value).serialize(serializer)
}

fn each_finite_or_null<S: Serializer>(values: &[f64; 3], serializer: S) -> Result<S::Ok, S::Error> {
    values.map(finite).serialize(serializer)
}

#[cfg(test)]
mod tests;
