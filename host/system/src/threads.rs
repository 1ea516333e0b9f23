//! Starting threads. If the system refuses one, this is an error, where the standard library
//! panics.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::error::Error;
use std::thread::{Builder, JoinHandle};
use thiserror::Error;

/// Maximum number of threads for `--threads` and `RAYON_NUM_THREADS`.
pub const MAX_THREADS: usize = 1024;

/// Stack of a thread in bytes, regardless of `RUST_MIN_STACK`.
const STACK: usize = 2 << 20;

/// Environment variable with the number of threads, used if no option gives one.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// Threads that cannot be started.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ThreadError {
    /// The system refused to start threads.
    #[error(
        "{count} {what} cannot be started: {message}\n  ask for fewer (`threads`), or raise the limit of processes (ulimit -u, pids.max of the control group) or of memory (ulimit -v)"
    )]
    Refused {
        /// Number of threads.
        count: usize,
        /// Purpose of the threads.
        what: &'static str,
        /// Message of the system.
        message: String,
    },
    /// `RAYON_NUM_THREADS` is not a valid number of threads.
    #[error("{VARIABLE} is {value:?}; it must be 1 to {MAX_THREADS}, or 0 for one thread per logical core")]
    Count {
        /// Value of the variable.
        value: String,
    },
}

impl ThreadError {
    /// Returns the program's exit code: 1 if the system refuses, 2 for an invalid number.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Refused { .. } => 1,
            Self::Count { .. } => 2,
        }
    }
}

/// Returns the number of threads of a pool: `asked`, else `RAYON_NUM_THREADS`, else one for each
/// logical core.
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

/// Starts the global pool, which all parallel loops outside a backend's own pool share. Later calls
/// change nothing. A program calls it before it renders, reads a checkpoint or compares images.
/// Otherwise rayon starts threads for all cores implicitly, and panics if it cannot.
pub fn start_shared(asked: Option<usize>) -> Result<(), ThreadError> {
    let count = count(asked)?;
    match builder(count, "trisect-pool").build_global() {
        // An error without a source means that the pool exists already.
        Err(error) if error.source().is_some() => Err(refused(count, "threads", &error)),
        _ => Ok(()),
    }
}

/// Pool of threads of its own; in a browser, the thread that calls.
pub struct Pool(Option<ThreadPool>);

impl Pool {
    /// Runs `work`, whose parallel loops use the pool.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Returns the number of threads.
    pub fn threads(&self) -> usize {
        self.0.as_ref().map_or(1, ThreadPool::current_num_threads)
    }
}

/// Starts a separate pool.
pub fn pool(asked: Option<usize>, name: &'static str) -> Result<Pool, ThreadError> {
    if cfg!(target_family = "wasm") {
        return Ok(Pool(None));
    }
    let count = count(asked)?;
    let pool = builder(count, name).build().map_err(|error| refused(count, "threads", &error))?;
    Ok(Pool(Some(pool)))
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

/// Returns the error of threads that the system refused.
pub fn refused(count: usize, what: &'static str, error: &dyn Error) -> ThreadError {
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
        assert_eq!(pool(Some(3), "test").unwrap().threads(), 3);
        assert_eq!(spawn("test", || 7).unwrap().join().unwrap(), 7);
        assert_eq!(start_shared(None), Ok(()));
        assert_eq!(start_shared(Some(1)), Ok(()), "it is there already");
    }
}
