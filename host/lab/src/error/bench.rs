//! Errors of benchmarks, besides those of rendering.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// A benchmark that cannot be set up or written to files.
#[derive(Debug, Error)]
pub enum BenchError {
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// A chart that the plotting library could not draw.
    #[error("{}: drawing the chart: {message}", path.display())]
    Draw {
        /// File that it was for.
        path: PathBuf,
        /// Message of the library.
        message: String,
    },
    /// Data that cannot be written as JSON or CSV.
    #[error("{}: writing the data: {message}", path.display())]
    Encode {
        /// File that it was for.
        path: PathBuf,
        /// Message of the encoder.
        message: String,
    },
    /// A report without any scene.
    #[error("no scene is left to measure: `spheres` must be 10 or more")]
    NothingToMeasure,
    /// A sphere scene that cannot be made.
    #[error("a scene of {count} spheres: the number must be 1 to {greatest}")]
    SphereCount {
        /// Requested number of spheres.
        count: u32,
        /// Maximum.
        greatest: u32,
    },
}

impl BenchError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    pub(crate) fn encode(path: &Path, error: impl ToString) -> Self {
        Self::Encode { path: path.to_owned(), message: error.to_string() }
    }
}
