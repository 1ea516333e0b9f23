//! Measures how far images are from a reference: noise and bias apart, with intervals, and the
//! error by spatial frequency.
//!
//! A [`Truth`] is the reference, [`Errors`] are those of images of one configuration with different
//! seeds. Used by the [trade-off lab](crate::tradeoff) and by [evaluations](crate::evaluate).

mod bias;
mod errors;
mod means;
mod spectrum;
mod truth;

pub(crate) use bias::Bias;
pub use errors::{Errors, SIGNIFICANCE};
pub(crate) use means::{Means, difference};
pub use spectrum::SpectrumBand;
pub(crate) use spectrum::spectrum;
pub use truth::Truth;
pub(crate) use truth::{flips_of, mean_of, view};
