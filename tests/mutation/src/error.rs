//! Why the gate cannot run. (A mutant that goes unnoticed is no error but a [`Verdict`](crate::gate::Verdict).)

use std::path::PathBuf;
use thiserror::Error;

/// What went wrong.
#[derive(Debug, Error)]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The list of mutants cannot be understood.
    #[error("{}: {message}", path.display())]
    Mutants {
        /// The list.
        path: PathBuf,
        /// Why, and which mutant.
        message: String,
    },
    /// A mutant that cannot be planted.
    #[error(
        "mutant {mutant}: its text stands {count} times in {}, not once; the source has changed: mend `find` in the list of mutants",
        file.display()
    )]
    Text {
        /// Its name.
        mutant: String,
        /// Where it is to be planted.
        file: PathBuf,
        /// How often its text is there.
        count: usize,
    },
    /// A program that the gate needs failed.
    #[error("{action} failed:\n{output}")]
    Tool {
        /// What was attempted.
        action: String,
        /// What it said.
        output: String,
    },
    /// Tests that the list of mutants names and that are not there.
    #[error("no such tests; mend `caught_by` in the list of mutants:\n  {}", tests.join("\n  "))]
    NoSuchTests {
        /// Which.
        tests: Vec<String>,
    },
    /// A test that is to notice mutants does not pass without any.
    #[error("{test} {outcome} before any mutant is planted{}", if output.is_empty() { String::new() } else { format!(":\n{output}") })]
    Baseline {
        /// The test.
        test: String,
        /// How it ended.
        outcome: String,
        /// What it said.
        output: String,
    },
    /// `REQUIRE_BACKENDS` names a backend that a test did not find.
    #[error("REQUIRE_BACKENDS names {backend}, but {test} says: {message}")]
    Backend {
        /// `wgpu` or `cuda`.
        backend: &'static str,
        /// The test.
        test: String,
        /// What it says.
        message: String,
    },
    /// Another gate works in the same folder.
    #[error("another mutation gate runs in {}; wait for it to end", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// The command line cannot be understood.
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// For `map_err`: `path` could not be read or written.
    pub fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { path, source }
    }
}
