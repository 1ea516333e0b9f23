//! Observers of an adaptive render: progress in steps, and a grace period after a request to stop.

use crate::Error;
use crate::render::RenderObserver;
use std::ops::ControlFlow;
use std::time::Duration;
use web_time::Instant;

/// Total number of progress steps that an observer sees.
pub(super) const STEPS: u64 = 1000;

/// Observer that reports a fixed progress step (the second field, of [`STEPS`]) and passes on
/// requests to stop.
pub(super) struct StopPoll<'a>(pub &'a mut dyn RenderObserver, pub u64);

impl RenderObserver for StopPoll<'_> {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.0.progress(self.1, STEPS)
    }

    fn should_continue(&self) -> bool {
        self.0.should_continue()
    }
}

/// Time that a running pass may still take after a request to stop.
const GRACE_PERIOD: Duration = Duration::from_secs(5);

/// Observer that abandons a running pass if it takes too long after a request to stop, and there is
/// an image without it.
pub(super) struct GracePeriodObserver<'a, F> {
    observer: &'a mut dyn RenderObserver,
    /// Progress step that the observer sees during the pass, of [`STEPS`].
    step: u64,
    /// Time of the first request to stop.
    stop_requested: &'a mut Option<Instant>,
    /// Returns whether an image exists without the running pass.
    has_any: F,
    /// True if this observer abandoned the pass.
    abandoned: bool,
}

impl<'a, F: Fn() -> bool> GracePeriodObserver<'a, F> {
    pub fn new(
        observer: &'a mut dyn RenderObserver,
        step: u64,
        stop_requested: &'a mut Option<Instant>,
        has_any: F,
    ) -> Self {
        Self { observer, step, stop_requested, has_any, abandoned: false }
    }

    /// Returns the result of the pass, or `None` if this observer abandoned it.
    pub fn unless_abandoned<T>(&self, taken: Result<T, Error>) -> Result<Option<T>, Error> {
        match taken {
            Err(Error::Cancelled) if self.abandoned => Ok(None),
            taken => taken.map(Some),
        }
    }
}

impl<F: Fn() -> bool> RenderObserver for GracePeriodObserver<'_, F> {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        if !self.observer.should_continue() {
            let requested = *self.stop_requested.get_or_insert_with(Instant::now);
            if requested.elapsed() > GRACE_PERIOD && (self.has_any)() {
                self.abandoned = true;
                return ControlFlow::Break(());
            }
        }
        self.observer.progress(self.step, STEPS)
    }

    fn should_continue(&self) -> bool {
        self.observer.should_continue()
    }
}
