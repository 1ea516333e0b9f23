//! Rendering of a scene on a device.
//!
//! A [`Renderer`] divides the work into chunks and submissions, launches the kernels, and merges
//! the chunks into a [`Film`] or shows them on a display. [`Settings`] say what to render.

mod adding_speed;
mod boundaries;
mod build;
mod chunk;
mod chunk_buffers;
mod chunk_pipeline;
mod chunk_sum;
mod denoise;
mod fallback;
mod film_observer;
mod film_state;
mod fingerprint;
mod frame;
mod half_sums;
mod interactive;
mod kernel_selection;
mod launch_scene;
mod live_session;
mod prepared_scene;
mod resume;
mod scene_params;
mod scene_tree;
mod shutter;
mod started_frame;
mod submission_queue;
mod submissions;
mod summation;
mod tile_entry_cache;
mod tile_samples;
mod update;

pub use crate::film::{SampleBlock, Summation};
pub use crate::passes::WrittenArray;
pub use crate::settings::{Crop, KernelFeatures, MAX_DEPTH, Sampler, Settings, SettingsError};
pub(crate) use chunk::ChunkTiming;
pub use chunk::{ChunkResult, chunks};
pub use chunk_sum::ChunkSum;
pub use fallback::{DeviceFallback, FallbackFactory};
pub use film_observer::FilmObserver;
pub use fingerprint::Fingerprint;
pub use frame::DisplayTiming;
pub(crate) use half_sums::mean_of_halves;
pub use interactive::{DisplayOptions, LiveFrame};
pub use trisect_device::{MathMode, Schedule, Traversal};
pub use trisect_scene::Fresnel;

use crate::Error;
use crate::bvh::TreeOnHost;
use crate::film::{Film, HostRecords, Totals};
use crate::passes::{DeviceScene, FilmDesc};
use crate::stats::{GoalProgress, Phases, RenderStats};
use chunk_buffers::{ChunkPipeline, ChunkSums};
pub use chunk_pipeline::{ChunkJob, PipelineTiming};
use film_state::FilmState;
use launch_scene::LaunchScene;
pub use live_session::{MAX_ACCUMULATED_SAMPLES, Restart};
pub use prepared_scene::PreparedScene;
pub use resume::{PartSizer, check_film};
pub use scene_tree::{SceneTree, TreeReuse};
pub use shutter::{Moment, Shutter};
pub use started_frame::{ShownFrame, StartedFrame};
use std::ops::{ControlFlow, Range};
pub(crate) use summation::Room;
use summation::{BlockResult, FilmBlock};
use tile_entry_cache::TileEntryCache;
pub(crate) use tile_samples::TileSamples;
use trisect_device::Device;
use trisect_image::Image;
use trisect_kernels::EntryPoint;
use trisect_scene::{CameraPose, SceneError};
use trisect_shared::camera::Camera;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::path::FirstHit;
pub use update::SceneReuse;
use web_time::Instant;

/// Observer of a render, which may cancel it.
pub trait RenderObserver {
    /// Receives the number of samples done and the total, after each submission; `Break` cancels
    /// the render.
    fn progress(&mut self, done: u64, total: u64) -> ControlFlow<()>;

    /// Receives what a render with a [goal](crate::adaptive) has reached, before each of its
    /// passes.
    fn goal_progress(&mut self, _: GoalProgress) {}

    /// Returns whether the render continues; called between parts by a render without a fixed
    /// number of samples ([`adaptive`](crate::adaptive)). If false, the render ends with the image
    /// so far.
    fn should_continue(&self) -> bool {
        true
    }
}

/// Observer that does nothing.
impl RenderObserver for () {
    fn progress(&mut self, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// A finished render.
#[derive(Debug)]
pub struct Frame {
    /// Sums over all samples.
    pub film: Film,
    /// Times and counts.
    pub stats: RenderStats,
    /// Denoised image, if [`Settings::denoise`] asks for one.
    pub denoised: Option<Image>,
}

impl Frame {
    /// Returns the image: the denoised one if there is one, else the mean radiance of each pixel.
    pub fn image(&self) -> Image {
        self.denoised.clone().unwrap_or_else(|| self.film.image())
    }
}

/// Scene on a device, ready for any number of frames.
pub struct Renderer {
    scene: LaunchScene,
    /// BVH of the scene, from which that of the next one is made.
    tree: SceneTree,
    uploaded: DeviceScene,
    /// Times of the preparation.
    phases: Phases,
    tile_entries: TileEntryCache,
    pipeline: ChunkPipeline,
    film_state: FilmState,
    /// Film whose memory the next render may use.
    film: Option<Film>,
    /// Place where the last film's chunks added up, and the reason if a device refused them.
    summed: (Summation, Option<String>),
    /// Memory for a denoised image as the device returns it.
    filtered: Vec<FilteredPixel>,
}

impl AsMut<Renderer> for Renderer {
    fn as_mut(&mut self) -> &mut Renderer {
        self
    }
}

impl Renderer {
    /// Sets the size of submissions to about `samples` samples, but at least one for each pixel of
    /// a row; `None` returns to about 50 ms. The film does not depend on it.
    pub fn limit_submissions(&mut self, samples: Option<u64>) {
        self.pipeline.sizer.limit(samples);
    }

    /// Returns the device in use.
    pub fn device(&self) -> &dyn Device {
        self.uploaded.device()
    }

    /// Returns the device itself, for another scene.
    pub fn into_device(mut self) -> Box<dyn Device> {
        self.pipeline.unpin(self.uploaded.device_mut());
        self.uploaded.into_device()
    }

    /// Renders one frame, and denoises it if the settings ask for that.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] for sizes out of range or beyond memory, [`Error::Denoise`] for a filter
    /// whose parameters are or a library that is missing, [`Error::Backend`] if the device fails.
    pub fn render(&mut self, settings: &Settings) -> Result<Frame, Error> {
        self.render_observed(settings, &mut ())
    }

    /// Renders one frame as [`render`](Self::render) does, with an observer.
    ///
    /// # Errors
    ///
    /// The errors of [`render`](Self::render), and [`Error::Cancelled`] if the observer cancels the
    /// render.
    pub fn render_observed(
        &mut self,
        settings: &Settings,
        observer: &mut dyn RenderObserver,
    ) -> Result<Frame, Error> {
        let Some(denoise) = &settings.denoise else {
            return self.render_part(settings, &settings.whole(), observer);
        };
        denoise.check()?;
        // The filter needs AOVs, whether or not the settings ask for them.
        let settings = &Settings { guides: true, ..settings.clone() };
        let mut frame = self.render_part(settings, &settings.whole(), observer)?;
        frame.denoised = Some(self.denoise(&frame.film, settings, denoise)?.0);
        Ok(frame)
    }

    /// Renders some rows and some samples of the frame that `settings` describe, without denoising.
    /// The films of parts that make up the frame, added by [`Film::add`] in any order and grouping,
    /// are the film of the whole: a pixel's chunks are the same everywhere, and the sum over them
    /// is exact. Rows outside the part stay unwritten.
    ///
    /// # Errors
    ///
    /// The errors of [`render`](Self::render); [`SettingsError::NoSuchPart`] for rows and samples
    /// beyond the frame; [`SettingsError::SplitsChunk`] for samples that do not begin and end at
    /// multiples of [`CHUNK_SAMPLES`](trisect_shared::film::CHUNK_SAMPLES) (or at the last sample).
    pub fn render_part(
        &mut self,
        settings: &Settings,
        part: &SampleBlock,
        observer: &mut dyn RenderObserver,
    ) -> Result<Frame, Error> {
        let (kernel, mut stats) = self.begin(settings, 0)?;
        settings.check_part(part)?;
        let start = Instant::now();
        let samples: Vec<Range<u32>> = chunks(part.samples.clone()).collect();
        let mut film = match settings.guides {
            true => Film::with_aovs(settings.width, settings.height),
            false => Film::new(settings.width, settings.height),
        };
        let per_sample = u64::from(settings.width) * part.rows.len() as u64;
        let total = per_sample * part.samples.len() as u64;
        let block = FilmBlock { settings, kernel, rows: &part.rows, chunks: &samples, observer: &() };
        let mut watch = |done: u64| observer.progress(done, total);
        let BlockResult { times, counts } = self.add_block(&mut film, block, &mut watch)?;
        stats.submissions += times.submissions;
        stats.device_seconds += times.device.as_secs_f64();
        (stats.sums, stats.sums_refused) = self.summed();
        let counts = counts.unwrap_or_else(|| film.counts_in(&part.rows));
        stats.finish(counts, start.elapsed(), times.waited, times.read);
        Ok(Frame { film, stats, denoised: None })
    }

    /// Prepares a frame, of whose memory `held` bytes are allocated already. Returns the kernel,
    /// and statistics with the times of the preparation.
    fn begin(&mut self, settings: &Settings, held: u64) -> Result<(EntryPoint, RenderStats), Error> {
        let start = Instant::now();
        let kernel = self.prepare_holding(settings, held)?;
        let mut stats = RenderStats::new(self.device().info(), settings, kernel, self.phases.clone());
        stats.phases.prepare_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        self.tile_entries.update(&mut self.uploaded, &self.scene, settings, kernel, false)?;
        stats.phases.view_seconds = start.elapsed().as_secs_f64();
        stats.tile = self.tile_entries.tile();
        stats.tiles_refused = self.tile_entries.refused().map(str::to_owned);
        Ok((kernel, stats))
    }

    /// Takes a film that is no longer needed. The next render of its size then needs no fresh
    /// memory, whose first touch takes longer than a few samples.
    pub fn recycle(&mut self, film: Film) {
        let Film { pixels, aovs, .. } = film;
        match (pixels, aovs) {
            (Totals::Chunk { sums: pixels, .. }, aovs) => {
                let aovs = if let Totals::Chunk { sums, .. } = aovs { sums } else { HostRecords::default() };
                // What is used twice is used often: pinned memory is read faster.
                self.uploaded.device_mut().pin(pixels.memory());
                self.uploaded.device_mut().pin(aovs.memory());
                self.pipeline.current = ChunkSums { pixels, aovs };
            }
            (pixels, aovs) => self.film = Some(Film { pixels, aovs, ..film }),
        }
    }

    /// Returns whether the memory of the film that is no longer needed is what `film` lacks.
    fn has_memory_for(&self, film: &Film) -> bool {
        let of = |film: &Film| (film.width, film.height, film.pixels.len(), film.aovs.len());
        film.is_empty() && film.bytes() == 0 && self.film.as_ref().is_some_and(|spare| of(spare) == of(film))
    }

    /// Returns the first hit of one sample of each pixel, row-major.
    pub fn first_hits(&mut self, settings: &Settings, sample: u32) -> Result<Vec<FirstHit>, Error> {
        self.prepare(settings)?;
        let mut params = self.scene.launch(settings).params;
        params.rows = settings.height;
        params.first_sample = sample;
        params.end_sample = sample.saturating_add(1);
        let mut hits = vec![<FirstHit as bytemuck::Zeroable>::zeroed(); settings.pixels() as usize];
        self.uploaded.first_hits(&params, &mut hits)?;
        Ok(hits)
    }

    /// Returns the kernel that renders the scene with these settings.
    fn select_kernel(&self, settings: &Settings) -> Result<EntryPoint, Error> {
        let best = |kernel| self.device().best_method(kernel, self.scene.primitives());
        Ok(kernel_selection::choose(self.scene.features(), settings, best, self.uploaded.has_wide())?)
    }

    /// Returns the statistics of a render with these settings, without counts and times of its own.
    ///
    /// # Errors
    ///
    /// [`Error::Settings`] if no kernel has these settings.
    pub fn statistics(&self, settings: &Settings) -> Result<RenderStats, Error> {
        let kernel = self.select_kernel(settings)?;
        let mut stats = RenderStats::new(self.device().info(), settings, kernel, self.phases.clone());
        stats.tile = self.tile_entries.tile();
        stats.tiles_refused = self.tile_entries.refused().map(str::to_owned);
        Ok(stats)
    }

    /// Selects the kernel and makes the device's film.
    fn make_film(&mut self, settings: &Settings) -> Result<EntryPoint, Error> {
        let kernel = self.select_kernel(settings)?;
        self.film_state = FilmState::Unknown;
        // The totals of another film make room.
        self.uploaded.drop_totals();
        let Settings { width, height, math, .. } = *settings;
        self.uploaded.begin_film(FilmDesc { width, height, kernel, math })?;
        Ok(kernel)
    }

    /// Checks the settings and the memory that they need, selects the kernel and makes the
    /// device's film.
    fn prepare(&mut self, settings: &Settings) -> Result<EntryPoint, Error> {
        self.prepare_holding(settings, 0)
    }

    fn prepare_holding(&mut self, settings: &Settings, held: u64) -> Result<EntryPoint, Error> {
        if let Some(kernel) = self.film_state.ready_for(settings) {
            return Ok(kernel);
        }
        settings.check_holding(held)?;
        self.make_film(settings)
    }

    /// Returns the pose of the camera.
    pub fn pose(&self) -> &CameraPose {
        self.scene.pose()
    }

    /// Moves the camera, from the next frame on.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for a pose that is not valid; the camera stays where it was.
    pub fn set_camera(&mut self, pose: CameraPose) -> Result<(), SceneError> {
        if self.scene.set_camera(pose)? {
            self.tile_entries.forget();
        }
        Ok(())
    }

    /// Returns the number of the object that a primitive is part of, from 1 on: spheres, then quads
    /// and discs, in the scene's order, then mesh instances. Returns 0 for `None`.
    pub fn object(&self, primitive: Option<u32>) -> u32 {
        self.scene.object(primitive)
    }

    /// Returns the binary BVH.
    pub(crate) fn tree(&self) -> TreeOnHost<'_> {
        self.scene.tree()
    }

    /// Returns the camera record of the launch parameters.
    pub fn camera(&self, settings: &Settings) -> Camera {
        self.scene.camera(settings)
    }
}
