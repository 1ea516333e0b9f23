//! The trade-off lab: what each knob for speed costs in accuracy, measured.
//!
//! [`Configuration`]s are ways of rendering; a [`Lab`] renders each with several seeds and numbers of
//! samples; [`Errors`] tell noise from bias against a [`Reference`]; [`Tradeoff::write`] writes it
//! down. A [`Supervisor`] ends it, with what was measured by then.

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

/// What the lab cannot do.
#[derive(Debug, Error)]
pub enum TradeoffError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The folder of references cannot be written.
    #[error("{}: {source}; references are kept there: name another folder by --cache", path.display())]
    Cache {
        /// The folder or file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A reference that was kept and cannot be used.
    #[error("{}: not a reference image: {message}; remove it, and it is rendered again", path.display())]
    Reference {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Too little to tell noise from bias.
    #[error("{what} is {given}; it must be at least {least}")]
    TooFew {
        /// The option.
        what: &'static str,
        /// What was asked for.
        given: usize,
        /// What there must be.
        least: usize,
    },
    /// A knob that is none.
    #[error("there is no knob {name}; there are {known}")]
    NoKnob {
        /// What was asked for.
        name: String,
        /// All.
        known: String,
    },
    /// No folder for references.
    #[error(
        "there is no home folder to keep references in; name a folder with --cache, or set XDG_CACHE_HOME"
    )]
    NoCache,
    /// A page or a chart that could not be made.
    #[error("{}: {message}", path.display())]
    Encode {
        /// The file it was for.
        path: PathBuf,
        /// Why.
        message: String,
    },
}

/// Repetitions that bias can be told from.
pub const MIN_SEEDS: usize = 4;

/// Whether so many repetitions tell anything.
///
/// # Errors
///
/// [`TradeoffError::TooFew`] if they do not.
pub fn check_seeds(given: usize) -> Result<(), TradeoffError> {
    if given < MIN_SEEDS {
        return Err(TradeoffError::TooFew { what: "--seeds", given, least: MIN_SEEDS });
    }
    Ok(())
}

impl TradeoffError {
    /// Of a file.
    pub fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    fn encode(path: &std::path::Path, error: impl ToString) -> Self {
        Self::Encode { path: path.to_owned(), message: error.to_string() }
    }
}
