//! Frames for a display straight from the samples: without AOVs, filters or sums on the host.

use super::film_state::FilmState;
use super::interactive::display_params;
use super::{DisplayOptions, Renderer, Settings};
use crate::Error;
use crate::film::{RowSet, RowTarget};
use crate::passes::DisplayPass;
use std::ops::ControlFlow;
use std::time::Duration;

/// Times of a frame.
#[derive(Clone, Copy, Debug)]
pub struct DisplayTiming {
    /// Name of the kernel that traced it.
    pub kernel: &'static str,
    /// Time of tracing, by the device's timer.
    pub trace: Duration,
    /// Time of the conversion for the display, by the device's timer.
    pub display: Duration,
}

impl Renderer {
    /// Renders these rows of a frame of at most one chunk of samples, and copies them, packed, to
    /// `pixels`: red, green, blue and opacity from the lowest byte on. NaN becomes black.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk).
    pub fn frame(
        &mut self,
        settings: &Settings,
        rows: &RowSet,
        screen: &DisplayOptions,
        pixels: &mut Vec<u32>,
    ) -> Result<DisplayTiming, Error> {
        if self.film_state.displayed(settings).is_none() {
            settings.check()?;
        }
        settings.check_rows(rows, &(0..settings.samples))?;
        self.frame_to(settings, screen, &mut RowTarget::packed(pixels, settings.width, rows))
    }

    /// Renders rows of a frame as [`frame`](Self::frame) does, and copies them to their places in
    /// the target.
    ///
    /// # Errors
    ///
    /// The errors of [`frame`](Self::frame);
    /// [`SettingsError::TooManyLive`](super::SettingsError::TooManyLive) for more samples than a
    /// chunk has; [`Error::Backend`] for a target of another width.
    pub fn frame_to(
        &mut self,
        settings: &Settings,
        screen: &DisplayOptions,
        to: &mut RowTarget<'_>,
    ) -> Result<DisplayTiming, Error> {
        let rows = to.rows().clone();
        settings.check_live()?;
        settings.check_rows(&rows, &(0..settings.samples))?;
        // Each frame writes all pixels of its rows again, so nothing needs to be erased.
        let kernel = match self.film_state.displayed(settings) {
            Some(kernel) => kernel,
            None => self.prepare(settings)?,
        };
        self.film_state = FilmState::Unknown;
        self.tile_entries.update(&mut self.uploaded, &self.scene, settings, kernel, false)?;
        self.begin_submissions()?;
        self.start_chunk(settings, &rows, 0..settings.samples, &mut |_| ControlFlow::Continue(()))?;
        let size = (settings.width, settings.height);
        let first = rows.blocks().next().map_or(0, |block| block.start);
        let params = display_params(size, settings.width, screen.stops, first);
        let shown = DisplayPass { params, image: None, accumulated: false };
        let display = self.uploaded.display(&shown, to.reborrow())?;
        let trace = self.finish_submissions(&mut |_| ControlFlow::Continue(()))?.device;
        self.film_state = FilmState::Display(settings.clone(), kernel);
        Ok(DisplayTiming { kernel: kernel.name, trace, display })
    }
}
