//! Error of the library, which wraps the errors of its modules, and the program's exit code for
//! each of them. The crates above have errors of their own that wrap this one.

mod checkpoint;
mod motion;
mod sampling;

pub use checkpoint::{CheckpointError, Difference};
pub use motion::MotionError;
pub use sampling::SamplingError;

use crate::denoise::DenoiseError;
use crate::film::FilmError;
use crate::settings::SettingsError;
use thiserror::Error;
use trisect_device::BackendError;
use trisect_image::ImageError;
use trisect_image::metrics::MetricsError;
use trisect_image::output::ConflictError;
use trisect_scene::SceneError;
use trisect_scene::precision::WriteError;
use trisect_system::threads::ThreadError;

/// Any error of the library.
#[derive(Debug, Error)]
pub enum Error {
    /// A scene file could not be read, or is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The settings of a render are wrong.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The goal of a render is invalid.
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    /// Images of a scene that moves were asked for in a way that has no meaning.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A backend is unavailable, or failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// An image could not be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An output is another file of the same command, or one that `resume` does not write unasked.
    #[error(transparent)]
    Conflict(#[from] ConflictError),
    /// Two images could not be compared.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// Films do not belong together.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A copy of a scene could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Parameters of a denoiser are invalid, or a film cannot be denoised.
    #[error(transparent)]
    Denoise(#[from] DenoiseError),
    /// A checkpoint could not be read, written or used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Threads could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadError),
    /// The render was cancelled by its observer.
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// Returns the program's exit code: 1 for errors at run time, 2 for usage, 3 for an unavailable
    /// backend, 4 for an invalid scene.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_) | Self::Write(WriteError::Scene(_)) => 4,
            Self::Write(WriteError::Io { .. }) => 1,
            Self::Write(_) => 2,
            Self::Settings(_)
            | Self::Sampling(_)
            | Self::Motion(_)
            | Self::Backend(
                BackendError::NoQueue { .. }
                | BackendError::NoFastMath { .. }
                | BackendError::TooLarge { .. }
                | BackendError::TooLong { .. },
            ) => 2,
            Self::Denoise(error) => error.exit_code(),
            Self::Threads(error) | Self::Backend(BackendError::Threads(error)) => error.exit_code(),
            Self::Backend(error) => {
                if error.is_unavailable() {
                    3
                } else {
                    1
                }
            }
            Self::Checkpoint(
                CheckpointError::NoText { .. }
                | CheckpointError::Unsupported { .. }
                | CheckpointError::Exists { .. },
            )
            | Self::Conflict(_) => 2,
            Self::Image(
                ImageError::UnknownExtension { .. }
                | ImageError::ToTerminal
                | ImageError::NoLightGroups { .. }
                | ImageError::NoLayers { .. }
                | ImageError::LayerTwice { .. }
                | ImageError::NoAlpha { .. }
                | ImageError::NoDisplay { .. }
                | ImageError::No16Bits { .. },
            ) => 2,
            Self::Image(_) | Self::Metrics(_) | Self::Film(_) | Self::Checkpoint(_) | Self::Cancelled => 1,
        }
    }
}
