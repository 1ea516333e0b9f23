//! Content of the film on the device, which decides whether a call continues with it.

use super::Settings;
use super::live_session::LiveSession;
use trisect_kernels::EntryPoint;

/// Content of the film on the device.
#[derive(Default)]
pub(super) enum FilmState {
    /// Nothing that a later call continues with.
    #[default]
    Unknown,
    /// Nothing yet: it is ready for a frame with these settings, by this kernel.
    Empty(Settings, EntryPoint),
    /// A display frame with these settings, by this kernel, which the next frame overwrites.
    Display(Settings, EntryPoint),
    /// Live frames.
    Live(Box<LiveSession>),
}

impl FilmState {
    /// Returns the kernel for which the film is ready, if it is ready for these settings. A ready
    /// film serves any seed and number of samples.
    pub fn ready_for(&self, settings: &Settings) -> Option<EntryPoint> {
        let Self::Empty(ready, kernel) = self else { return None };
        let Settings { seed, samples, .. } = *settings;
        let is_alike = samples > 0 && Settings { seed, samples, ..ready.clone() } == *settings;
        is_alike.then_some(*kernel)
    }

    /// Returns the kernel of the display frame that the film holds, if its settings are these.
    pub fn displayed(&self, settings: &Settings) -> Option<EntryPoint> {
        match self {
            Self::Display(displayed, kernel) if displayed == settings => Some(*kernel),
            _ => None,
        }
    }

    /// Takes the live frames; the film then holds nothing.
    pub fn take_live(&mut self) -> Option<Box<LiveSession>> {
        match std::mem::take(self) {
            Self::Live(session) => Some(session),
            _ => None,
        }
    }
}
