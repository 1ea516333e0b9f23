//! What cannot be denoised.

use super::LEVELS;
use thiserror::Error;

/// Parameters that are none, or a film that cannot be denoised.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DenoiseError {
    /// Too few levels, or too many.
    #[error("a filter has {} to {} levels, not {levels}", LEVELS.start(), LEVELS.end())]
    Levels {
        /// What was asked for.
        levels: u32,
    },
    /// A negative number, or none.
    #[error("the denoiser's {name} is {value}; it must be 0 or more (inf lets everything through)")]
    Parameter {
        /// Which.
        name: &'static str,
        /// What was asked for.
        value: String,
    },
    /// Too many.
    #[error("a history of {frames} frames; at most {most}")]
    History {
        /// What was asked for.
        frames: u32,
        /// What there can be.
        most: u32,
    },
    /// Parameters of a filter, and no filter.
    #[error("--denoise-{name} without a filter; add --denoise atrous or --denoise svgf")]
    NoFilter {
        /// The first of them.
        name: &'static str,
    },
    /// A film of a render without them.
    #[error("the film has no normals, albedos and positions; render it with Settings::guides")]
    NoAovs,
}
