//! Errors of the trade-off lab, besides those of rendering.

use std::path::{Path, PathBuf};
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
    #[error("{}: {source}; references are kept there: name another folder by `cache`", path.display())]
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
    #[error("unknown knob \"{name}\" in `knobs`; available: {known}")]
    NoKnob {
        /// Given name.
        name: String,
        /// Names of all knobs, with commas between them.
        known: String,
    },
    /// There is no folder to keep references in.
    #[error(
        "there is no home folder to keep references in; name a folder with `cache`, or set XDG_CACHE_HOME"
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

impl TradeoffError {
    /// Returns a function that makes a [`TradeoffError::Io`] for a file or folder.
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    /// Returns a [`TradeoffError::Encode`] for a file.
    pub(crate) fn encode(path: &Path, error: impl ToString) -> Self {
        Self::Encode { path: path.to_owned(), message: error.to_string() }
    }
}
