//! Error of benchmarks and of the trade-off lab.

mod bench;
mod evaluate;
mod tradeoff;

pub use bench::BenchError;
pub use evaluate::EvaluateError;
pub use tradeoff::TradeoffError;

use thiserror::Error as ThisError;
use trisect::adaptive::SamplingError;
use trisect::checkpoint::CheckpointError;
use trisect::denoise::DenoiseError;
use trisect::device::BackendError;
use trisect::error::MotionError;
use trisect::film::FilmError;
use trisect::image::ImageError;
use trisect::metrics::MetricsError;
use trisect::output::ConflictError;
use trisect::precision::WriteError;
use trisect::render::SettingsError;
use trisect::scene::SceneError;
use trisect::threads::ThreadError;
use trisect_cluster::ClusterError;

/// Any error of a measurement.
#[derive(Debug, ThisError)]
pub enum Error {
    /// A benchmark could not be set up, or its results could not be written.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The trade-off lab could not measure, or write its results.
    #[error(transparent)]
    Tradeoff(#[from] TradeoffError),
    /// Images cannot be evaluated.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// Ranks cannot render together, or one failed.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
    /// A render failed.
    #[error(transparent)]
    Render(#[from] trisect::Error),
}

impl Error {
    /// Returns the program's exit code, as [`trisect::Error::exit_code`] does.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Tradeoff(
                TradeoffError::TooFew { .. } | TradeoffError::NoKnob { .. } | TradeoffError::NoCache,
            )
            | Self::Bench(BenchError::SphereCount { .. } | BenchError::NothingToMeasure) => 2,
            Self::Bench(_) | Self::Tradeoff(_) => 1,
            Self::Evaluate(error) => error.exit_code(),
            Self::Cluster(error) => error.exit_code(),
            Self::Render(error) => error.exit_code(),
        }
    }
}

impl From<trisect_cluster::Error> for Error {
    fn from(error: trisect_cluster::Error) -> Self {
        match error {
            trisect_cluster::Error::Cluster(error) => Self::Cluster(error),
            trisect_cluster::Error::Render(error) => Self::Render(error),
        }
    }
}

macro_rules! of_a_render {
    ($($error:ty),*) => {$(
        impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::Render(error.into())
            }
        }
    )*};
}

of_a_render!(
    BackendError,
    CheckpointError,
    ConflictError,
    DenoiseError,
    FilmError,
    ImageError,
    MetricsError,
    MotionError,
    SamplingError,
    SceneError,
    SettingsError,
    ThreadError,
    WriteError
);
