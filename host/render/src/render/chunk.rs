//! Rendering of one chunk: at most 256 samples of each pixel of some rows, summed on the device and
//! copied to the host. The pipeline, adaptive sampling and the cluster use it.

use super::chunk_buffers::ChunkSums;
use super::film_state::FilmState;
use super::submission_queue::Ended;
use super::submissions::{Submission, Submissions};
use super::{RenderObserver, Renderer, Settings};
use crate::Error;
use crate::film::RowSet;
use std::ops::{ControlFlow, Range};
use std::time::Duration;
use trisect_kernels::EntryPoint;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::{CHUNK_SAMPLES, PixelSums};
use trisect_shared::params::FLAG_END_OF_CHUNK;
use web_time::Instant;

/// Sums over the samples of a chunk of some rows, packed (row after row, without gaps), as the
/// device returned them.
/// [`Film::merge`](crate::film::Film::merge) takes them.
#[derive(Clone, Copy, Debug)]
pub struct ChunkResult<'a> {
    /// Sums of each pixel.
    pub pixels: &'a [PixelSums],
    /// AOV sums of each pixel; empty if the settings ask for none.
    pub aovs: &'a [AovSums],
    /// Random seed of the samples.
    pub seed: u32,
    /// Time by the device's timer.
    pub device: Duration,
    /// Number of launches.
    pub submissions: u64,
}

/// Times of a chunk.
#[derive(Default)]
pub(crate) struct ChunkTiming {
    /// Time of rendering, by the device's timer.
    pub device: Duration,
    /// Time of copying the sums from the device.
    pub read: Duration,
    pub submissions: u64,
}

/// Returns the chunks that a render divides samples into: they end at multiples of
/// [`CHUNK_SAMPLES`] and at the last sample.
pub fn chunks(samples: Range<u32>) -> impl Iterator<Item = Range<u32>> {
    let mut first = samples.start;
    std::iter::from_fn(move || {
        let next = (first / CHUNK_SAMPLES + 1).saturating_mul(CHUNK_SAMPLES).min(samples.end);
        (first < samples.end).then(|| std::mem::replace(&mut first, next)..next)
    })
}

impl Renderer {
    /// Renders samples of some rows, at most a chunk, for a film that the caller merges. The rows
    /// may be those of a share (interleaved blocks of rows), and the samples may begin at any
    /// index; but sums over a range other than those of [`chunks`] are rounded differently from a
    /// render's.
    ///
    /// # Errors
    ///
    /// The errors of [`render_part`](Self::render_part), except that samples may split a chunk;
    /// [`SettingsError::NoSuchPart`](super::SettingsError::NoSuchPart) also for more samples than a
    /// chunk has.
    pub fn render_chunk(
        &mut self,
        settings: &Settings,
        rows: &RowSet,
        samples: Range<u32>,
        observer: &mut dyn RenderObserver,
    ) -> Result<ChunkResult<'_>, Error> {
        let kernel = self.ready_for(settings, rows, std::slice::from_ref(&samples))?;
        let total = u64::from(settings.width) * u64::from(rows.len()) * samples.len() as u64;
        let mut watch = |done: u64| observer.progress(done, total);
        let took = self.run_chunk(settings, kernel, rows, samples, &mut watch)?;
        let ChunkTiming { device, submissions, .. } = took;
        let (pixels, guides) = (&self.pipeline.current.pixels, &self.pipeline.current.aovs);
        Ok(ChunkResult { pixels, aovs: guides, seed: settings.seed, device, submissions })
    }

    /// Checks rows and samples, and prepares kernel, film and tile entries for their chunks.
    pub(super) fn ready_for(
        &mut self,
        settings: &Settings,
        rows: &RowSet,
        samples: &[Range<u32>],
    ) -> Result<EntryPoint, Error> {
        let kernel = self.prepare(settings)?;
        samples.iter().try_for_each(|samples| settings.check_rows(rows, samples))?;
        self.tile_entries.update(&mut self.uploaded, &self.scene, settings, kernel, false)?;
        Ok(kernel)
    }

    /// Renders a chunk and reads it into the current chunk's memory.
    pub(super) fn run_chunk(
        &mut self,
        settings: &Settings,
        kernel: EntryPoint,
        rows: &RowSet,
        samples: Range<u32>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<ChunkTiming, Error> {
        let mut took = self.trace_chunk(settings, rows, samples, watch)?;
        let read = Instant::now();
        self.read_chunk(settings, kernel, rows)?;
        took.read = read.elapsed();
        Ok(took)
    }

    /// Reads the chunk on the device into the current chunk's memory.
    pub(super) fn read_chunk(
        &mut self,
        settings: &Settings,
        kernel: EntryPoint,
        rows: &RowSet,
    ) -> Result<(), Error> {
        let count = settings.width as usize * rows.len() as usize;
        self.pipeline.current.resize(self.uploaded.device_mut(), count, settings.guides);
        let ChunkSums { pixels, aovs } = &mut self.pipeline.current;
        self.uploaded.read_film(rows, pixels, aovs)?;
        self.film_state = FilmState::Empty(settings.clone(), kernel);
        Ok(())
    }

    /// Renders a chunk, which stays on the device.
    pub(super) fn trace_chunk(
        &mut self,
        settings: &Settings,
        rows: &RowSet,
        samples: Range<u32>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<ChunkTiming, Error> {
        self.begin_submissions()?;
        self.start_chunk(settings, rows, samples, watch)?;
        let Ended { device, submissions, .. } = self.finish_submissions(watch)?;
        Ok(ChunkTiming { device, submissions, ..ChunkTiming::default() })
    }

    /// Starts to render a chunk, which stays on the device. `watch` gets the number of samples that
    /// have ended since [`begin_submissions`](Self::begin_submissions).
    pub(super) fn start_chunk(
        &mut self,
        settings: &Settings,
        rows: &RowSet,
        samples: Range<u32>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<(), Error> {
        self.film_state = FilmState::Unknown;
        let count = samples.len() as u32;
        let mut submissions = Submissions::new(settings.width, rows.clone(), count);
        while let Some(submission) = submissions.next(&self.pipeline.sizer) {
            self.submit(settings, submission, samples.start, count)?;
            self.make_room(watch)?;
        }
        Ok(())
    }

    /// Starts one submission of the chunk of `samples` samples that begins at `first_sample`.
    fn submit(
        &mut self,
        settings: &Settings,
        submission: Submission,
        first_sample: u32,
        samples: u32,
    ) -> Result<(), Error> {
        let mut launch = self.scene.launch(settings);
        let params = &mut launch.params;
        self.tile_entries.fill_params(&self.scene, params);
        (params.share_first_row, params.block_shift, params.block_gap) = submission.share;
        params.first_row = submission.first_row;
        params.rows = submission.rows;
        params.first_sample = first_sample + submission.first_sample;
        params.end_sample = params.first_sample + submission.samples;
        params.resume = u32::from(submission.first_sample > 0);
        if submission.first_sample + submission.samples == samples {
            params.flags |= FLAG_END_OF_CHUNK;
        }
        let since = Instant::now();
        let started = self.uploaded.start_render(&launch)?;
        self.pipeline.queue.push(started, submission.samples(settings.width), since);
        Ok(())
    }
}
