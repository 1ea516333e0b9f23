//! Commands that a device started and that may still run.

use std::any::Any;
use std::fmt;
use std::time::Duration;

/// Commands that [`Device::start`](crate::Device::start) started. They also run if this is dropped.
pub struct Started(State);

/// State of the commands.
enum State {
    /// They have ended; the time of each launch.
    Ended(Vec<Duration>),
    /// They run; what the device needs to wait for them.
    Running(Box<dyn Any + Send>),
}

impl Started {
    /// Returns commands that have ended, with the time of each launch.
    pub(crate) fn ended(times: Vec<Duration>) -> Self {
        Self(State::Ended(times))
    }

    /// Returns commands that run, with what a device needs to wait for them.
    pub(crate) fn running(on_device: impl Any + Send) -> Self {
        Self(State::Running(Box::new(on_device)))
    }

    /// Returns whether the device ran them before it returned.
    pub fn has_ended(&self) -> bool {
        matches!(self.0, State::Ended(_))
    }

    /// Returns the time of each launch of commands that have ended; else the commands.
    pub(crate) fn times(self) -> Result<Vec<Duration>, Self> {
        match self.0 {
            State::Ended(times) => Ok(times),
            State::Running(_) => Err(self),
        }
    }

    /// Returns what the device that started them needs to wait for them; else the commands.
    pub(crate) fn on_device<T: 'static>(self) -> Result<T, Self> {
        match self.0 {
            State::Running(running) => {
                running.downcast().map(|own| *own).map_err(|other| Self(State::Running(other)))
            }
            State::Ended(_) => Err(self),
        }
    }
}

impl fmt::Debug for Started {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match &self.0 {
            State::Ended(_) => "Started(ended)",
            State::Running(_) => "Started(running)",
        })
    }
}
