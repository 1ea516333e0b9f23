//! The progress bar: on a terminal only, on standard error.

use crate::commands::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use trisect::render::Observer;

/// Steps of a bar that shows stages.
const STAGE_STEPS: u64 = 1000;

/// Shows samples done, rate and time left.
pub struct Bar {
    bar: ProgressBar,
}

impl Bar {
    /// A bar, or nothing when `quiet` or without a terminal.
    pub fn new(quiet: bool) -> Self {
        Self::of(quiet, "{wide_bar} {percent:>3} %  {human_pos}/{human_len} samples  {rate}  {eta} left")
    }

    /// For a render that does not know how many samples it will take.
    pub fn of_goal(quiet: bool) -> Self {
        Self::of(quiet, "{wide_bar} {percent:>3} %  {elapsed}")
    }

    /// For a measurement of several stages, which are named below it.
    pub fn of_stages(quiet: bool) -> Self {
        let bar = Self::of(quiet, "{wide_bar} {percent:>3} %  {elapsed}\n{wide_msg}");
        bar.bar.set_length(STAGE_STEPS);
        bar
    }

    /// Shows that the stage of this name begins, after `done` of `all`.
    pub fn stage(&self, done: usize, all: usize, name: &str) {
        self.bar.set_position(STAGE_STEPS * done as u64 / all.max(1) as u64);
        self.bar.set_message(name.to_owned());
    }

    /// Shows the time that has passed.
    pub fn tick(&self) {
        self.bar.tick();
    }

    /// Writes a line to standard error, above the bar where there is one.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| say(line));
    }

    /// Returns whether nothing is shown.
    pub fn is_hidden(&self) -> bool {
        self.bar.is_hidden()
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    fn of(quiet: bool, template: &str) -> Self {
        let bar = if quiet || !std::io::stderr().is_terminal() {
            ProgressBar::hidden()
        } else {
            ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr_with_hz(10))
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            let rate = |state: &ProgressState, out: &mut dyn Write| {
                let _ = write!(out, "{:.1} Msamples/s", state.per_sec() * 1e-6);
            };
            bar.set_style(style.with_key("rate", rate));
        }
        Self { bar }
    }
}

impl Observer for Bar {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        self.bar.set_length(total);
        self.bar.set_position(done);
        if done == total {
            self.bar.finish_and_clear();
        }
        ControlFlow::Continue(())
    }
}
