//! Frames for a display that run on the device while the host prepares the next one.

use super::interactive::StartedLive;
use super::{DisplayOptions, LiveFrame, Renderer, Settings};
use crate::Error;
use crate::denoise::{DenoiseSettings, TemporalSettings};
use crate::film::HostFrame;
use crate::passes::StartedDisplay;
use std::time::Duration;
use web_time::Instant;

/// Frame that the device may still render. It also runs if this is dropped.
pub struct StartedFrame {
    live: StartedLive,
    display: StartedDisplay,
    /// Wall-clock time of starting the display, which is that of the display if it has ended.
    took: Duration,
}

/// Frame in host memory, with its times.
pub struct ShownFrame {
    /// Frame on the device, until the next one is started.
    pub live: LiveFrame,
    /// Time of the conversion for the display, by the device's timer.
    pub display: Duration,
    /// Wall-clock time of the conversion and the copy to the host; where the device returned before
    /// they ended, the time that the host waited for them after the passes.
    pub present: Duration,
    /// Its pixels.
    pub memory: HostFrame,
}

impl StartedFrame {
    /// Returns whether the device rendered it before [`start_frame`](Renderer::start_frame)
    /// returned, as all but CUDA's do.
    pub fn has_ended(&self) -> bool {
        self.display.has_ended()
    }
}

impl Renderer {
    /// Starts a frame as [`live`](Self::live) renders it, its conversion for a display, and its
    /// copy to `memory`. Any number of frames may run; a CUDA device copies one while it renders
    /// the next, if the memory is [pinned](Self::pin).
    ///
    /// # Errors
    ///
    /// The errors of [`live`](Self::live) and [`show_to`](Self::show_to).
    pub fn start_frame(
        &mut self,
        settings: &Settings,
        (denoise, history): (Option<&DenoiseSettings>, Option<&TemporalSettings>),
        screen: &DisplayOptions,
        memory: HostFrame,
    ) -> Result<StartedFrame, Error> {
        let live = self.start_live(settings, denoise, history, &(0..settings.height))?;
        let since = Instant::now();
        let display = self.uploaded.start_display(&live.live.display(screen), memory)?;
        Ok(StartedFrame { live, display, took: since.elapsed() })
    }

    /// Waits for a frame. Frames end in the order in which they were started.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn finish_frame(&mut self, started: StartedFrame) -> Result<ShownFrame, Error> {
        let has_ended = started.has_ended();
        let live = self.finish_live(started.live)?;
        let since = Instant::now();
        let (display, memory) = self.uploaded.end_display(started.display)?;
        let present = if has_ended { started.took } else { since.elapsed() };
        Ok(ShownFrame { live, display, present, memory })
    }
}
