//! Places where chunks add up to a film: on the device, which the host reads once, or on the host,
//! which reads each chunk. The film has the same bits.

use super::chunk::ChunkTiming;
use super::chunk_pipeline::{ChunkJob, MIN_PINNED_CHUNKS, PipelineTiming};
use super::film_state::FilmState;
use super::submission_queue::Ended;
use super::{FilmObserver, Renderer, Settings};
use crate::Error;
use crate::film::{
    AovTotals, Film, FilmCounts, FilmError, OverChunks, PixelTotals, RowSet, SampleBlock, SampleCoverage,
    Summation, Totals,
};
use std::ops::{ControlFlow, Range};
use std::thread::JoinHandle;
use std::time::Duration;
use trisect_device::{BackendError, DeviceKind};
use trisect_kernels::EntryPoint;
use trisect_system::{memory, threads};
use web_time::Instant;

/// Maximum time for which chunks are on a device only. A device that fails takes them with it.
const MAX_UNREAD: Duration = Duration::from_secs(30);

/// Maximum number of bytes of a film that are pinned: as many as a driver pins while the device
/// runs a submission, at about 9 GB/s (docs/notebook/denoising.md).
const MAX_PINNED: u64 = 512 << 20;

/// Block of a film that is rendered, chunk by chunk.
#[derive(Clone, Copy)]
pub(super) struct FilmBlock<'a> {
    pub settings: &'a Settings,
    pub kernel: EntryPoint,
    /// Rows of the image.
    pub rows: &'a Range<u32>,
    /// Samples of each chunk.
    pub chunks: &'a [Range<u32>],
    pub observer: &'a dyn FilmObserver,
}

/// Outcome of rendering a block.
#[derive(Default)]
pub(super) struct BlockResult {
    pub times: PipelineTiming,
    /// Counts of the block's samples, if the device counted them.
    pub counts: Option<FilmCounts>,
}

/// Chunks on a device that the host has not read.
struct Unread {
    chunks: Vec<Range<u32>>,
    since: Instant,
    /// Samples of the film and of these chunks.
    coverage: SampleCoverage,
}

/// Memory for the totals of a film, which another thread prepares: its first touch, or removing the
/// samples of its last use, takes long enough to overlap it with rendering.
#[derive(Default)]
pub(crate) struct Room(Option<JoinHandle<(Totals<PixelTotals>, Totals<AovTotals>)>>);

impl Room {
    /// Starts preparing memory for a film that has none: that of `spare`, a film of its size that
    /// is no longer needed, or fresh memory.
    pub fn prepare(film: &Film, spare: Option<Film>) -> Self {
        let has_memory = film.pixels.bytes() > 0;
        let (mut pixels, mut aovs) = match spare {
            Some(Film { pixels, aovs, .. }) => (pixels, aovs),
            None => (Totals::Empty(film.pixels.len()), Totals::Empty(film.aovs.len())),
        };
        let work = move || {
            for_fresh_samples(&mut pixels);
            for_fresh_samples(&mut aovs);
            (pixels, aovs)
        };
        // Without another thread the film's memory is prepared when it is needed.
        Self(if has_memory { None } else { threads::spawn("film memory", work).ok() })
    }

    /// Returns whether the film's memory is there.
    fn is_ready(&self) -> bool {
        self.0.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Gives the memory to the film, once.
    pub fn furnish(&mut self, film: &mut Film) {
        if let Some(Ok((pixels, aovs))) = self.0.take().map(JoinHandle::join) {
            (film.pixels, film.aovs) = (pixels, aovs);
        }
    }
}

/// Gives totals memory, and removes their samples.
fn for_fresh_samples<T: OverChunks>(totals: &mut Totals<T>) {
    totals.clear();
    totals.exact_mut();
}

impl Renderer {
    /// Takes the memory of the film that is no longer needed, if `film` can use it.
    fn take_spare(&mut self, film: &Film) -> Option<Film> {
        if self.has_memory_for(film) { self.film.take() } else { None }
    }

    /// Returns where the chunks of the last film were added up, and the reason if that is not where
    /// [`Summation::Auto`] would have wanted it.
    pub(crate) fn summed(&self) -> (Summation, Option<String>) {
        self.summed.clone()
    }

    /// Renders a block of a film and adds it. After an error the film has all chunks before it that
    /// the device still gives.
    pub(super) fn add_block(
        &mut self,
        film: &mut Film,
        block: FilmBlock<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<BlockResult, Error> {
        let is_whole = *block.rows == (0..film.height);
        let chunks = block.chunks.len();
        let wanted = block.settings.sums;
        self.summed = (Summation::Host, None);
        if wanted != Summation::Host && chunks == 1 && film.is_empty() && is_whole {
            return self.take_only_chunk(film, block, watch);
        }
        if film.is_empty() && film.bytes() == 0 && !self.has_memory_for(film) {
            self.film = None; // a film of another size makes room
        }
        let wants_device = wanted.is_by_device(chunks, self.device().info().kind);
        // What the device added is read into a film of its own before it is added to this one.
        let films = 2 * block.settings.pixels() * Film::bytes_per_pixel(block.settings.guides);
        let spare = self.film.as_ref().filter(|_| self.has_memory_for(film)).map_or(0, Film::bytes);
        let needed = films.saturating_sub(film.bytes() + spare);
        if wants_device && wanted == Summation::Auto && memory::lacking(needed).is_some() {
            let needed = memory::display(needed);
            self.summed.1 = Some(format!("the host lacks {needed} of memory to read the device's film"));
        } else if wants_device {
            match self.uploaded.begin_totals() {
                Ok(()) => {
                    self.summed = (Summation::Device, None);
                    return self.add_on_device(film, block, watch);
                }
                Err(error @ BackendError::TooLarge { .. }) if wanted == Summation::Auto => {
                    self.summed.1 = Some(error.to_string());
                }
                Err(error) => return Err(error.into()),
            }
        }
        let times = self.add_on_host(film, block, watch)?;
        Ok(BlockResult { times, counts: None })
    }

    /// Renders a film of one chunk, which is the film.
    fn take_only_chunk(
        &mut self,
        film: &mut Film,
        block: FilmBlock<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<BlockResult, Error> {
        let FilmBlock { settings, kernel, rows, observer, .. } = block;
        let (Some(samples), true) = (block.chunks.first(), observer.should_continue()) else {
            return Ok(BlockResult::default());
        };
        let share = RowSet::from(rows.clone());
        let ChunkTiming { device, submissions, .. } =
            self.trace_chunk(settings, &share, samples.clone(), watch)?;
        let start = Instant::now();
        let counts = match self.device().info().kind {
            DeviceKind::Cpu => None,
            DeviceKind::Gpu | DeviceKind::SoftwareGpu => {
                self.uploaded.begin_counts(std::slice::from_ref(&share))?;
                self.uploaded.count_chunk(samples)?;
                self.uploaded.read_counts()?.first().copied()
            }
        };
        let read = Instant::now();
        self.read_chunk(settings, kernel, &share)?;
        let read = read.elapsed();
        let current = &mut self.pipeline.current;
        let (pixels, aovs) = (std::mem::take(&mut current.pixels), std::mem::take(&mut current.aovs));
        *film = Film::of_chunk((film.width, film.height), samples.clone(), pixels, aovs)?;
        observer.part_added(film);
        let times = PipelineTiming { device, read, waited: start.elapsed(), submissions };
        Ok(BlockResult { times, counts })
    }

    /// Renders chunks that add up on the device.
    fn add_on_device(
        &mut self,
        film: &mut Film,
        block: FilmBlock<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<BlockResult, Error> {
        let FilmBlock { settings, kernel, rows, chunks, observer } = block;
        let share = RowSet::from(rows.clone());
        let mut unread =
            Unread { chunks: Vec::new(), since: Instant::now(), coverage: film.coverage.clone() };
        let mut times = PipelineTiming::default();
        let mut room = Room::prepare(film, self.take_spare(film));
        let mut wants_pinned = chunks.len() >= MIN_PINNED_CHUNKS;
        let mut outcome = Ok(());
        self.begin_submissions()?;
        self.uploaded.begin_counts(std::slice::from_ref(&share))?;
        for samples in chunks {
            if !observer.should_continue() {
                break;
            }
            // The device begins the next chunk without waiting for the host.
            outcome = self.start_chunk(settings, &share, samples.clone(), watch);
            if outcome.is_err() {
                break;
            }
            let counted = self.uploaded.count_chunk(samples);
            if let Err(error) = counted.and_then(|()| self.uploaded.add_chunk(&share, samples)) {
                // Nobody knows what the totals hold now.
                unread.chunks.clear();
                outcome = Err(error.into());
                break;
            }
            let part = SampleBlock { rows: rows.clone(), samples: samples.clone() };
            unread.coverage.insert(&part).map_err(FilmError::from)?;
            unread.chunks.push(samples.clone());
            if wants_pinned && room.is_ready() {
                wants_pinned = false;
                room.furnish(film);
                self.pin_film(film);
            }
            if observer.wants_film(&unread.coverage) || unread.since.elapsed() >= MAX_UNREAD {
                outcome = self.finish_submissions(watch).map(|_| ());
                if outcome.is_err() {
                    break;
                }
                let read = Instant::now();
                room.furnish(film);
                self.read_unread(film, rows, &mut unread)?;
                times.read += read.elapsed();
                observer.part_added(film);
                self.uploaded.begin_totals()?;
            }
        }
        let ended = outcome.and_then(|()| self.finish_submissions(watch));
        let start = Instant::now();
        room.furnish(film);
        let is_new = !unread.chunks.is_empty();
        let read = self.read_unread(film, rows, &mut unread);
        times.read += start.elapsed();
        times.waited = times.read;
        Ended { device: times.device, submissions: times.submissions, .. } = ended?;
        read?;
        let counts = self.uploaded.read_counts()?.first().copied().unwrap_or_default();
        if is_new {
            observer.part_added(film);
        }
        self.film_state = FilmState::Empty(settings.clone(), kernel);
        // A pixel may lack samples in several chunks.
        let counts = (counts.unwritten == 0 && counts.samples + counts.rejected > 0).then_some(counts);
        Ok(BlockResult { times, counts })
    }

    /// Pins the memory of a film while the device renders, so that it copies there without threads
    /// that may wake late.
    fn pin_film(&mut self, film: &Film) {
        if film.bytes() <= MAX_PINNED {
            let memory = [film.pixels.memory(), film.aovs.memory()];
            memory.into_iter().flatten().for_each(|memory| self.uploaded.device_mut().pin(memory));
        }
    }

    /// Reads the chunks that add up on the device, and adds them to the film.
    fn read_unread(&mut self, film: &mut Film, rows: &Range<u32>, unread: &mut Unread) -> Result<(), Error> {
        let chunks = std::mem::take(&mut unread.chunks);
        unread.since = Instant::now();
        let (Some(first), Some(last)) = (chunks.first(), chunks.last()) else { return Ok(()) };
        // Chunks of a block follow each other.
        let part = SampleBlock { rows: rows.clone(), samples: first.start..last.end };
        if rows.clone().all(|row| film.coverage.samples(row).is_empty()) {
            let (pixels, aovs) = film.rows_mut(rows)?;
            let read = self.uploaded.read_totals(&RowSet::from(rows.clone()), pixels, aovs);
            if read.is_err() {
                pixels.fill(PixelTotals::EMPTY);
                aovs.fill(AovTotals::EMPTY);
            }
            read?;
            film.coverage.insert(&part).map_err(FilmError::from)?;
            return Ok(());
        }
        let mut more = film.without_samples();
        let (pixels, aovs) = more.rows_mut(rows)?;
        self.uploaded.read_totals(&RowSet::from(rows.clone()), pixels, aovs)?;
        more.coverage.insert(&part).map_err(FilmError::from)?;
        Ok(film.add(&more)?)
    }

    /// Renders chunks that the host adds while the device renders the next.
    fn add_on_host(
        &mut self,
        film: &mut Film,
        block: FilmBlock<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<PipelineTiming, Error> {
        let FilmBlock { settings, kernel, rows, chunks, observer } = block;
        if let Some(mut spare) = self.take_spare(film) {
            spare.clear();
            *film = spare;
        }
        let share = RowSet::from(rows.clone());
        let goes_on = || observer.should_continue();
        let job = ChunkJob {
            settings,
            rows: &share,
            samples: chunks,
            seeds: &[settings.seed],
            should_continue: &goes_on,
        };
        let take = |film: &mut &mut Film, samples: &Range<u32>, sums: &super::ChunkResult<'_>| {
            let part = SampleBlock { rows: rows.clone(), samples: samples.clone() };
            film.merge(&part, sums.pixels)?;
            if settings.guides {
                film.merge_aovs(&part, sums.aovs)?;
            }
            observer.part_added(film);
            Ok(())
        };
        Ok(self.for_each_prepared_chunk(&job, kernel, watch, film, &take)?.1)
    }
}
