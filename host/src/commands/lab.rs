//! Watches `trisect tradeoff` and `trisect converge`: their time, interrupts, and where they are.

use super::checkpointing::OUT_OF_TIME;
use super::signals::{INTERRUPTED, interrupts};
use crate::progress::Bar;
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use trisect::render::RenderObserver;
use trisect::tradeoff::{Stop, Supervisor};

/// Time between two lines of progress where there is no terminal.
const LINES_APART: Duration = Duration::from_secs(10);

/// Ends a measurement when its time is over or at the first interrupt, and shows how far it is: as
/// a bar on a terminal, else as lines.
pub struct LabSupervisor {
    interrupted: Arc<AtomicBool>,
    start: Instant,
    limit: Duration,
    quiet: bool,
    bar: Bar,
    /// Stages that are done, all of them, and the name of the next.
    stage: (usize, usize, String),
    /// When the last line of progress was written.
    last: Option<Instant>,
    /// Whether the interrupt was acknowledged.
    told: bool,
}

impl LabSupervisor {
    /// Begins a measurement of at most `limit`.
    pub fn new(limit: Duration, quiet: bool) -> Self {
        let (interrupted, bar) = (interrupts(), Bar::of_stages(quiet));
        let (start, stage) = (Instant::now(), (0, 1, "speed of the base".to_owned()));
        Self { interrupted, start, limit, quiet, bar, stage, last: None, told: false }
    }

    /// Returns the time since it began.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.clear();
    }

    /// Writes a line of progress where there is no bar, and none was written for a while.
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

/// Returns the exit code of a measurement that ended for this reason, or was completed.
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
            self.bar.print_line("interrupted: what was measured is written; once more ends at once");
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
