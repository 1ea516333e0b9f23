//! The progress bar: on a terminal only, on standard error.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use trisect::render::Observer;

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
