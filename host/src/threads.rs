//! Threads, each of which may be refused by the system: an error, where the standard library
//! panics.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::error::Error;
use std::thread::{Builder, JoinHandle};
use thiserror::Error;

/// As many as `--threads` and `RAYON_NUM_THREADS` may ask for.
pub const MAX_THREADS: usize = 1024;

/// Bytes of a thread's stack, whatever `RUST_MIN_STACK` says.
const STACK: usize = 2 << 20;

/// Variable of the environment with the number of threads where no option says it.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// Threads that cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ThreadError {
    /// The system refused.
    #[error(
        "{count} {what} cannot be started: {message}\n  ask for fewer (--threads), or raise the limit of processes (ulimit -u, pids.max of the control group) or of memory (ulimit -v)"
    )]
    Refused {
        /// Threads.
        count: usize,
        /// What they are for.
        what: &'static str,
        /// What the system said.
        message: String,
    },
    /// `RAYON_NUM_THREADS` is no number of threads.
    #[error("{VARIABLE} is {value:?}; it must be 1 to {MAX_THREADS}, or 0 for one thread a logical core")]
    Count {
        /// What it is.
        value: String,
    },
}

impl ThreadError {
    /// Exit code of the program: 1 where the system refuses, 2 for a wrong number.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Refused { .. } => 1,
            Self::Count { .. } => 2,
        }
    }
}

/// Returns the number of threads that a pool should have: as `asked`, or as `RAYON_NUM_THREADS`
/// says, or one for each logical core.
pub fn count(asked: Option<usize>) -> Result<usize, ThreadError> {
    let value = std::env::var_os(VARIABLE).map(|value| value.to_string_lossy().into_owned());
    count_of(asked, value.as_deref())
}

fn count_of(asked: Option<usize>, variable: Option<&str>) -> Result<usize, ThreadError> {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    match (asked.filter(|&asked| asked > 0), variable.filter(|value| !value.is_empty())) {
        (Some(asked), _) => Ok(asked),
        (None, None) => Ok(cores()),
        (None, Some(value)) => match value.trim().parse() {
            Ok(0) => Ok(cores()),
            Ok(count) if count <= MAX_THREADS => Ok(count),
            _ => Err(ThreadError::Count { value: value.to_owned() }),
        },
    }
}

/// Starts the pool that all parallel loops outside a backend's own share, once: a later call
/// changes nothing. A program calls it before anything is rendered, read from a checkpoint or
/// compared; otherwise rayon starts threads for all cores by itself, and panics where it cannot.
pub fn start_shared(asked: Option<usize>) -> Result<(), ThreadError> {
    let count = count(asked)?;
    match builder(count, "trisect-pool").build_global() {
        // Without a source it is there already.
        Err(error) if error.source().is_some() => Err(refused(count, "threads", &error)),
        _ => Ok(()),
    }
}

/// Starts a pool of its own.
pub(crate) fn pool(asked: Option<usize>, name: &'static str) -> Result<ThreadPool, ThreadError> {
    let count = count(asked)?;
    builder(count, name).build().map_err(|error| refused(count, "threads", &error))
}

fn builder(count: usize, name: &'static str) -> ThreadPoolBuilder {
    let name = move |index| format!("{name}-{index}");
    ThreadPoolBuilder::new().num_threads(count).stack_size(STACK).thread_name(name)
}

/// Starts one thread.
pub fn spawn<T: Send + 'static>(
    what: &'static str,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, ThreadError> {
    Builder::new().stack_size(STACK).spawn(work).map_err(|error| refused(1, what, &error))
}

/// The error of a thread that the system refused.
pub(crate) fn refused(count: usize, what: &'static str, error: &dyn Error) -> ThreadError {
    ThreadError::Refused { count, what, message: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_may_say_how_many() {
        let cores = std::thread::available_parallelism().unwrap().get();
        assert_eq!(count_of(None, None), Ok(cores));
        assert_eq!(count_of(Some(3), Some("nonsense")), Ok(3));
        for (value, count) in [("5", 5), (" 1024 ", 1024), ("0", cores), ("", cores)] {
            assert_eq!(count_of(None, Some(value)), Ok(count), "{value}");
        }
        for value in ["1025", "1000000", "99999999999999999999", "-1", "two", "1.5"] {
            assert_eq!(count_of(None, Some(value)), Err(ThreadError::Count { value: value.to_owned() }));
        }
    }

    #[test]
    fn a_pool_has_the_threads_asked_for() {
        assert_eq!(pool(Some(3), "test").unwrap().current_num_threads(), 3);
        assert_eq!(spawn("test", || 7).unwrap().join().unwrap(), 7);
        assert_eq!(start_shared(None), Ok(()));
        assert_eq!(start_shared(Some(1)), Ok(()), "it is there already");
    }
}
