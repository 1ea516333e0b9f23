//! What can go wrong between ranks.

use crate::threads::ThreadError;
use thiserror::Error;

/// A render over several processes that cannot start, or ended early.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ClusterError {
    /// The program was built without MPI.
    #[error(
        "this program was built without MPI; build it with --features mpi (docs/cluster.md), or leave out --distribute"
    )]
    NotBuilt,
    /// A call of MPI failed.
    #[error("MPI, {action}: error {code}; `mpirun --version` and docs/cluster.md say what is needed")]
    Mpi {
        /// What was tried.
        action: &'static str,
        /// As MPI numbers it.
        code: i32,
    },
    /// Another rank said that it cannot go on.
    #[error("rank {rank} on {host}: {message}")]
    Rank {
        /// Which.
        rank: u32,
        /// Where it runs.
        host: String,
        /// What it said.
        message: String,
        /// Its exit code.
        code: u8,
    },
    /// Ranks that would not render the same image.
    #[error("rank {rank} on {host}: {what} is {theirs}, rank 0 has {ours}; start all ranks with the same")]
    Mismatch {
        /// Which.
        rank: u32,
        /// Where it runs.
        host: String,
        /// Scene, seed, kernels, version and so on.
        what: String,
        /// What that rank has.
        theirs: String,
        /// What the root has.
        ours: String,
    },
    /// A rank was not heard of for too long.
    #[error(
        "rank {rank} on {host} was silent for {seconds} s and counts as lost; look for what stopped it there, or allow more by --patience"
    )]
    Silent {
        /// Which.
        rank: u32,
        /// Where it runs.
        host: String,
        /// For how long.
        seconds: u64,
    },
    /// A message that no rank of this version sends.
    #[error("rank {rank} sent {message}; start all ranks with the same program")]
    Protocol {
        /// Which.
        rank: u32,
        /// What is wrong with it.
        message: String,
    },
    /// The job was told to end.
    #[error("ended by a signal; {done} of {total} pixels were there")]
    Ended {
        /// Pixels of which all samples came.
        done: u64,
        /// Of the image.
        total: u64,
    },
    /// A rank that has no GPU, where all should.
    #[error(
        "this rank is number {local} on its host, which has {devices} {backend} devices; start fewer ranks a host, or let the others use the CPU by --spare cpu"
    )]
    NoDevice {
        /// Its number there, from 0.
        local: u32,
        /// That it should use.
        backend: &'static str,
        /// There.
        devices: usize,
    },
    /// A thread could not be started.
    #[error(transparent)]
    Threads(#[from] ThreadError),
    /// What a mode cannot do.
    #[error("{what}; {remedy}")]
    Unsupported {
        /// It.
        what: String,
        /// What helps.
        remedy: String,
    },
}

impl ClusterError {
    /// The process's exit code.
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
