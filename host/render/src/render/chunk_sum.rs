//! Sums over several chunks that add up on the device, for an image that others put together: a
//! rank reads and sends them once.

use super::adding_speed::adding_speed;
use super::chunk_buffers::resize;
use super::film_state::FilmState;
use super::submission_queue::Ended;
use super::{Renderer, Settings, Summation};
use crate::Error;
use crate::film::{FilmCounts, RadianceTotals, RowSet};
use std::ops::{ControlFlow, Range};
use std::time::Duration;
use trisect_device::BackendError;
use trisect_shared::film::CHUNK_SAMPLES;

/// Radiance over the samples of several chunks of some rows.
#[derive(Clone, Debug)]
pub struct ChunkSum<'a> {
    /// Totals of each pixel, row after row, without gaps.
    pub pixels: &'a [RadianceTotals],
    /// Counts over each strip of rows.
    pub counts: Vec<FilmCounts>,
    /// Time by the device's timer.
    pub device: Duration,
    /// Number of launches.
    pub submissions: u64,
}

/// Samples a second of a device that has not rendered yet: about those of the fastest.
const FASTEST: f64 = 1e10;

/// Share of the device's time for a chunk within which the host should add it.
const KEEPS_UP: f64 = 0.5;

/// Returns whether a host that adds so many pixels of a chunk in a second does so while a device of
/// `speed` samples a second renders the next, so that it need not wait.
fn keeps_up(adding: f64, speed: f64) -> bool {
    1.0 / adding <= KEEPS_UP * f64::from(CHUNK_SAMPLES) / speed
}

impl Renderer {
    /// Renders chunks of some rows, which add up on the device, and counts each of `strips`, which
    /// together are the rows. Returns `None`, without rendering, where the host should add them: by
    /// [`Summation::is_by_device`], because it is fast enough to add each while the next is
    /// rendered, or because the device lacks the memory.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk).
    pub fn sum_chunks(
        &mut self,
        settings: &Settings,
        (rows, strips): (&RowSet, &[RowSet]),
        chunks: &[Range<u32>],
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<Option<ChunkSum<'_>>, Error> {
        if !settings.sums.is_by_device(chunks.len(), self.device().info().kind) {
            return Ok(None);
        }
        let speed = self.pipeline.sizer.speed().unwrap_or(FASTEST);
        if settings.sums == Summation::Auto && keeps_up(adding_speed(), speed) {
            return Ok(None);
        }
        let kernel = self.ready_for(settings, rows, chunks)?;
        let begun = self.uploaded.begin_totals().and_then(|()| self.uploaded.begin_counts(strips));
        match begun {
            Err(BackendError::TooLarge { .. }) if settings.sums == Summation::Auto => return Ok(None),
            begun => begun?,
        }
        self.begin_submissions()?;
        for samples in chunks {
            // The device begins the next chunk without waiting for the host.
            self.start_chunk(settings, rows, samples.clone(), watch)?;
            self.uploaded.count_chunk(samples)?;
            self.uploaded.add_chunk(rows, samples)?;
        }
        let Ended { device, submissions, .. } = self.finish_submissions(watch)?;
        let mut counts = self.uploaded.read_counts()?;
        let pixels = &mut self.pipeline.radiance;
        let count = settings.width as usize * rows.len() as usize;
        resize(self.uploaded.device_mut(), pixels, count);
        self.uploaded.read_radiance(rows, pixels)?;
        self.film_state = FilmState::Empty(settings.clone(), kernel);
        let mut first = 0;
        for (strip, counts) in strips.iter().zip(&mut counts) {
            let end = first + settings.width as usize * strip.len() as usize;
            if counts.unwritten > 0 {
                // A pixel that lacks samples of several chunks counts once.
                let own = pixels.get(first..end).unwrap_or_default();
                let is_nan = |pixel: &&RadianceTotals| pixel.radiance[0].value().is_nan();
                counts.unwritten = own.iter().filter(is_nan).count() as u64;
            }
            first = end;
        }
        Ok(Some(ChunkSum { pixels: &self.pipeline.radiance, counts, device, submissions }))
    }
}

#[cfg(test)]
mod tests {
    use super::keeps_up;

    /// A GPU of 10 G samples a second renders a chunk in 26 ns a pixel; of 0.1 G in 2.6 µs.
    #[test]
    fn slow_hosts_leave_chunks_on_the_device() {
        assert!(keeps_up(4e8, 1e10) && !keeps_up(5e7, 1e10));
        assert!(keeps_up(5e7, 1e8) && !keeps_up(3e5, 1e8));
    }
}
