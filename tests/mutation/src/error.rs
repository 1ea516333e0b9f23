//! Reasons why the gate cannot run. (A mutant that is not caught is a
//! [`Verdict`](crate::gate::Verdict), not an error.)

use std::path::PathBuf;
use thiserror::Error;

/// An error of the gate.
#[derive(Debug, Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// The list of mutants is invalid.
    #[error("{}: {message}", path.display())]
    Mutants {
        /// Path of the list.
        path: PathBuf,
        /// Reason, with the mutant's name where there is one.
        message: String,
    },
    /// A mutant cannot be planted, because its text does not occur exactly once.
    #[error(
        "mutant {mutant}: its text occurs {count} times in {}, not once; the source has changed: correct `find` in the list of mutants",
        file.display()
    )]
    Text {
        /// Name of the mutant.
        mutant: String,
        /// File in which it should be planted.
        file: PathBuf,
        /// Number of occurrences of its text.
        count: usize,
    },
    /// A program that the gate needs failed.
    #[error("{action} failed:\n{output}")]
    Tool {
        /// Attempted action.
        action: String,
        /// Output of the program.
        output: String,
    },
    /// The list of mutants names tests that do not exist.
    #[error("no such tests; correct `caught_by` in the list of mutants:\n  {}", tests.join("\n  "))]
    NoSuchTests {
        /// The tests.
        tests: Vec<String>,
    },
    /// A test that should catch mutants does not pass without a mutant.
    #[error("{test} {outcome} before any mutant is planted{}", if output.is_empty() { String::new() } else { format!(":\n{output}") })]
    Baseline {
        /// The test.
        test: String,
        /// Outcome without a mutant.
        outcome: String,
        /// Output of the test.
        output: String,
    },
    /// `REQUIRE_BACKENDS` names a backend that is missing for a test.
    #[error("REQUIRE_BACKENDS names {backend}, but {test} says: {message}")]
    Backend {
        /// `wgpu` or `cuda`.
        backend: &'static str,
        /// The test.
        test: String,
        /// The test's message.
        message: String,
    },
    /// Another gate uses the same folder.
    #[error("another mutation gate runs in {}; wait for it to end", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// The command line is invalid.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// Returns a function for `map_err`: `path` could not be read or written.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }
}
