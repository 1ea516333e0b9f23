//! Supervision of a measurement: reports its progress and decides when it ends. The commands
//! `tradeoff` and `converge` implement [`Supervisor`].

use crate::Error;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Duration;
use trisect::render::RenderObserver;

/// Reason why a measurement ended before all of it was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// Its time limit was reached.
    OutOfTime,
    /// The user interrupted it.
    Interrupted,
}

impl Stop {
    /// Returns the reason as words for messages.
    pub fn reason(self) -> String {
        let cause = match self {
            Self::OutOfTime => "the time limit",
            Self::Interrupted => "an interrupt",
        };
        format!("ended by {cause}")
    }
}

/// Decides when a measurement must end, and reports its progress to the user.
pub trait Supervisor: RenderObserver {
    /// Returns the reason why no further stage may begin, or `None` while the measurement
    /// continues.
    fn stop(&self) -> Option<Stop>;

    /// Returns the time that is left, or `None` without a limit.
    fn time_left(&self) -> Option<Duration>;

    /// Reports a result to the user.
    fn report(&mut self, line: &str);

    /// Reports to the user which stage begins, after `done` of `all` stages.
    fn begin(&mut self, done: usize, all: usize, stage: &str);
}

/// Returns [`trisect::Error::Cancelled`] if no further stage may begin.
pub(super) fn check(supervisor: &dyn Supervisor) -> Result<(), Error> {
    if supervisor.stop().is_some() { Err(trisect::Error::Cancelled.into()) } else { Ok(()) }
}

/// Returns `None` if the supervisor ended the stage. Errors of another cause are returned.
pub(super) fn was_stopped<T>(
    result: Result<T, Error>,
    supervisor: &dyn Supervisor,
) -> Result<Option<T>, Error> {
    match result {
        Err(Error::Render(trisect::Error::Cancelled)) if supervisor.stop().is_some() => Ok(None),
        result => result.map(Some),
    }
}

/// Cancels a render as soon as the measurement must end.
pub(super) struct Cancelling<'a>(pub &'a mut dyn Supervisor);

impl RenderObserver for Cancelling<'_> {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        match self.0.progress(done, total) {
            ControlFlow::Continue(()) if self.0.stop().is_none() => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        }
    }

    fn should_continue(&self) -> bool {
        self.0.stop().is_none()
    }
}

/// Ends a render with the samples that it has once its share of the time is over, or at an
/// interrupt. Cancels it at the end of the measurement's time, and at an interrupt if the render
/// has no samples yet.
pub(super) struct Ending<'a> {
    pub supervisor: &'a mut dyn Supervisor,
    /// Time left to the measurement when the render's share is over; `None` without a limit.
    pub until: Option<Duration>,
}

impl RenderObserver for Ending<'_> {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        let flow = self.supervisor.progress(done, total);
        match (flow, self.supervisor.stop()) {
            (ControlFlow::Break(()), _) | (_, Some(Stop::OutOfTime)) => ControlFlow::Break(()),
            (_, Some(Stop::Interrupted)) if done == 0 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    }

    fn should_continue(&self) -> bool {
        let over = self.until.zip(self.supervisor.time_left()).is_some_and(|(until, left)| left <= until);
        self.supervisor.stop().is_none() && !over
    }
}

/// Ends a measurement so long before the end of its time as its longest step without a check takes:
/// FLIP and statistics of large images cannot be cancelled.
pub(super) struct Reserving<'a> {
    supervisor: &'a mut dyn Supervisor,
    reserve: Duration,
}

impl<'a> Reserving<'a> {
    pub fn new(supervisor: &'a mut dyn Supervisor) -> Self {
        Self { supervisor, reserve: Duration::ZERO }
    }

    /// Notes that a step without a check took this long.
    pub fn note(&mut self, step: Duration) {
        self.reserve = self.reserve.max(step);
    }
}

impl RenderObserver for Reserving<'_> {
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()> {
        self.supervisor.progress(done, total)
    }

    fn should_continue(&self) -> bool {
        self.stop().is_none()
    }
}

impl Supervisor for Reserving<'_> {
    fn stop(&self) -> Option<Stop> {
        let is_over = self.supervisor.time_left().is_some_and(|left| left <= self.reserve);
        self.supervisor.stop().or(is_over.then_some(Stop::OutOfTime))
    }

    fn time_left(&self) -> Option<Duration> {
        self.supervisor.time_left().map(|left| left.saturating_sub(self.reserve))
    }

    fn report(&mut self, line: &str) {
        self.supervisor.report(line);
    }

    fn begin(&mut self, done: usize, all: usize, stage: &str) {
        self.supervisor.begin(done, all, stage);
    }
}

/// Share of the time that is left, for one of several tasks.
pub(super) struct Share {
    /// Time left when the share began, and the share itself; `None` without a limit.
    of: Option<(Duration, Duration)>,
}

impl Share {
    /// Returns an equal share for each of `count` tasks that are still to come.
    pub fn new(supervisor: &dyn Supervisor, count: usize) -> Self {
        Self { of: supervisor.time_left().map(|left| (left, left / count.clamp(1, 1 << 20) as u32)) }
    }

    /// Returns the time spent since the share began.
    pub fn spent(&self, supervisor: &dyn Supervisor) -> Duration {
        let of = self.of.zip(supervisor.time_left());
        of.map_or(Duration::ZERO, |((before, _), left)| before.saturating_sub(left))
    }

    /// Returns whether a stage of this duration ends within the share.
    pub fn has_room_for(&self, stage: Duration, supervisor: &dyn Supervisor) -> bool {
        self.of.is_none_or(|(_, share)| self.spent(supervisor).saturating_add(stage) <= share)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::cell::Cell;

    /// Test supervisor that ends a measurement after a number of submissions, and counts what
    /// begins after that. Its clock shows one second per submission.
    pub struct Scripted {
        /// Submissions until the end.
        pub submissions: u32,
        /// Time limit in seconds, if any.
        pub limit: Option<u32>,
        /// Reason why the measurement ends.
        pub stop: Stop,
        /// Submissions so far.
        pub done: u32,
        /// Stages and submissions that began after the end.
        pub late: Cell<u32>,
        /// Reported lines.
        pub said: Vec<String>,
    }

    impl Scripted {
        pub fn new(submissions: u32) -> Self {
            let stop = Stop::Interrupted;
            Self { submissions, limit: None, stop, done: 0, late: Cell::new(0), said: Vec::new() }
        }

        pub fn within(seconds: u32) -> Self {
            Self { limit: Some(seconds), stop: Stop::OutOfTime, ..Self::new(seconds) }
        }

        fn count(&self) {
            if self.done >= self.submissions {
                self.late.set(self.late.get() + 1);
            }
        }
    }

    impl RenderObserver for Scripted {
        fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
            self.count();
            self.done += 1;
            ControlFlow::Continue(())
        }

        fn should_continue(&self) -> bool {
            self.stop().is_none()
        }
    }

    impl Supervisor for Scripted {
        fn stop(&self) -> Option<Stop> {
            (self.done >= self.submissions).then_some(self.stop)
        }

        fn time_left(&self) -> Option<Duration> {
            self.limit.map(|limit| Duration::from_secs(u64::from(limit.saturating_sub(self.done))))
        }

        fn report(&mut self, line: &str) {
            self.said.push(line.to_owned());
        }

        fn begin(&mut self, _: usize, _: usize, _: &str) {
            self.count();
        }
    }

    #[test]
    fn long_steps_end_within_the_time() {
        let seconds = Duration::from_secs;
        let mut inner = Scripted::within(12);
        inner.done = 5;
        let mut supervisor = Reserving::new(&mut inner);
        supervisor.note(seconds(3));
        supervisor.note(seconds(1));
        assert_eq!((supervisor.stop(), supervisor.time_left()), (None, Some(seconds(4))));
        let _ = supervisor.progress(0, 0);
        let _ = supervisor.progress(0, 0);
        let _ = supervisor.progress(0, 0);
        assert_eq!(supervisor.stop(), None);
        let _ = supervisor.progress(0, 0);
        // Three seconds are left, and a step takes as long.
        assert_eq!((supervisor.stop(), supervisor.time_left()), (Some(Stop::OutOfTime), Some(seconds(0))));
        // Negative control: without a note it goes on, as does a measurement without a limit.
        assert_eq!(inner.stop(), None);
        let mut free = Scripted::new(12);
        let mut supervisor = Reserving::new(&mut free);
        supervisor.note(seconds(100));
        assert_eq!((supervisor.stop(), supervisor.time_left()), (None, None));
    }

    #[test]
    fn shares_end_within_the_time() {
        let mut supervisor = Scripted::within(12);
        let share = Share::new(&supervisor, 3);
        let seconds = Duration::from_secs;
        assert!(share.has_room_for(seconds(4), &supervisor) && !share.has_room_for(seconds(5), &supervisor));
        supervisor.done = 3;
        assert_eq!(share.spent(&supervisor), seconds(3));
        assert!(share.has_room_for(seconds(1), &supervisor) && !share.has_room_for(seconds(2), &supervisor));
        // Time that one task leaves is shared by the others.
        assert!(Share::new(&supervisor, 2).has_room_for(seconds(4), &supervisor));
        assert!(Share::new(&Scripted::new(1), 3).has_room_for(Duration::MAX, &supervisor));
    }
}
