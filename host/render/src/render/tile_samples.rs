//! Launches in which each tile of the image takes its own number of samples, or none. Adaptive
//! sampling uses them.

use super::chunk::{ChunkResult, ChunkTiming};
use super::chunk_buffers::ChunkSums;
use super::film_state::FilmState;
use super::{RenderObserver, Renderer, Settings};
use crate::Error;
use crate::film::Tiles;
use crate::film::{RowSet, TASK};
use rayon::prelude::*;
use std::ops::ControlFlow;
use trisect_kernels::EntryPoint;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;
use trisect_shared::params::{FLAG_END_OF_CHUNK, FLAG_PER_PIXEL_RANGE};

/// Number of samples of each tile. All tiles end at the same index, so that a tile's next samples
/// lie beyond all that were taken before.
pub(crate) struct TileSamples<'a> {
    pub tiles: &'a Tiles,
    /// Number of samples of each tile, at most a chunk.
    pub counts: &'a [u32],
    /// One past the last sample's index.
    pub end: u32,
}

/// Maximum duration of a submission of too few pixels, in units of a normal submission. With fewer
/// pixels the device would idle while those with the most samples finish, so rows are added beyond
/// the normal duration.
const MAX_SUBMISSION_RATIO: u64 = 8;

impl Renderer {
    /// Renders these samples. The records of a pixel that takes none are unspecified.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk), also if no tile takes any sample.
    pub(crate) fn render_tile_samples(
        &mut self,
        settings: &Settings,
        own: &TileSamples,
        observer: &mut dyn RenderObserver,
    ) -> Result<ChunkResult<'_>, Error> {
        let TileSamples { tiles, counts, end } = *own;
        let rows = RowSet::from(0..settings.height);
        let kernel = self.ready_for_tiles(settings, own)?;
        let chunk = &mut self.pipeline.current;
        chunk.resize(self.uploaded.device_mut(), settings.pixels() as usize, settings.guides);
        let first = |pixel: usize| end.saturating_sub(counts[tiles.of_pixel(pixel)]);
        let pixels = chunk.pixels.par_iter_mut().enumerate().with_min_len(TASK);
        pixels.for_each(|(pixel, sums)| *sums = PixelSums { samples: first(pixel), ..PixelSums::UNWRITTEN });
        chunk.aovs.par_iter_mut().with_min_len(TASK).for_each(|guides| *guides = AovSums::UNWRITTEN);
        self.uploaded.write_film(&chunk.pixels, &chunk.aovs)?;
        let ChunkTiming { device, submissions, .. } =
            self.trace_tiles(settings, own, &mut |done, total| observer.progress(done, total))?;
        let ChunkSums { pixels, aovs } = &mut self.pipeline.current;
        self.uploaded.read_film(&rows, pixels, aovs)?;
        self.film_state = FilmState::Empty(settings.clone(), kernel);
        Ok(ChunkResult { pixels, aovs, seed: settings.seed, device, submissions })
    }

    /// Checks these samples, and prepares kernel, film and tile entries for them.
    pub(super) fn ready_for_tiles(
        &mut self,
        settings: &Settings,
        own: &TileSamples<'_>,
    ) -> Result<EntryPoint, Error> {
        let most = own.counts.iter().copied().max().unwrap_or(0);
        let window = own.end.saturating_sub(most)..own.end;
        let rows = RowSet::from(0..settings.height);
        let kernel = self.ready_for(settings, &rows, std::slice::from_ref(&window))?;
        self.film_state = FilmState::Unknown;
        Ok(kernel)
    }

    /// Renders these samples, which the film on the device requests.
    pub(super) fn trace_tiles(
        &mut self,
        settings: &Settings,
        own: &TileSamples<'_>,
        watch: &mut dyn FnMut(u64, u64) -> ControlFlow<()>,
    ) -> Result<ChunkTiming, Error> {
        let TileSamples { tiles, counts, end } = *own;
        let rows = RowSet::from(0..settings.height);
        let (mut took, mut done) = (ChunkTiming::default(), 0);
        // For each row of tiles: the number of samples, and of pixels that take any.
        let taking: Vec<u32> = counts.iter().map(|&count| count.min(1)).collect();
        let of_row: Vec<(u64, u64)> = (0..tiles.down())
            .map(|row| (tiles.samples_of_row(row, counts), tiles.samples_of_row(row, &taking)))
            .collect();
        let total = of_row.iter().map(|row| row.0).sum();
        let mut left: u64 = of_row.iter().map(|row| row.1).sum();
        let mut next = 0;
        while next < of_row.len() {
            // Rows of tiles are added until the submission keeps the device busy for long enough,
            // and until the rows left can do so too.
            let (from, mut samples, mut pixels) = (next, 0, 0);
            while let Some(row) = of_row.get(next) {
                let few = pixels.min(left) < self.pipeline.sizer.pixels();
                let longest =
                    self.pipeline.sizer.budget().saturating_mul(if few { MAX_SUBMISSION_RATIO } else { 1 });
                if samples > 0 && samples + row.0 > longest {
                    break;
                }
                (samples, pixels, left) = (samples + row.0, pixels + row.1, left - row.1);
                next += 1;
            }
            if samples == 0 {
                continue;
            }
            let mut launch = self.scene.launch(settings);
            let params = &mut launch.params;
            self.tile_entries.fill_params(&self.scene, params);
            (params.share_first_row, params.block_shift, params.block_gap) = rows.share();
            let band = tiles.rows(from as u32..next as u32);
            (params.first_row, params.rows) = (band.start, band.len() as u32);
            (params.first_sample, params.end_sample) = (end, end);
            params.flags |= FLAG_PER_PIXEL_RANGE | FLAG_END_OF_CHUNK;
            // The time says little about the device's speed: it depends on the pixels with the most
            // samples.
            let started = self.uploaded.start_render(&launch)?;
            let time = self.uploaded.wait(started)?.into_iter().sum();
            (took.device, took.submissions, done) =
                (took.device + time, took.submissions + 1, done + samples);
            if watch(done, total).is_break() {
                return Err(Error::Cancelled);
            }
        }
        Ok(took)
    }
}
