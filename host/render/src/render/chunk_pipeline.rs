//! Pipeline of chunks: the host adds one to the film while the device renders the next.

use super::chunk::{ChunkResult, ChunkTiming, resize_records};
use super::{Renderer, Settings};
use crate::Error;
use crate::film::{HostRecords, RowSet};
use std::ops::{ControlFlow, Range};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};
use trisect_device::DeviceKind;
use trisect_kernels::Variant;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;
use trisect_system::threads::refused;

/// Total times of some chunks.
#[derive(Default)]
pub struct PipelineTiming {
    /// Time of rendering, by the device's timer.
    pub device: Duration,
    /// Time of copying from the device.
    pub read: Duration,
    /// Time that the device waited for the host, copying included.
    pub waited: Duration,
    /// Number of kernel launches.
    pub submissions: u64,
}

impl PipelineTiming {
    /// Adds the times of other chunks.
    pub fn add(&mut self, other: &Self) {
        self.device += other.device;
        self.read += other.read;
        self.waited += other.waited;
        self.submissions += other.submissions;
    }
}

/// Samples of some rows, to render chunk by chunk.
pub struct ChunkJob<'a> {
    /// Settings of the frame.
    pub settings: &'a Settings,
    /// Rows to render.
    pub rows: &'a RowSet,
    /// Samples of each chunk.
    pub samples: &'a [Range<u32>],
    /// Seeds with which each chunk is rendered in turn, instead of the settings' own.
    pub seeds: &'a [u32],
    /// Returns whether to render the next chunk; called before each one. If false, the remaining
    /// chunks are not rendered.
    pub should_continue: &'a dyn Fn() -> bool,
}

/// State of the consumer of chunks, with its memory for one chunk.
type Consumer<T> = (T, HostRecords<PixelSums>, HostRecords<AovSums>);

/// Minimum number of chunks for which pinned memory, to which the device copies directly, saves
/// more time than pinning takes (docs/notebook/denoising.md).
const MIN_PINNED_CHUNKS: usize = 4;

/// A consumer, or the thread that it runs on.
enum ConsumerState<'scope, T> {
    Idle(Consumer<T>),
    Running(ScopedJoinHandle<'scope, Result<Consumer<T>, Error>>),
}

impl<T> ConsumerState<'_, T> {
    fn wait(self) -> Result<Consumer<T>, Error> {
        match self {
            Self::Idle(taker) => Ok(taker),
            Self::Running(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        }
    }
}

impl Renderer {
    /// Renders chunks for a film that the caller merges. `take` gets each chunk, in order, with
    /// `state`; on a GPU it runs on another thread while the next chunk is rendered. `watch` gets
    /// the number of samples taken so far, and may cancel the render.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk), and errors of `take`.
    pub fn for_each_chunk<T: Send>(
        &mut self,
        parts: &ChunkJob<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        state: T,
        take: &(impl Fn(&mut T, &Range<u32>, &ChunkResult<'_>) -> Result<(), Error> + Sync),
    ) -> Result<T, Error> {
        let variant = self.ready_for(parts.settings, parts.rows, parts.samples)?;
        Ok(self.for_each_prepared_chunk(parts, variant, watch, state, take)?.0)
    }

    /// Renders chunks as [`for_each_chunk`](Self::for_each_chunk) does, after they were prepared.
    /// Also returns the times.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk), and errors of `take`.
    pub(super) fn for_each_prepared_chunk<T: Send>(
        &mut self,
        parts: &ChunkJob<'_>,
        variant: Variant,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        state: T,
        take: &(impl Fn(&mut T, &Range<u32>, &ChunkResult<'_>) -> Result<(), Error> + Sync),
    ) -> Result<(T, PipelineTiming), Error> {
        let ChunkJob { settings, rows, samples, seeds, should_continue: goes_on } = *parts;
        let per_sample = u64::from(settings.width) * u64::from(rows.len());
        let mut before = 0;
        let mut render = |renderer: &mut Self, all: &mut PipelineTiming, seed: u32, samples: &Range<u32>| {
            let mut watch = |done| watch(before + done);
            let settings = Settings { seed, ..settings.clone() };
            let took = renderer.run_chunk(&settings, variant, rows, samples.clone(), &mut watch)?;
            before += per_sample * samples.len() as u64;
            all.device += took.device;
            all.read += took.read;
            all.waited += took.read;
            all.submissions += took.submissions;
            Ok::<ChunkTiming, Error>(took)
        };
        let mut all = PipelineTiming::default();
        let count = samples.len() * seeds.len();
        let samples = samples.iter().flat_map(|samples| seeds.iter().map(move |&seed| (seed, samples)));
        if count < 2 || self.device().info().kind != DeviceKind::Gpu {
            let mut state = state;
            for (seed, samples) in samples.take_while(|_| goes_on()) {
                let ChunkTiming { device, submissions, .. } = render(self, &mut all, seed, samples)?;
                let start = Instant::now();
                let (pixels, guides) = (&self.chunk[..], &self.aovs[..]);
                take(&mut state, samples, &ChunkResult { pixels, aovs: guides, seed, device, submissions })?;
                all.waited += start.elapsed();
            }
            return Ok((state, all));
        }
        let state = std::thread::scope(|scope| {
            if count >= MIN_PINNED_CHUNKS {
                self.pin_chunks(settings.width as usize * rows.len() as usize, settings.guides);
            }
            let spare = (std::mem::take(&mut self.spare), std::mem::take(&mut self.spare_aovs));
            let mut held = ConsumerState::Idle((state, spare.0, spare.1));
            for (seed, samples) in samples.take_while(|_| goes_on()) {
                let ChunkTiming { device, submissions, .. } = render(self, &mut all, seed, samples)?;
                let start = Instant::now();
                let (mut state, pixels, guides) = held.wait()?;
                let pixels = std::mem::replace(&mut self.chunk, pixels);
                let guides = std::mem::replace(&mut self.aovs, guides);
                let work = move || {
                    let sums = ChunkResult { pixels: &pixels, aovs: &guides, seed, device, submissions };
                    take(&mut state, samples, &sums)?;
                    Ok((state, pixels, guides))
                };
                let thread = std::thread::Builder::new().spawn_scoped(scope, work);
                held = ConsumerState::Running(
                    thread.map_err(|error| refused(1, "thread that adds samples", &error))?,
                );
                all.waited += start.elapsed();
            }
            let start = Instant::now();
            let (state, pixels, guides) = held.wait()?;
            self.spare = std::mem::replace(&mut self.chunk, pixels);
            self.spare_aovs = std::mem::replace(&mut self.aovs, guides);
            all.waited += start.elapsed();
            Ok::<T, Error>(state)
        })?;
        Ok((state, all))
    }

    /// Pins memory for two chunks of `pixels` pixels, if the device is a GPU.
    pub fn pin_chunks(&mut self, pixels: usize, with_guides: bool) {
        if self.device().info().kind != DeviceKind::Gpu {
            return;
        }
        for chunk in [&mut self.chunk, &mut self.spare] {
            resize_records(self.uploaded.device_mut(), chunk, pixels);
            self.uploaded.device_mut().pin(chunk.memory());
        }
        for guides in [&mut self.aovs, &mut self.spare_aovs] {
            if with_guides {
                resize_records(self.uploaded.device_mut(), guides, pixels);
                self.uploaded.device_mut().pin(guides.memory());
            }
        }
    }
}
