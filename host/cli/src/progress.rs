//! Progress bar: only on a terminal, on standard error.

use crate::commands::eprint;
use indicatif::{HumanCount, HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use trisect::adaptive::GoalProgress;
use trisect::render::RenderObserver;

/// Number of steps of a bar that shows stages.
const STAGE_STEPS: u64 = 1000;
/// Minimum columns of the bar itself beside text that may be omitted.
const MIN_BAR: usize = 10;

/// Columns of a render with a goal beside the bar and its facts: the percentage and the time.
const GOAL_REST: usize = 16;

/// Time left above which the estimate is meaningless.
const MAX_LEFT: Duration = Duration::from_secs(999 * 86_400);

/// Progress bar with samples done, rate and time left.
pub struct Bar {
    bar: ProgressBar,
    goal: Arc<Mutex<ToldGoal>>,
}

/// State of a render with a goal, and when it was told.
type ToldGoal = Option<(GoalProgress, Instant)>;

impl Bar {
    /// Returns a bar; it is hidden if `quiet`, or without a terminal.
    pub fn new(quiet: bool) -> Self {
        Self::of(target(quiet), "{wide_bar} {facts}", terminal_width)
    }

    /// Returns a bar that names what is rendered, such as a frame, at its left.
    pub fn named(quiet: bool, name: &str) -> Self {
        Self::named_on(target(quiet), name, terminal_width)
    }

    /// Returns a bar with a name on `target`; `width` returns the columns of the terminal.
    fn named_on(target: ProgressDrawTarget, name: &str, width: fn() -> usize) -> Self {
        let taken = name.chars().count() + 1;
        let bar = Self::of(target, "{prefix} {wide_bar} {facts}", move || width().saturating_sub(taken));
        bar.bar.set_prefix(name.to_owned());
        bar
    }

    /// Returns a bar for a render whose number of samples is not known.
    pub fn of_goal(quiet: bool) -> Self {
        Self::of_goal_on(target(quiet), terminal_width)
    }

    /// Returns a bar for a render with a goal on `target`; `width` returns the columns of the
    /// terminal.
    fn of_goal_on(target: ProgressDrawTarget, width: fn() -> usize) -> Self {
        Self::of(target, "{wide_bar} {percent:>3} %  {goal}{elapsed}", width)
    }

    /// Returns a bar for a measurement of several stages, which are named below the bar.
    pub fn of_stages(quiet: bool) -> Self {
        let template = "{wide_bar} {percent:>3} %  {elapsed}\n{wide_msg}";
        let bar = Self::of(target(quiet), template, terminal_width);
        bar.bar.set_length(STAGE_STEPS);
        bar
    }

    /// Shows that the stage with this name begins, after `done` of `all` stages.
    pub fn stage(&self, done: usize, all: usize, name: &str) {
        self.bar.set_position(STAGE_STEPS * done as u64 / all.max(1) as u64);
        self.bar.set_message(name.to_owned());
    }

    /// Updates the elapsed time.
    pub fn tick(&self) {
        self.bar.tick();
    }

    /// Writes a line to standard error, above the bar if one is shown.
    pub fn print_line(&self, line: &str) {
        self.bar.suspend(|| eprint(line));
    }

    /// Returns whether the bar is hidden.
    pub fn is_hidden(&self) -> bool {
        self.bar.is_hidden()
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Returns a bar on `target`; `width` returns the columns of the terminal.
    fn of(
        target: ProgressDrawTarget,
        template: &str,
        width: impl Fn() -> usize + Clone + Send + Sync + 'static,
    ) -> Self {
        let bar = ProgressBar::with_draw_target(Some(1), target);
        let told: Arc<Mutex<ToldGoal>> = Arc::default();
        if let Ok(style) = ProgressStyle::with_template(template) {
            let (goal, columns) = (Arc::clone(&told), width.clone());
            let goal_facts = move |_: &ProgressState, to: &mut dyn Write| {
                let told = *goal.lock().unwrap_or_else(PoisonError::into_inner);
                if let Some((state, since)) = told {
                    let _ = to.write_str(&goal_facts(columns(), &state, since.elapsed()));
                }
            };
            let facts = move |state: &ProgressState, to: &mut dyn Write| {
                let samples = (state.pos(), state.len().unwrap_or(1));
                let _ = to.write_str(&facts(width(), samples, state.per_sec(), state.eta()));
            };
            bar.set_style(style.with_key("facts", facts).with_key("goal", goal_facts));
        }
        Self { bar, goal: told }
    }
}

fn target(quiet: bool) -> ProgressDrawTarget {
    match quiet || !std::io::stderr().is_terminal() {
        true => ProgressDrawTarget::hidden(),
        false => ProgressDrawTarget::stderr_with_hz(10),
    }
}

fn terminal_width() -> usize {
    usize::from(console::Term::stderr().size().1)
}

/// Returns the text beside the bar: share, samples, rate in samples per second, and time left.
/// Where there are too few columns, numbers are rounded and words left out.
fn facts(width: usize, (done, all): (u64, u64), rate: f64, left: Duration) -> String {
    let share = format!("{:>3} %", (100.0 * done as f64 / all.max(1) as f64) as u32);
    let left = match left < MAX_LEFT {
        true => format!("  {:#} left", HumanDuration(left)),
        false => String::new(),
    };
    let (done, count) = (HumanCount(done), HumanCount(all));
    let wide = format!("{share}  {done}/{count} samples  {:.1} Msamples/s{left}", rate * 1e-6);
    match wide.len() + MIN_BAR < width {
        true => wide,
        false => format!("{share} of {}  {}/s{left}", rounded(all as f64), rounded(rate)),
    }
}

/// Returns a number of samples with three digits and a prefix of the SI, such as 2.50 M.
fn rounded(number: f64) -> String {
    let mut scaled = number;
    let mut prefixes = ["", " k", " M", " G", " T", " P"].into_iter();
    let mut prefix = prefixes.next().unwrap_or_default();
    // 999.5 would be written as 1000.
    while scaled >= 999.5 {
        let Some(next) = prefixes.next() else { break };
        (scaled, prefix) = (scaled / 1000.0, next);
    }
    let digits = match scaled {
        _ if prefix.is_empty() => 0,
        ..9.995 => 2,
        ..99.95 => 1,
        _ => 0,
    };
    format!("{scaled:.digits$}{prefix}")
}

/// Returns the text of a render with a goal, `since` after its state was told: the error, the goal
/// if that is an error, and the time left. What does not fit the columns is omitted.
fn goal_facts(width: usize, state: &GoalProgress, since: Duration) -> String {
    let percent = |error: f64| format!("{:.*} %", if error < 0.01 { 3 } else { 2 }, 100.0 * error);
    let error = match state.target {
        _ if !state.error.is_finite() => String::new(),
        Some(target) => format!("error {}, goal {}  ", percent(state.error), percent(target)),
        None => format!("error {}  ", percent(state.error)),
    };
    let left = state.left.filter(|left| *left < MAX_LEFT).map_or_else(String::new, |left| {
        let about = if state.target.is_some() { "about " } else { "" };
        format!("{about}{:#} left  ", HumanDuration(left.saturating_sub(since)))
    });
    let fits = |text: &str| text.len() + GOAL_REST + MIN_BAR <= width;
    [error.clone() + &left, left, error].into_iter().find(|text| fits(text)).unwrap_or_default()
}

impl RenderObserver for Bar {
    fn goal_progress(&mut self, state: GoalProgress) {
        *self.goal.lock().unwrap_or_else(PoisonError::into_inner) = Some((state, Instant::now()));
    }

    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        self.bar.set_length(total);
        self.bar.set_position(done);
        if done == total {
            self.bar.finish_and_clear();
        }
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::TermLike;
    use std::io::Result;

    /// Terminal with the given number of columns, which records its lines.
    #[derive(Clone, Debug)]
    struct Screen(u16, Arc<Mutex<Vec<String>>>);

    impl TermLike for Screen {
        fn width(&self) -> u16 {
            self.0
        }

        fn move_cursor_up(&self, _: usize) -> Result<()> {
            Ok(())
        }

        fn move_cursor_down(&self, _: usize) -> Result<()> {
            Ok(())
        }

        fn move_cursor_right(&self, _: usize) -> Result<()> {
            Ok(())
        }

        fn move_cursor_left(&self, _: usize) -> Result<()> {
            Ok(())
        }

        fn write_line(&self, line: &str) -> Result<()> {
            self.write_str(line)
        }

        fn write_str(&self, text: &str) -> Result<()> {
            self.1.lock().unwrap_or_else(PoisonError::into_inner).push(text.trim_end().to_owned());
            Ok(())
        }

        fn clear_line(&self) -> Result<()> {
            Ok(())
        }

        fn flush(&self) -> Result<()> {
            Ok(())
        }
    }

    /// Returns the longest line of a bar on a terminal with `columns` columns.
    fn longest(columns: u16, template: &str, width: fn() -> usize) -> String {
        longest_of(columns, |target| Bar::of(target, template, width))
    }

    fn longest_of(columns: u16, bar: impl FnOnce(ProgressDrawTarget) -> Bar) -> String {
        let lines = Arc::default();
        let screen = Screen(columns, Arc::clone(&lines));
        let mut bar = bar(ProgressDrawTarget::term_like(Box::new(screen)));
        for done in [1, 123_456_789, 499_999_999_999] {
            let _ = bar.progress(done, 500_000_000_000);
            bar.bar.tick();
        }
        let lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.iter().max_by_key(|line| line.chars().count()).cloned().unwrap_or_default()
    }

    #[test]
    fn a_bar_fits_its_terminal() {
        let line = longest(40, "{wide_bar} {facts}", || 40);
        assert!((20..=40).contains(&line.chars().count()) && line.contains(" of 500 G  "), "{line:?}");
        let line = longest(120, "{wide_bar} {facts}", || 120);
        assert!(line.contains("/500,000,000,000 samples") && line.chars().count() <= 120, "{line:?}");
        // Negative control: with the samples it would not fit.
        assert!(longest(40, "{wide_bar} {facts}", || 120).chars().count() > 40);
    }

    #[test]
    fn a_bar_with_a_name_fits_its_terminal() {
        let named = |width| longest_of(80, |target| Bar::named_on(target, "frame 12 (3 of 120)", width));
        let line = named(|| 80);
        assert!(line.starts_with("frame 12 (3 of 120) ") && line.chars().count() <= 80, "{line:?}");
        // Negative control: as wide as without a name it would not fit.
        assert!(named(|| 120).chars().count() > 80);
    }

    const GOAL: GoalProgress =
        GoalProgress { error: 0.0312, target: Some(0.005), left: Some(Duration::from_secs(65)) };

    /// The line has the error, the goal and the time left, which becomes less while a pass runs.
    #[test]
    fn a_goal_is_followed() {
        let text = |width, state, since| goal_facts(width, &state, Duration::from_secs(since));
        assert_eq!(text(100, GOAL, 0), "error 3.12 %, goal 0.500 %  about 65s left  ");
        assert_eq!(text(100, GOAL, 60), "error 3.12 %, goal 0.500 %  about 5s left  ");
        assert_eq!(text(100, GOAL, 600), "error 3.12 %, goal 0.500 %  about 0s left  ");
        let timed = GoalProgress { target: None, ..GOAL };
        assert_eq!(text(100, timed, 0), "error 3.12 %  65s left  ");
        assert_eq!(text(100, GoalProgress { error: f64::NAN, ..timed }, 0), "65s left  ");
        assert_eq!(text(100, GoalProgress { left: None, ..GOAL }, 0), "error 3.12 %, goal 0.500 %  ");
        assert_eq!((text(50, GOAL, 0), text(20, GOAL, 0)), ("about 65s left  ".to_owned(), String::new()));
    }

    #[test]
    fn a_bar_with_a_goal_fits_its_terminal() {
        let line = |columns, width| {
            longest_of(columns, |target| {
                let mut bar = Bar::of_goal_on(target, width);
                bar.goal_progress(GOAL);
                bar
            })
        };
        let wide = line(80, || 80);
        assert!(wide.contains("error 3.12 %, goal 0.500 %") && wide.chars().count() <= 80, "{wide:?}");
        let narrow = line(44, || 44);
        assert!(narrow.contains("about 65s left") && narrow.chars().count() <= 44, "{narrow:?}");
        // Negative control: with the error it would not fit.
        assert!(line(44, || 80).chars().count() > 44);
    }

    #[test]
    fn facts_are_short_where_columns_are_few() {
        for left in [Duration::ZERO, Duration::from_secs(86_400 * 998), Duration::MAX] {
            for rate in [0.0, 99_999e6] {
                let text = facts(40, (1 << 40, 1 << 50), rate, left);
                assert!(text.chars().count() <= 38, "{text:?}");
            }
        }
        let left = Duration::from_secs(65);
        assert_eq!(facts(40, (1, 4), 2.5e6, left), " 25 % of 4  2.50 M/s  65s left");
        for (number, text) in
            [(0.0, "0"), (999.0, "999"), (1000.0, "1.00 k"), (999_960.0, "1.00 M"), (12_345.0, "12.3 k")]
        {
            assert_eq!(rounded(number), text);
        }
        assert_eq!((rounded(1e17), rounded(1e19)), ("100 P".to_owned(), "10000 P".to_owned()));
        assert_eq!(
            facts(80, (1000, 4000), 2.5e6, left),
            " 25 %  1,000/4,000 samples  2.5 Msamples/s  65s left"
        );
    }
}
