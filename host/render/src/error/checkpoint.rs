//! Errors of reading, writing, merging and continuing checkpoints.

use crate::film::FilmError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Checkpoint that cannot be read, written or used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The file system reported an error.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the file system.
        source: io::Error,
    },
    /// The file is not a checkpoint, or it is damaged.
    #[error("{}: not a checkpoint: {message}", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
        /// Description of the fault.
        message: String,
    },
    /// The checkpoint was written by another version of the program.
    #[error(
        "{}: a checkpoint of format {format}, but this program reads format {reads}; use the version of the program that wrote it",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Format of the file.
        format: u32,
        /// Format that this program reads.
        reads: u32,
    },
    /// The checkpoint belongs to another image.
    #[error("{}: {difference}; only parts of the same image can be continued or merged", path.display())]
    Differs {
        /// The file.
        path: PathBuf,
        /// First field that differs.
        difference: Difference,
    },
    /// The films cannot be added.
    #[error("{}: {source}", path.display())]
    Film {
        /// The file.
        path: PathBuf,
        /// Reason, such as samples in both films.
        source: FilmError,
    },
    /// The option does not work with a goal, whose samples depend on all earlier ones.
    #[error(
        "{what} cannot be combined with `budget`, `target_error` or `quality`, whose samples depend on all earlier ones; use `spp` instead"
    )]
    Unsupported {
        /// The option.
        what: &'static str,
    },
    /// A part of the command is not Unicode text, so the file cannot hold it.
    #[error(
        "`checkpoint` stores the command that began the render, and {what} is not Unicode text; rename it"
    )]
    NoText {
        /// The part of the command.
        what: String,
    },
    /// No command of the program began the render of the checkpoint.
    #[error(
        "{}: a caller of the library, such as a Python script, began this render, so there is no command to resume; continue it there, or write its image by `trisect merge`",
        path.display()
    )]
    NoCommand {
        /// The file.
        path: PathBuf,
    },
    /// Another process wrote the file since this render began, or since this render wrote it last.
    #[error(
        "{}: another process wrote this file meanwhile, so it was not replaced; use a different `checkpoint` for each render",
        path.display()
    )]
    Taken {
        /// The file.
        path: PathBuf,
    },
    /// A new render would overwrite the checkpoint of another one.
    #[error("{}: already exists; continue it (`resume`), or remove it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
}

impl CheckpointError {
    /// Returns the file that the error is about, if it is about one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Io { path, .. }
            | Self::NotACheckpoint { path, .. }
            | Self::Format { path, .. }
            | Self::Differs { path, .. }
            | Self::Film { path, .. }
            | Self::NoCommand { path }
            | Self::Taken { path }
            | Self::Exists { path } => Some(path),
            Self::Unsupported { .. } | Self::NoText { .. } => None,
        }
    }
}

/// First field in which two identities differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Name of the field.
    pub field: String,
    /// Value of the first identity.
    pub one: String,
    /// Value of the other identity.
    pub other: String,
}

impl Difference {
    pub(crate) fn new(field: &str, one: &impl ToString, other: &impl ToString) -> Self {
        Self { field: field.to_owned(), one: one.to_string(), other: other.to_string() }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} is {} in this file, but {} here", self.field, self.other, self.one)
    }
}
