//! Progress of a render: signals, cancellation, failed checkpoints, and the caller's callback.

use crate::lifecycle::is_ending;
use pyo3::exceptions::PyRuntimeWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use trisect::checkpoint::Saver;
use trisect::render::RenderObserver;
use trisect::stats::GoalProgress;

/// Minimum time between two looks at signals.
const SIGNALS_EVERY: Duration = Duration::from_millis(20);

/// Minimum time between two calls of a callback.
const CALLS_EVERY: Duration = Duration::from_millis(100);

/// State of a render, as a callback receives it.
#[pyclass(frozen, module = "trisect", get_all)]
pub struct Progress {
    /// Samples done, of all pixels.
    done: u64,
    /// Samples in all; None for a render with a goal.
    total: Option<u64>,
    /// Seconds since the render began.
    seconds: f64,
    /// Estimated seconds left; None if unknown.
    left: Option<f64>,
    /// Estimated relative error of the image so far; None unless the render has a goal.
    error: Option<f64>,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        match self.total {
            Some(total) => format!("<Progress: {} of {total} samples>", self.done),
            None => format!("<Progress: {} samples>", self.done),
        }
    }
}

/// Observer of a render.
pub struct Watch<'a> {
    /// Set by another thread to end the render.
    cancel: &'a AtomicBool,
    callback: Option<Py<PyAny>>,
    /// Writer of the checkpoint, whose failures are warnings.
    saver: Option<&'a Saver>,
    /// True for a render with a goal, which keeps its samples when it ends early.
    has_goal: bool,
    start: Instant,
    looked: Instant,
    called: Instant,
    goal: Option<GoalProgress>,
    /// Exception that ended the render.
    raised: Option<PyErr>,
    /// True if the render is to end.
    ends: bool,
}

impl<'a> Watch<'a> {
    /// Makes the observer of a render that begins now.
    pub fn new(
        cancel: &'a AtomicBool,
        callback: Option<Py<PyAny>>,
        saver: Option<&'a Saver>,
        has_goal: bool,
    ) -> Self {
        let start = Instant::now();
        let (looked, called, goal, raised) = (start, start, None, None);
        Self { cancel, callback, saver, has_goal, start, looked, called, goal, raised, ends: false }
    }

    /// Returns the time since the render began.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Takes the exception that ended the render, if there was one.
    pub fn raised(&mut self) -> Option<PyErr> {
        self.raised.take()
    }

    /// Returns whether the render was ended early.
    pub fn has_ended(&self) -> bool {
        self.ends
    }

    /// Looks at signals and cancellation, without a call of the callback.
    pub fn look_at_signals(&mut self) {
        if self.cancel.load(Ordering::Relaxed) || is_ending() {
            self.ends = true;
        } else if !self.ends && self.looked.elapsed() >= SIGNALS_EVERY {
            self.looked = Instant::now();
            match Python::try_attach(|py| py.check_signals()) {
                Some(Ok(())) => {}
                Some(Err(error)) => (self.ends, self.raised) = (true, Some(error)),
                None => self.ends = true,
            }
        }
    }

    /// Looks at signals and calls the callback, where it is time.
    fn look(&mut self, done: u64, total: u64) {
        if self.looked.elapsed() < SIGNALS_EVERY && done != total {
            return;
        }
        self.looked = Instant::now();
        let is_due = self.callback.is_some() && (self.called.elapsed() >= CALLS_EVERY || done == total);
        let told = is_due.then(|| self.state(done, total));
        let failure = self.saver.and_then(Saver::failure);
        let attached = Python::try_attach(|py| {
            py.check_signals()?;
            if let Some(failure) = failure {
                warn(py, &format!("{failure}; the render continues, and the next checkpoint tries again"))?;
            }
            if let (Some(callback), Some(told)) = (&self.callback, told) {
                callback.call1(py, (told,))?;
            }
            Ok(())
        });
        if is_due {
            self.called = Instant::now();
        }
        match attached {
            Some(Ok(())) => {}
            Some(Err(error)) => (self.ends, self.raised) = (true, Some(error)),
            // The interpreter has ended.
            None => self.ends = true,
        }
    }

    fn state(&self, done: u64, total: u64) -> Progress {
        let seconds = self.start.elapsed().as_secs_f64();
        let share = if total > 0 { done as f64 / total as f64 } else { 0.0 };
        let left = match (&self.goal, self.has_goal) {
            (Some(goal), _) => goal.left.map(|left| left.as_secs_f64()),
            (None, true) => None,
            (None, false) => (share > 0.0).then(|| seconds * (1.0 - share) / share),
        };
        let error = self.goal.as_ref().map(|goal| goal.error).filter(|error| error.is_finite());
        Progress { done, total: (!self.has_goal).then_some(total), seconds, left, error }
    }
}

impl RenderObserver for Watch<'_> {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        if self.cancel.load(Ordering::Relaxed) || is_ending() {
            self.ends = true;
        } else if !self.ends {
            self.look(done, total);
        }
        // A goal ends between its passes, with all samples so far.
        if self.ends && !self.has_goal { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn goal_progress(&mut self, goal: GoalProgress) {
        self.goal = Some(goal);
    }

    fn should_continue(&self) -> bool {
        !self.ends && !self.cancel.load(Ordering::Relaxed) && !is_ending()
    }
}

/// Issues a `RuntimeWarning`.
fn warn(py: Python<'_>, message: &str) -> PyResult<()> {
    let message = CString::new(message.replace('\0', " "))?;
    PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), &message, 1)
}
