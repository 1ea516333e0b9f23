//! Rendering of both halves of an image: the same number of samples for all pixels, or a number for
//! each tile.

use super::dual_buffers::both;
use super::grace_period::{GracePeriodObserver, STEPS};
use super::noise_map::NoiseMap;
use super::{DualBuffers, GoalProgress, Noise, SamplingError, allocate};
use crate::Error;
use crate::film::{Film, RowSet};
use crate::render::{ChunkJob, ChunkResult, ChunkTiming, RenderObserver, Renderer, Room};
use crate::render::{Sampler, Settings, TileSamples};
use std::cell::Cell;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use trisect_image::Image;
use trisect_shared::film::CHUNK_SAMPLES;
use web_time::Instant;

/// Mask of the seed for the second half.
const OTHER_SEED: u32 = 0x9e37_79b9;

/// Totals over all samples taken.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RenderTotals {
    pub device: Duration,
    pub submissions: u64,
}

impl RenderTotals {
    fn add(&mut self, took: &ChunkTiming) {
        self.device += took.device;
        self.submissions += took.submissions;
    }
}

/// Renderer of both halves of an image, with the samples taken so far.
pub(super) struct AdaptiveRenderer<'a> {
    pub inner: &'a mut Renderer,
    pub settings: Settings,
    pub halves: DualBuffers,
    /// Film for the totals of halves on the device, and its memory.
    film: (Film, Room),
    pub totals: RenderTotals,
    /// Index of the next sample of either half.
    pub next: u32,
    /// Number of passes with a sample count for each tile.
    tile_passes: u32,
    observer: &'a mut dyn RenderObserver,
    /// Time of the first request to stop.
    ending: Option<Instant>,
    /// Progress of the image, from 0 to 1.
    pub progress: f64,
}

/// Returns the settings of a half. The number of samples is only known at the end.
pub(super) fn of_half(settings: &Settings, half: usize) -> Settings {
    let seed = settings.seed ^ if half == 0 { 0 } else { OTHER_SEED };
    Settings { seed, samples: u32::MAX, ..settings.clone() }
}

impl<'a> AdaptiveRenderer<'a> {
    pub fn new(
        renderer: &'a mut Renderer,
        settings: &Settings,
        observer: &'a mut dyn RenderObserver,
    ) -> Result<Self, Error> {
        let mut halves;
        if renderer.begin_halves(&of_half(settings, 0))? {
            halves = DualBuffers::on_device(settings.width, settings.height);
        } else {
            halves = DualBuffers::new(settings.width, settings.height);
            if settings.guides {
                halves.allocate_aovs();
            }
        }
        let mut made = Self::with(renderer, settings, halves, observer);
        made.prepare_film();
        Ok(made)
    }

    /// Starts preparing memory for the film of halves on the device.
    pub fn prepare_film(&mut self) {
        if self.halves.is_on_device() {
            self.film.1 = Room::prepare(&self.film.0, None);
        }
    }

    /// Creates the renderer with memory that was allocated before.
    pub fn with(
        renderer: &'a mut Renderer,
        settings: &Settings,
        halves: DualBuffers,
        observer: &'a mut dyn RenderObserver,
    ) -> Self {
        let settings = settings.clone();
        let film = Film::new(settings.width, settings.height);
        Self {
            inner: renderer,
            settings,
            halves,
            film: (film, Room::default()),
            totals: RenderTotals::default(),
            next: 0,
            tile_passes: 0,
            observer,
            ending: None,
            progress: 0.0,
        }
    }

    /// Returns whether the noise follows from the difference of the halves, because the samples
    /// within a half are not independent.
    pub fn variance_from_halves(&self) -> bool {
        self.settings.sampler == Sampler::Sobol
    }

    /// Measures the noise of tiles.
    pub fn noise_map(&mut self) -> Result<NoiseMap, Error> {
        let from_halves = self.variance_from_halves();
        if !self.halves.is_on_device() {
            return Ok(NoiseMap::new(&self.halves, from_halves));
        }
        let noise = self.inner.noise_of_halves(from_halves, false)?;
        Ok(NoiseMap::measured(&noise, self.halves.tiles()))
    }

    /// Measures the noise of tiles and of the image.
    pub fn noise(&mut self) -> Result<(NoiseMap, Noise), Error> {
        let from_halves = self.variance_from_halves();
        if !self.halves.is_on_device() {
            return Ok((NoiseMap::new(&self.halves, from_halves), Noise::of(&self.halves, from_halves)));
        }
        let (noise, tiles) = (self.inner.noise_of_halves(from_halves, true)?, self.halves.tiles());
        Ok((NoiseMap::measured(&noise, tiles), Noise::measured(&noise, tiles)))
    }

    /// Returns the image, the mean of both halves.
    pub fn image(&mut self) -> Result<Image, Error> {
        if !self.halves.is_on_device() {
            return Ok(self.halves.image());
        }
        self.inner.image_of_halves(self.halves.tiles())
    }

    /// Returns the film of both halves, as [`DualBuffers::film`] combines them.
    pub fn film(&mut self) -> Result<Film, Error> {
        if !self.halves.is_on_device() {
            return Ok(self.halves.film());
        }
        let (film, room) = &mut self.film;
        room.furnish(film);
        let mut film = std::mem::replace(film, Film::new(0, 0));
        self.inner.film_of_halves(&mut film, both)?;
        Ok(film)
    }

    /// Returns the mean samples per pixel, over both halves together.
    pub fn mean_samples(&self) -> f64 {
        self.halves.samples() as f64 / self.settings.pixels() as f64
    }

    fn progress_step(&self) -> u64 {
        (self.progress.clamp(0.0, 0.999) * STEPS as f64) as u64
    }

    /// Tells the observer what the image has reached: an error, of a requested one, and the seconds
    /// until the goal.
    pub fn report(&mut self, error: f64, target: Option<f64>, seconds: f64) {
        let left = Duration::try_from_secs_f64(seconds).ok();
        self.observer.goal_progress(GoalProgress { error, target, left });
    }

    fn check(&mut self) -> Result<(), Error> {
        let at = self.progress_step();
        match self.observer.progress(at, STEPS).is_break() {
            true => Err(Error::Cancelled),
            false => Ok(()),
        }
    }

    /// Returns whether the image should get more samples.
    pub fn should_continue(&self) -> bool {
        self.observer.should_continue()
    }

    pub fn finish(&mut self) {
        let _ = self.observer.progress(STEPS, STEPS);
    }

    /// Continues without AOV sums.
    pub fn drop_aovs(&mut self) {
        self.settings.guides = false;
        self.halves.drop_aovs();
    }

    /// Returns the index of the sample after `samples` more.
    fn after(&self, samples: u32) -> Result<u32, SamplingError> {
        self.next.checked_add(samples).ok_or(SamplingError::TooMany)
    }

    /// Takes `samples` more of each pixel for each half, or fewer whole chunks if the observer ends
    /// the render. Returns the number of chunks.
    pub fn render_uniform(&mut self, samples: u32) -> Result<u32, Error> {
        self.check()?;
        let end = self.after(samples)?;
        let chunks: Vec<Range<u32>> = crate::render::chunks(self.next..end).collect();
        let rows = RowSet::from(0..self.settings.height);
        let settings = of_half(&self.settings, 0);
        let seeds = [settings.seed, of_half(&self.settings, 1).seed];
        let taken = AtomicUsize::new(0);
        let take = |(halves, took): &mut (&mut DualBuffers, &mut RenderTotals),
                    range: &Range<u32>,
                    sums: &ChunkResult<'_>| {
            let (half, count) = (usize::from(sums.seed != seeds[0]), range.len() as u32);
            halves.add(half, sums.pixels, count);
            if settings.guides {
                halves.add_aovs(half, sums.aovs, count);
            }
            took.device += sums.device;
            took.submissions += sums.submissions;
            taken.fetch_add(1, Ordering::Release);
            Ok(())
        };
        // An image exists once both halves have a chunk.
        let has_any = self.halves.samples() > 0;
        let at = self.progress_step();
        let mut patient = GracePeriodObserver::new(self.observer, at, &mut self.ending, || {
            has_any || taken.load(Ordering::Acquire) >= seeds.len()
        });
        let (ends, begun) = (Cell::new(false), Cell::new(0));
        let mut watch = |_| {
            let flow = patient.progress(0, 0);
            ends.set(!patient.should_continue());
            flow
        };
        let goes_on = || {
            let before: usize = begun.replace(begun.get() + 1);
            before < 2 || before % 2 == 1 || !ends.get()
        };
        let parts = ChunkJob {
            settings: &settings,
            rows: &rows,
            samples: &chunks,
            seeds: &seeds,
            should_continue: &goes_on,
        };
        let done = if self.halves.is_on_device() {
            let (halves, totals) = (&mut self.halves, &mut self.totals);
            self.inner.add_chunks_to_halves(&parts, &mut watch, &mut |half, samples, took| {
                halves.take(half, samples.len() as u32);
                totals.add(took);
                taken.fetch_add(1, Ordering::Release);
            })
        } else {
            let state = (&mut self.halves, &mut self.totals);
            self.inner.for_each_chunk(&parts, &mut watch, state, &take).map(|_| ())
        };
        patient.unless_abandoned(done)?;
        let taken = taken.into_inner();
        // The last chunk may be that of one half only.
        let chunks = &chunks[..taken.div_ceil(2).min(chunks.len())];
        self.next = chunks.last().map_or(self.next, |last| last.end);
        Ok(chunks.len() as u32)
    }

    /// Takes these numbers of samples of each tile's pixels, rounded stochastically. Returns the
    /// number of launches for each half.
    pub fn render_per_tile(&mut self, counts: [&[f64]; 2]) -> Result<u32, Error> {
        self.tile_passes += 1;
        let seed = self.settings.seed;
        let mut left = [0, 1].map(|half| {
            allocate::round_stochastically(counts[half], seed, 2 * self.tile_passes + half as u32)
        });
        let tiles = self.halves.tiles().clone();
        let mut launches = 0;
        loop {
            let most = left.iter().flatten().copied().max().unwrap_or(0).min(CHUNK_SAMPLES);
            let has_any = launches > 0 || self.halves.samples() > 0;
            if most == 0 || has_any && !self.should_continue() {
                return Ok(launches);
            }
            launches += 1;
            let end = self.after(most)?;
            for (half, left) in left.iter_mut().enumerate() {
                let now: Vec<u32> = left.iter().map(|&left| left.min(most)).collect();
                if now.iter().all(|&count| count == 0) {
                    continue;
                }
                self.check()?;
                let at = self.progress_step();
                let own = TileSamples { tiles: &tiles, counts: &now, end };
                let settings = of_half(&self.settings, half);
                let mut patient = GracePeriodObserver::new(self.observer, at, &mut self.ending, || has_any);
                let took = if self.halves.is_on_device() {
                    let mut watch = |done, total| patient.progress(done, total);
                    let took = self.inner.add_tiles_to_half(&settings, &own, half, &mut watch);
                    took.inspect(|_| self.halves.take_tiles(half, &now))
                } else {
                    self.inner.render_tile_samples(&settings, &own, &mut patient).map(|sums| {
                        self.halves.add_tile_samples(half, sums.pixels, &now);
                        if settings.guides {
                            self.halves.add_tile_aovs(half, sums.aovs, &now);
                        }
                        ChunkTiming {
                            device: sums.device,
                            submissions: sums.submissions,
                            ..Default::default()
                        }
                    })
                };
                let Some(took) = patient.unless_abandoned(took)? else {
                    // The other half may have taken its samples.
                    self.next = end;
                    return Ok(launches);
                };
                self.totals.add(&took);
                left.iter_mut().zip(&now).for_each(|(left, now)| *left -= now);
            }
            self.next = end;
        }
    }
}
