//! Error of the denoiser.

use super::LEVELS;
use thiserror::Error;

/// Error of denoiser parameters, or of a film that cannot be denoised.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DenoiseError {
    /// Number of levels outside [`LEVELS`].
    #[error("a filter has {} to {} levels, not {levels}", LEVELS.start(), LEVELS.end())]
    Levels {
        /// Requested number.
        levels: u32,
    },
    /// Parameter that is negative or NaN.
    #[error("the denoiser's {name} is {value}; it must be 0 or more (inf turns it off)")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Requested value.
        value: String,
    },
    /// History of too many frames.
    #[error("a history of {frames} frames; the maximum is {most}")]
    History {
        /// Requested number.
        frames: u32,
        /// Maximum number.
        most: u32,
    },
    /// Parameters of a filter are given, but no filter.
    #[error("`denoise_{name}` without a filter; add `denoise` atrous or `denoise` svgf")]
    NoFilter {
        /// Name of the first parameter.
        name: &'static str,
    },
    /// Film that was rendered without AOV sums.
    #[error("the film has no normals, albedos and positions; render it with Settings::guides")]
    NoAovs,
}
