//! Supervisor of a measurement: time limit, signals, and the caller's callback.

use super::in_words_of_python;
use crate::lifecycle::is_ending;
use crate::progress_callback::ProgressCallback;
use pyo3::prelude::*;
use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use trisect::render::RenderObserver;
use trisect_lab::tradeoff::{Stop, Supervisor};

/// Minimum time between two looks at signals.
const SIGNALS_EVERY: Duration = Duration::from_millis(20);

/// Time between two calls of a callback without news.
const CALLS_EVERY: Duration = Duration::from_millis(100);

/// State of a measurement, as a callback receives it.
#[pyclass(frozen, module = "trisect", get_all)]
pub struct LabProgress {
    /// Stages done: configurations with a number of samples.
    done: usize,
    /// Stages in all, as far as they are known.
    total: usize,
    /// Name of the current stage.
    stage: String,
    /// Seconds since the measurement began.
    seconds: f64,
    /// Seconds until the time limit.
    left: f64,
    /// Result or warning, if this call is about one; else None.
    message: Option<String>,
}

#[pymethods]
impl LabProgress {
    fn __repr__(&self) -> String {
        format!("<LabProgress: {} of {} stages, {}>", self.done, self.total, self.stage)
    }
}

/// Supervisor of a measurement that a call from Python makes.
pub struct Watch {
    callback: Option<ProgressCallback>,
    limit: Duration,
    start: Instant,
    /// Last look at signals.
    looked: Cell<Instant>,
    /// Last call of the callback.
    called: Instant,
    /// Number of stages done, number of all stages, and name of the current one.
    stage: (usize, usize, String),
    /// Exception that ended the measurement.
    raised: Cell<Option<PyErr>>,
    /// True if the measurement is to end.
    ends: Cell<bool>,
}

impl Watch {
    /// Starts the clock of a measurement.
    pub fn new(limit: Duration, callback: Option<ProgressCallback>) -> Self {
        let start = Instant::now();
        Self {
            callback,
            limit,
            start,
            looked: Cell::new(start),
            called: start,
            stage: (0, 1, "speed of the base".to_owned()),
            raised: Cell::new(None),
            ends: Cell::new(false),
        }
    }

    /// Returns the seconds since the measurement began.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Returns `None` for a measurement that was not ended, else the exception that ended it, if
    /// there was one.
    #[expect(clippy::option_option, reason = "the outer one says whether it was ended")]
    pub fn end(self) -> Option<Option<PyErr>> {
        self.ends.get().then(|| self.raised.take())
    }

    /// Tells the callback that a measurement is complete.
    pub fn complete(&mut self) {
        self.stage.0 = self.stage.1;
        self.tell(None);
    }

    /// Handles signals, where it is time.
    fn look(&self) {
        if is_ending() {
            self.ends.set(true);
        } else if !self.ends.get() && self.looked.get().elapsed() >= SIGNALS_EVERY {
            self.looked.set(Instant::now());
            self.note(Python::try_attach(|py| py.check_signals()));
        }
    }

    /// Ends the measurement after an exception, and after the end of the interpreter.
    fn note(&self, result: Option<PyResult<()>>) {
        match result {
            Some(Ok(())) => {}
            Some(Err(error)) => {
                self.ends.set(true);
                self.raised.set(Some(error));
            }
            None => self.ends.set(true),
        }
    }

    /// Calls the callback.
    fn tell(&mut self, message: Option<&str>) {
        self.look();
        let Some(callback) = self.callback.as_ref().filter(|_| !self.ends.get()) else { return };
        let (done, total, stage) = self.stage.clone();
        let seconds = self.seconds();
        let left = (self.limit.as_secs_f64() - seconds).max(0.0);
        let message = message.map(in_words_of_python);
        let told = LabProgress { done, total, stage, seconds, left, message };
        let result = Python::try_attach(|py| callback.callable().call1(py, (told,)).map(|_| ()));
        self.note(result);
        self.called = Instant::now();
    }
}

impl RenderObserver for Watch {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.look();
        if self.called.elapsed() >= CALLS_EVERY {
            self.tell(None);
        }
        ControlFlow::Continue(())
    }

    fn should_continue(&self) -> bool {
        self.stop().is_none()
    }
}

impl Supervisor for Watch {
    fn stop(&self) -> Option<Stop> {
        self.look();
        match self.ends.get() {
            true => Some(Stop::Interrupted),
            false => (self.start.elapsed() >= self.limit).then_some(Stop::OutOfTime),
        }
    }

    fn time_left(&self) -> Option<Duration> {
        Some(self.limit.saturating_sub(self.start.elapsed()))
    }

    fn report(&mut self, line: &str) {
        self.tell(Some(line));
    }

    fn begin(&mut self, done: usize, all: usize, stage: &str) {
        self.stage = (done, all, stage.to_owned());
        self.tell(None);
    }
}
