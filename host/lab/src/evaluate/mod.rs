//! Evaluates images of any renderer against a reference: noise and bias apart, by the estimators of
//! the [trade-off lab](crate::tradeoff).
//!
//! An [`ImageSet`] has the images of one configuration, each with a seed of its own.
//! [`ReferenceImages`] are one image or several. [`evaluate`] compares sets in memory, an
//! [`ImageFolder`] has those of files. [`evaluate_frames`] compares frames of animations. Used by
//! `trisect evaluate`.
//!
//! An interval covers the truth in 95 % of cases if:
//!
//! - the images of a set differ by their random numbers only, and these are independent
//! - the images of a reference of several images do, too, and are independent of the sets
//! - the reference's noise is independent between pixels; the tests of means do not need that
//! - the reference's own error is at most a few percent, because relMSE is weighted by it
//!
//! The truth is the image to which the reference converges, so the bias is the difference from that
//! renderer, or from those settings. If the reference is one image, its noise is unknown: the truth
//! is then that image itself, and its noise is part of the squared bias.

mod columns;
mod folder;
mod frames;
mod reference;
mod result;
mod set;
mod spectrum_table;
mod table;
mod times;

pub use crate::error::EvaluateError;
pub use folder::ImageFolder;
pub use frames::{FramesEvaluation, FramesRow, evaluate_frames};
pub use reference::ReferenceImages;
pub use result::{Evaluation, EvaluationReference, Row};
pub use set::ImageSet;
pub use times::Times;

/// Evaluates sets of images, each against the reference.
///
/// # Errors
///
/// [`EvaluateError`] for sets of fewer than two images, equal images, images of another size than
/// the reference's, values that are not finite, and times that are not positive.
pub fn evaluate(sets: &[ImageSet], reference: &ReferenceImages) -> Result<Evaluation, EvaluateError> {
    let truth = reference.truth()?;
    let mut found = Evaluation::new(reference);
    for set in sets {
        found.rows.push(Row::of(set, (&reference.labels, &reference.images), &truth)?);
    }
    Ok(found)
}

#[cfg(test)]
mod tests;
