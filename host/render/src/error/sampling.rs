//! Errors of renders to a goal.

use thiserror::Error;

/// Error of a goal that is out of range, or of a render that used all samples of a seed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SamplingError {
    /// The target error is out of range.
    #[error("`target_error` is {target}; it must be above 0 and below 100 %")]
    Target {
        /// Requested error in percent.
        target: String,
    },
    /// A pixel has had all samples of a seed.
    #[error("a pixel has had all 4294967295 samples of a seed: render parts with other seeds (`seed`)")]
    TooMany,
    /// The time is out of range.
    #[error("`budget` is {seconds} s; it must be from 1 ms to 1000000 s")]
    Time {
        /// Requested time in seconds.
        seconds: String,
    },
}
