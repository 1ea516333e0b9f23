//! What can be wrong with a checkpoint.

use super::FORMAT;
use super::identity::Difference;
use crate::film::FilmError;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// A checkpoint that cannot be read, written or used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Not a checkpoint, or no longer.
    #[error("{}: not a checkpoint: {message}", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Of another version of the program.
    #[error(
        "{}: a checkpoint of format {format}, and this program reads {FORMAT}; go on with the version that wrote it",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// What it says.
        format: u32,
    },
    /// Of another image.
    #[error("{}: {difference}; only what is the same image goes together", path.display())]
    Differs {
        /// The file.
        path: PathBuf,
        /// In what.
        difference: Difference,
    },
    /// A film that cannot be added.
    #[error("{}: {source}", path.display())]
    Film {
        /// The file.
        path: PathBuf,
        /// Why.
        source: FilmError,
    },
    /// A goal, whose samples depend on all before.
    #[error(
        "{what} does not go with --budget, --target-error and --quality, whose samples depend on all before; name --spp instead"
    )]
    Unsupported {
        /// The option.
        what: &'static str,
    },
    /// Text that a file cannot hold.
    #[error("--checkpoint holds the command that began it, and {what} is no Unicode text; name it otherwise")]
    NoText {
        /// What.
        what: String,
    },
    /// Another process wrote the file since this render began, or since this render wrote it last.
    #[error(
        "{}: another process wrote this file meanwhile, and it stays as it is; name a --checkpoint of its own for each render",
        path.display()
    )]
    Taken {
        /// The file.
        path: PathBuf,
    },
    /// A render that begins would write over what another one has.
    #[error("{}: is there already; go on with it (trisect resume), or remove it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
}
