//! Supervision of `trisect tradeoff` and `trisect converge`: time limit, interrupts and progress.

use super::checkpointing::OUT_OF_TIME;
use super::signals::{INTERRUPTED, interrupts};
use crate::progress::Bar;
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use trisect::render::RenderObserver;
use trisect_lab::tradeoff::{Stop, Supervisor};

/// Minimum time between two lines of progress without a terminal.
const LINES_APART: Duration = Duration::from_secs(10);

/// Ends a measurement at its time limit or at the first interrupt, and shows its progress: as a bar
/// on a terminal, else as lines.
pub struct LabSupervisor {
    interrupted: Arc<AtomicBool>,
    start: Instant,
    limit: Duration,
    quiet: bool,
    bar: Bar,
    /// Number of completed stages, number of all stages, and name of the current one.
    stage: (usize, usize, String),
    /// Time of the last line of progress.
    last: Option<Instant>,
    /// True if the interrupt was acknowledged.
    told: bool,
}

impl LabSupervisor {
    /// Starts the clock of a measurement that takes at most `limit`.
    pub fn new(limit: Duration, quiet: bool) -> Self {
        let (interrupted, bar) = (interrupts(), Bar::of_stages(quiet));
        let (start, stage) = (Instant::now(), (0, 1, "speed of the base".to_owned()));
        Self { interrupted, start, limit, quiet, bar, stage, last: None, told: false }
    }

    /// Returns the time since the measurement started.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Removes the progress bar.
    pub fn finish(&self) {
        self.bar.clear();
    }

    /// Writes a line of progress if there is no bar and the last line is old enough.
    fn show(&mut self) {
        let is_due = self.last.is_none_or(|last| last.elapsed() >= LINES_APART);
        if self.quiet || !self.bar.is_hidden() || !is_due {
            return;
        }
        self.last = Some(Instant::now());
        let (elapsed, limit) = (self.elapsed().as_secs_f64(), self.limit.as_secs_f64());
        let (done, all, name) = &self.stage;
        self.bar.print_line(&format!("after {elapsed:.0} of {limit:.0} s: {name} ({done} of {all} done)"));
    }
}

/// Returns the exit code of a measurement that `ended` stopped; `None` for a complete one.
pub fn exit_code(ended: Option<Stop>) -> ExitCode {
    match ended {
        None => ExitCode::SUCCESS,
        Some(Stop::OutOfTime) => ExitCode::from(OUT_OF_TIME),
        Some(Stop::Interrupted) => ExitCode::from(INTERRUPTED as u8),
    }
}

impl RenderObserver for LabSupervisor {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        if !self.told && self.interrupted.load(Ordering::Relaxed) {
            self.told = true;
            self.bar.print_line("interrupted: writing what was measured; a second interrupt ends at once");
        }
        self.bar.tick();
        self.show();
        ControlFlow::Continue(())
    }

    fn should_continue(&self) -> bool {
        self.stop().is_none()
    }
}

impl Supervisor for LabSupervisor {
    fn stop(&self) -> Option<Stop> {
        let is_over = self.elapsed() >= self.limit;
        match self.interrupted.load(Ordering::Relaxed) {
            true => Some(Stop::Interrupted),
            false => is_over.then_some(Stop::OutOfTime),
        }
    }

    fn time_left(&self) -> Option<Duration> {
        Some(self.limit.saturating_sub(self.elapsed()))
    }

    fn report(&mut self, line: &str) {
        if !self.quiet {
            self.bar.print_line(line);
        }
    }

    fn begin(&mut self, done: usize, all: usize, stage: &str) {
        self.bar.stage(done, all, stage);
        self.stage = (done, all, stage.to_owned());
        self.show();
    }
}
