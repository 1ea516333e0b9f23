//! Errors of a render over several ranks.

use trisect::checkpoint::CheckpointError;
use trisect::denoise::DenoiseError;
use trisect::device::BackendError;
use trisect::film::FilmError;
use trisect::image::ImageError;
use trisect::render::SettingsError;
use trisect::scene::SceneError;

use thiserror::Error;
use trisect::threads::ThreadError;

/// Render over several processes that could not start, or ended early.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ClusterError {
    /// The program was built without MPI.
    #[error(
        "this program was built without MPI; build it with the feature `mpi` (docs/how-to/cluster.md), or leave `distribute` out"
    )]
    NotBuilt,
    /// A call of MPI failed.
    #[error(
        "MPI failed while {action}: error {code}; compare `mpirun --version` with the requirements in docs/how-to/cluster.md"
    )]
    Mpi {
        /// Action that failed.
        action: &'static str,
        /// Error code of MPI.
        code: i32,
    },
    /// Another rank reported an error.
    #[error("rank {rank} on {host}: {message}")]
    Rank {
        /// The rank.
        rank: u32,
        /// Its host.
        host: String,
        /// Its error message.
        message: String,
        /// Its exit code.
        code: u8,
    },
    /// A rank would not render the same image as the root.
    #[error("rank {rank} on {host}: {what} is {theirs}, rank 0 has {ours}; start all ranks with the same")]
    Mismatch {
        /// The rank that differs from the root.
        rank: u32,
        /// Its host.
        host: String,
        /// Property that differs: scene, seed, kernels, version and so on.
        what: String,
        /// Value of that rank.
        theirs: String,
        /// Value of the root.
        ours: String,
    },
    /// No message came from a rank for too long.
    #[error(
        "rank {rank} on {host} was silent for {seconds} s and counts as lost; find out what stopped it there, or raise `patience`"
    )]
    Silent {
        /// The rank.
        rank: u32,
        /// Its host.
        host: String,
        /// Seconds without a message.
        seconds: u64,
    },
    /// A message that no rank of this version sends.
    #[error("rank {rank} sent {message}; start all ranks with the same program")]
    Protocol {
        /// The sender.
        rank: u32,
        /// Description of the message.
        message: String,
    },
    /// A signal ended the job.
    #[error("ended by a signal; {done} of {total} pixels were complete")]
    Ended {
        /// Complete pixels, estimated from the number of samples received.
        done: u64,
        /// Pixels of the image.
        total: u64,
    },
    /// The host has fewer GPUs than ranks.
    #[error(
        "this rank is number {local} on its host, which has {devices} {backend} devices; start fewer ranks a host, or let the others use the CPU by `spare` cpu"
    )]
    NoDevice {
        /// The rank's number on its host, from 0.
        local: u32,
        /// Backend that it should use.
        backend: &'static str,
        /// Devices of that backend on the host.
        devices: usize,
    },
    /// A thread could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadError),
    /// A mode does not support a setting.
    #[error("{what}; {remedy}")]
    Unsupported {
        /// The limitation.
        what: String,
        /// The remedy.
        remedy: String,
    },
}

impl ClusterError {
    /// Returns the process's exit code.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NotBuilt | Self::NoDevice { .. } => 3,
            Self::Rank { code, .. } => *code,
            Self::Mismatch { .. } | Self::Unsupported { .. } => 2,
            Self::Mpi { .. } | Self::Silent { .. } | Self::Protocol { .. } => 1,
            Self::Threads(error) => error.exit_code(),
            Self::Ended { .. } => 130,
        }
    }
}

/// Any error of a render over several ranks: of the ranks, or of the render of one.
#[derive(Debug, Error)]
pub enum Error {
    /// Ranks cannot render together, or one failed.
    #[error(transparent)]
    Cluster(#[from] ClusterError),
    /// This rank could not render.
    #[error(transparent)]
    Render(#[from] trisect::Error),
}

impl Error {
    /// Returns the program's exit code, as [`trisect::Error::exit_code`] does; that of a
    /// [`ClusterError`] is the code of the rank that failed, or 130 after a signal.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Cluster(error) => error.exit_code(),
            Self::Render(error) => error.exit_code(),
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
    DenoiseError,
    FilmError,
    ImageError,
    SceneError,
    SettingsError,
    ThreadError
);
