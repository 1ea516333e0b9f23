//! How those who watch a render see it, and how long it goes on for them.

use crate::Error;
use crate::render::Observer;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Steps that an observer sees.
pub(super) const STEPS: u64 = 1000;

/// An observer that is asked only whether to stop.
pub(super) struct Ask<'a>(pub &'a mut dyn Observer, pub u64);

impl Observer for Ask<'_> {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        self.0.progress(self.1, STEPS)
    }

    fn goes_on(&self) -> bool {
        self.0.goes_on()
    }
}

/// How long what is being taken is waited for when the image should get no more.
const WAIT: Duration = Duration::from_secs(5);

/// An observer that ends what is being taken where that takes too long, and there is an image without it.
pub(super) struct Patient<'a, F> {
    observer: &'a mut dyn Observer,
    at: u64,
    /// When it was first asked to end.
    asked: &'a mut Option<Instant>,
    has_any: F,
    gave_up: bool,
}

impl<'a, F: Fn() -> bool> Patient<'a, F> {
    pub fn new(observer: &'a mut dyn Observer, at: u64, asked: &'a mut Option<Instant>, has_any: F) -> Self {
        Self { observer, at, asked, has_any, gave_up: false }
    }

    /// What was taken, or nothing if it was this that ended it.
    pub fn or_given_up<T>(&self, taken: Result<T, Error>) -> Result<Option<T>, Error> {
        match taken {
            Err(Error::Cancelled) if self.gave_up => Ok(None),
            taken => taken.map(Some),
        }
    }
}

impl<F: Fn() -> bool> Observer for Patient<'_, F> {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        if !self.observer.goes_on() {
            let asked = *self.asked.get_or_insert_with(Instant::now);
            if asked.elapsed() > WAIT && (self.has_any)() {
                self.gave_up = true;
                return ControlFlow::Break(());
            }
        }
        self.observer.progress(self.at, STEPS)
    }

    fn goes_on(&self) -> bool {
        self.observer.goes_on()
    }
}
