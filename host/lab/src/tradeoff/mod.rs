//! The trade-off lab measures what each knob that makes rendering faster costs in accuracy.
//!
//! A [`Configuration`] is a set of render settings. [`Lab`] renders each configuration with several
//! seeds and numbers of samples. [`Errors`] separates noise from bias against a [`Reference`].
//! [`Tradeoff::write`] writes the report. A [`Supervisor`] can end the measurement; the report then
//! has what was measured by then. Used by `trisect tradeoff` and `trisect converge`.

mod bias;
mod charts;
mod configuration;
mod converge;
mod enlarge;
mod error_curve;
mod errors;
mod fit;
mod front;
mod lab;
mod measure;
mod page;
mod picture;
mod point;
mod reference;
mod supervisor;
mod table;

pub use configuration::{Configuration, KNOBS, configurations};
pub use converge::ConvergencePlan;
pub use error_curve::{Capture, Convergence, ErrorCurve, Pair};
pub use errors::{Errors, SIGNIFICANCE};
pub use fit::{Fit, REFERENCE_SHARE, fit};
pub use lab::Lab;
pub use measure::Sweep;
pub use page::is_output;
pub use picture::Pictures;
pub use point::{Missing, Point, Seconds, Slope, Tradeoff, VsBase};
pub use reference::{Reference, ReferenceInfo, Truth, hash};
pub use supervisor::{Stop, Supervisor};

use std::path::PathBuf;
use thiserror::Error;

/// Errors of the trade-off lab.
#[derive(Debug, Error)]
pub enum TradeoffError {
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// The folder of references cannot be written.
    #[error("{}: {source}; references are kept there: name another folder by --cache", path.display())]
    Cache {
        /// The folder or file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// A kept reference cannot be used.
    #[error("{}: not a reference image: {message}; remove it, and it is rendered again", path.display())]
    Reference {
        /// The file.
        path: PathBuf,
        /// Reason.
        message: String,
    },
    /// Too few repetitions or numbers of samples to tell noise from bias.
    #[error("{what} is {given}; it must be at least {least}")]
    TooFew {
        /// Option, or quantity, that is too small.
        what: &'static str,
        /// Given number.
        given: usize,
        /// Minimum.
        least: usize,
    },
    /// An unknown knob was named.
    #[error("unknown knob {name}; available: {known}")]
    NoKnob {
        /// Given name.
        name: String,
        /// Names of all knobs, with commas between them.
        known: String,
    },
    /// There is no folder to keep references in.
    #[error(
        "there is no home folder to keep references in; name a folder with --cache, or set XDG_CACHE_HOME"
    )]
    NoCache,
    /// A page, chart or JSON file could not be encoded.
    #[error("{}: {message}", path.display())]
    Encode {
        /// File that it was for.
        path: PathBuf,
        /// Reason.
        message: String,
    },
}

/// Minimum number of repetitions (seeds) from which bias can be told from noise.
pub const MIN_SEEDS: usize = 4;

/// Checks that `given` repetitions are enough to tell bias from noise.
///
/// # Errors
///
/// [`TradeoffError::TooFew`] below [`MIN_SEEDS`].
pub fn check_seeds(given: usize) -> Result<(), TradeoffError> {
    if given < MIN_SEEDS {
        return Err(TradeoffError::TooFew { what: "--seeds", given, least: MIN_SEEDS });
    }
    Ok(())
}

impl TradeoffError {
    /// Returns a function that makes a [`TradeoffError::Io`] for a file or folder.
    pub fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    fn encode(path: &std::path::Path, error: impl ToString) -> Self {
        Self::Encode { path: path.to_owned(), message: error.to_string() }
    }
}
