//! Rendering of the samples missing from a film, part by part. After each part an observer may
//! store the film or end the render. Renders with checkpoints and resumed renders use it.

use super::chunk::chunks;
use super::chunk_pipeline::PipelineTiming;
use super::summation::FilmBlock;
use super::{FilmObserver, RenderObserver, Renderer, Settings};
use crate::Error;
use crate::film::{Film, FilmCounts, FilmError, SampleBlock, Summation};
use crate::stats::RenderStats;
use std::ops::Range;
use std::time::Duration;
use trisect_device::DeviceKind;
use trisect_shared::film::CHUNK_SAMPLES;
use web_time::Instant;

/// Target duration in seconds of a part on a CPU, and so the delay after a request to stop.
const PART_SECONDS: f64 = 2.0;

/// Number of samples of the first part, before its speed is known.
const FIRST_PART_SAMPLES: u64 = 1 << 21;

/// Multiple to which the rows of a part are rounded down, unless it has fewer rows: the larger of
/// the default sizes of camera-ray tiles.
const ROW_MULTIPLE: u32 = 16;

/// Sizes parts by the speed of earlier ones.
#[derive(Clone, Debug)]
pub struct PartSizer {
    /// Number of samples of a part.
    pub samples: u64,
}

impl PartSizer {
    /// Returns the size of the first part. On a GPU it is a chunk of the whole frame, because less
    /// work does not fill the device.
    pub fn unknown(kind: DeviceKind, frame: u64) -> Self {
        Self {
            samples: if kind == DeviceKind::Gpu {
                frame * u64::from(CHUNK_SAMPLES)
            } else {
                FIRST_PART_SAMPLES
            },
        }
    }

    /// Returns the number of rows of the next part, of `left` rows.
    fn rows(&self, left: u32, samples_of_row: u64) -> u32 {
        let rows = u32::try_from(self.samples / samples_of_row.max(1)).unwrap_or(u32::MAX).max(1);
        let rows = if rows < ROW_MULTIPLE { rows } else { rows / ROW_MULTIPLE * ROW_MULTIPLE };
        // A small remainder is not left for the end.
        if rows.saturating_add(rows / 2) >= left { left } else { rows }
    }

    /// Adapts the size to a part of `samples` samples that took this time.
    pub fn learn(&mut self, samples: u64, took: Duration) {
        let fits = samples as f64 * PART_SECONDS / took.as_secs_f64().max(1e-6);
        // A part that was much faster or slower was disturbed, or is of another part of the image.
        let (least, most) = (self.samples as f64 / 4.0, self.samples as f64 * 8.0);
        self.samples = fits.clamp(least, most) as u64;
    }
}

impl Renderer {
    /// Renders the samples of the settings' frame that `film` lacks, and adds them. The film that
    /// has all samples is the same whatever it held before, and wherever a render ended: a pixel's
    /// chunks are the same everywhere, and the sums over them are exact.
    ///
    /// On a GPU, or where chunks add up on the device, a part is one chunk of the whole frame; on a
    /// CPU some rows of a chunk. After an error the film has all parts before it, except those that
    /// a failed device still held.
    ///
    /// # Errors
    ///
    /// The errors of [`render_part`](Self::render_part); [`FilmError`] for a film of another size,
    /// or without AOV totals if the settings ask for them.
    pub fn render_missing(
        &mut self,
        film: &mut Film,
        settings: &Settings,
        samples: &Range<u32>,
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
    ) -> Result<RenderStats, Error> {
        settings.check_part(&SampleBlock { rows: 0..settings.height, samples: samples.clone() })?;
        self.render_samples(film, settings, samples, keeper, observer)
    }

    /// Renders as [`render_missing`](Self::render_missing) does, but only the samples of `parts`,
    /// no two of which overlap. No part at all leaves the film as it is.
    ///
    /// # Errors
    ///
    /// The errors of [`render_missing`](Self::render_missing), and [`FilmError::Overlap`] for parts
    /// that overlap.
    pub fn render_parts(
        &mut self,
        film: &mut Film,
        settings: &Settings,
        parts: &[SampleBlock],
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
    ) -> Result<RenderStats, Error> {
        parts.iter().try_for_each(|part| settings.check_part(part))?;
        let missing: Vec<_> = parts.iter().flat_map(|part| film.coverage.missing_in(part)).collect();
        self.render_blocks(film, settings, &missing, keeper, observer)
    }

    /// Renders as [`render_missing`](Self::render_missing) does; the samples may split a chunk.
    pub(crate) fn render_samples(
        &mut self,
        film: &mut Film,
        settings: &Settings,
        samples: &Range<u32>,
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
    ) -> Result<RenderStats, Error> {
        settings.check_samples(samples)?;
        let missing = film.coverage.missing(samples);
        self.render_blocks(film, settings, &missing, keeper, observer)
    }

    /// Renders blocks that the film lacks.
    fn render_blocks(
        &mut self,
        film: &mut Film,
        settings: &Settings,
        missing: &[SampleBlock],
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
    ) -> Result<RenderStats, Error> {
        let (kernel, mut stats) = self.begin(settings, film.bytes())?;
        check_film(film, settings)?;
        let start = Instant::now();
        let was_empty = film.is_empty();
        let before = if was_empty { FilmCounts::default() } else { film.counts() };
        let total = missing.iter().map(SampleBlock::size).sum::<u64>() * u64::from(settings.width);
        let whole_frames = self.device().info().kind == DeviceKind::Gpu || settings.sums == Summation::Device;
        let mut speed = PartSizer::unknown(DeviceKind::Cpu, settings.pixels());
        let (mut done, mut blocks, mut counts) = (0, 0, None);
        let mut took = PipelineTiming::default();
        for part in missing {
            let all: Vec<Range<u32>> = chunks(part.samples.clone()).collect();
            let at_once = if whole_frames { all.len() } else { 1 };
            for chunks in all.chunks(at_once.max(1)) {
                let mut rows = part.rows.start..part.rows.start;
                while rows.end < part.rows.end && keeper.should_continue() {
                    let per_row = u64::from(settings.width)
                        * chunks.iter().map(|chunk| chunk.len() as u64).sum::<u64>();
                    let left = part.rows.end - rows.end;
                    let next = if whole_frames { left } else { speed.rows(left, per_row) };
                    rows = rows.end..rows.end + next;
                    let start = Instant::now();
                    let mut watch = |here: u64| observer.progress(done + here, total);
                    let block = FilmBlock { settings, kernel, rows: &rows, chunks, observer: keeper };
                    let added = self.add_block(film, block, &mut watch)?;
                    speed.learn(per_row * u64::from(next), start.elapsed());
                    done += per_row * u64::from(next);
                    took.add(&added.times);
                    blocks += 1;
                    // The counts of the first block, if it is the film.
                    counts =
                        added.counts.filter(|_| was_empty && blocks == 1 && rows == (0..settings.height));
                }
            }
        }
        stats.submissions = took.submissions;
        stats.device_seconds = took.device.as_secs_f64();
        (stats.sums, stats.sums_refused) = self.summed();
        let counts = counts.unwrap_or_else(|| film.counts());
        stats.finish_from(before, counts, start.elapsed(), (took.waited, took.read));
        Ok(stats)
    }
}

/// Checks that a film has the size and the AOV totals of the settings' frame.
///
/// # Errors
///
/// [`FilmError`] names the difference.
pub fn check_film(film: &Film, settings: &Settings) -> Result<(), FilmError> {
    let (has, of) = ((film.width, film.height), (settings.width, settings.height));
    if has != of || film.pixels.len() as u64 != settings.pixels() {
        return Err(FilmError::Size { film: has, other: of });
    }
    match film.aovs.len() as u64 == if settings.guides { settings.pixels() } else { 0 } {
        true => Ok(()),
        false => Err(FilmError::Aovs),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_take_as_long_as_they_should() {
        let mut speed = PartSizer { samples: 1000 };
        // 10 samples per row.
        assert_eq!(speed.rows(1000, 10), 96);
        assert_eq!(speed.rows(1000, 100), 10);
        assert_eq!(speed.rows(140, 10), 140);
        assert_eq!(speed.rows(7, 10), 7);
        assert_eq!(speed.rows(1000, u64::MAX), 1);
        // The part took 1 s, half the target: twice as many samples fit.
        speed.learn(1000, Duration::from_secs(1));
        assert_eq!(speed.samples, 2000);
        speed.learn(2000, Duration::ZERO);
        assert_eq!(speed.samples, 16_000);
        speed.learn(16_000, Duration::from_secs(3600));
        assert_eq!(speed.samples, 4000);
    }
}
