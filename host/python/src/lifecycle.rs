//! Life of the process: renders that run, forks, and the end of the interpreter.
//!
//! Threads do not survive a fork. A child of a process that has rendered would wait for them for
//! ever, so every call of the library in it raises `ForkError`.

use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// True once the library has started threads.
static HAS_STARTED: AtomicBool = AtomicBool::new(false);
/// True in a child of a process that had started threads.
static IS_FORKED: AtomicBool = AtomicBool::new(false);
/// True once the interpreter ends.
static IS_ENDING: AtomicBool = AtomicBool::new(false);
/// Number of calls that run.
static RUNNING: AtomicUsize = AtomicUsize::new(0);

/// Maximum time that the interpreter's end waits for renders that run.
const PATIENCE: Duration = Duration::from_secs(5);

/// A call of the library that runs.
pub struct Running(());

impl Running {
    /// Begins a call.
    ///
    /// # Errors
    ///
    /// `ForkError` in a process that cannot use the library's threads.
    pub fn begin() -> PyResult<Self> {
        if is_forked() {
            let message = "this process was forked from one that had rendered, whose threads it does not have; \
                start processes by multiprocessing.get_context(\"spawn\")";
            return Err(Python::attach(|py| fork_error(py, message).unwrap_or_else(|error| error)));
        }
        HAS_STARTED.store(true, Ordering::Relaxed);
        RUNNING.fetch_add(1, Ordering::AcqRel);
        Ok(Self(()))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        RUNNING.fetch_sub(1, Ordering::AcqRel);
    }
}

fn fork_error(py: Python<'_>, message: &str) -> PyResult<PyErr> {
    let error = py.import("trisect.errors")?.getattr("ForkError")?.call1((message,))?;
    Ok(PyErr::from_value(error))
}

/// Returns whether the process is a child of one that had started threads.
pub fn is_forked() -> bool {
    IS_FORKED.load(Ordering::Relaxed)
}

/// Returns whether the interpreter ends, so that renders must end, too.
pub fn is_ending() -> bool {
    IS_ENDING.load(Ordering::Relaxed)
}

/// Marks a forked child.
#[pyfunction]
fn after_fork() {
    if HAS_STARTED.load(Ordering::Relaxed) {
        IS_FORKED.store(true, Ordering::Relaxed);
    }
}

/// Ends the renders of other threads.
#[pyfunction]
fn at_exit(py: Python<'_>) {
    IS_ENDING.store(true, Ordering::Relaxed);
    py.detach(|| {
        let start = Instant::now();
        while RUNNING.load(Ordering::Acquire) > 0 && start.elapsed() < PATIENCE && !is_forked() {
            thread::sleep(Duration::from_millis(5));
        }
    });
}

/// Registers what runs after a fork and at the end of the interpreter.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let child = pyo3::types::PyDict::new(py);
    child.set_item("after_in_child", wrap_pyfunction!(after_fork, module)?)?;
    py.import("os")?.getattr("register_at_fork")?.call((), Some(&child))?;
    py.import("atexit")?.call_method1("register", (wrap_pyfunction!(at_exit, module)?,))?;
    Ok(())
}
