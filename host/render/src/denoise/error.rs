//! Error of the denoiser.

use super::LEVELS;
use super::oidn::OidnError;
use thiserror::Error;

/// Error of denoiser parameters, of Open Image Denoise, or of a film that cannot be denoised.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DenoiseError {
    /// Number of levels outside [`LEVELS`].
    #[error("`denoise_levels` is {levels}; it must be from {} to {}", LEVELS.start(), LEVELS.end())]
    Levels {
        /// Requested number.
        levels: u32,
    },
    /// Parameter that is negative or NaN.
    #[error("`{name}` is {value}; it must be 0 or more (inf turns it off)")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Requested value.
        value: String,
    },
    /// History of too many frames.
    #[error("`history` is {frames} frames; the maximum is {most}")]
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
    /// Parameters of a filter are given for a denoiser that has none.
    #[error("`denoise_{name}` is a parameter of the filters, `denoise` atrous and svgf; leave it out")]
    NoParameters {
        /// Name of the first parameter.
        name: &'static str,
    },
    /// Denoiser of finished images that is to denoise live frames.
    #[error(
        "`denoise` {name} is for finished images, as of render and bench; frames take `denoise` svgf, atrous or off"
    )]
    NotLive {
        /// Name of the denoiser.
        name: &'static str,
    },
    /// Open Image Denoise is missing, or failed.
    #[error(transparent)]
    Oidn(#[from] OidnError),
    /// Film that was rendered without AOV sums.
    #[error("the film has no normals, albedos and positions; render it with Settings::guides")]
    NoAovs,
}

impl DenoiseError {
    /// Returns the program's exit code: 2 for wrong parameters, that of the library for its errors.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Oidn(error) => error.exit_code(),
            _ => 2,
        }
    }
}
