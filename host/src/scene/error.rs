//! What is wrong with a scene, and where.

use std::path::PathBuf;
use thiserror::Error;

/// A scene that cannot be used.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not a scene: a syntax error, an unknown field, a value out of range, an unknown material.
    #[error("{file}:{line}:{column}: {message}\n{excerpt}\n  see docs/scenes.md for the format")]
    Invalid {
        /// The file, or what stands for it.
        file: String,
        /// Counted from 1.
        line: usize,
        /// Counted from 1, in characters.
        column: usize,
        /// What is wrong and what would be right.
        message: String,
        /// The line and a mark below the place.
        excerpt: String,
    },
    /// Values that are right by themselves but not together.
    #[error("{file}: {message}")]
    Inconsistent {
        /// The file, or what stands for it.
        file: String,
        /// What is wrong and what would be right.
        message: String,
    },
}

impl SceneError {
    /// An error at a place of `text`.
    pub(super) fn at(file: &str, text: &str, line: usize, column: usize, message: String) -> Self {
        let shown: String =
            text.lines().nth(line.saturating_sub(1)).unwrap_or_default().chars().take(200).collect();
        let mark = " ".repeat(column.saturating_sub(1).min(200)) + "^";
        let excerpt = format!("{line:5} | {shown}\n      | {mark}");
        Self::Invalid { file: file.to_owned(), line, column, message, excerpt }
    }
}
