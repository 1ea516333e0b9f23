//! Pipeline of chunks: the host adds one to the film while the device renders the next.

use super::chunk::{ChunkResult, ChunkTiming};
use super::chunk_buffers::ChunkSums;
use super::{Renderer, Settings};
use crate::Error;
use crate::film::RowSet;
use std::ops::{ControlFlow, Range};
use std::thread::ScopedJoinHandle;
use std::time::Duration;
use trisect_device::DeviceKind;
use trisect_kernels::EntryPoint;
use trisect_system::threads::refused;
use web_time::Instant;

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
#[derive(Clone, Copy)]
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

impl<'a> ChunkJob<'a> {
    /// Returns the seed and the samples of each chunk, in order.
    fn chunks(&self) -> impl Iterator<Item = (u32, &'a Range<u32>)> + use<'a> {
        let (samples, seeds) = (self.samples, self.seeds);
        samples.iter().flat_map(move |samples| seeds.iter().map(move |&seed| (seed, samples)))
    }
}

/// A job that runs: its chunks so far.
struct Run<'a> {
    job: ChunkJob<'a>,
    kernel: EntryPoint,
    /// Samples of the chunks so far.
    samples: u64,
    times: PipelineTiming,
}

impl Run<'_> {
    /// Renders a chunk. `watch` gets the number of samples of the whole job so far.
    fn chunk(
        &mut self,
        renderer: &mut Renderer,
        (seed, samples): (u32, &Range<u32>),
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
    ) -> Result<ChunkTiming, Error> {
        let ChunkJob { settings, rows, .. } = self.job;
        let before = self.samples;
        let mut watch = |done| watch(before + done);
        let settings = Settings { seed, ..settings.clone() };
        let took = renderer.run_chunk(&settings, self.kernel, rows, samples.clone(), &mut watch)?;
        self.samples += u64::from(settings.width) * u64::from(rows.len()) * samples.len() as u64;
        self.times.device += took.device;
        self.times.read += took.read;
        self.times.waited += took.read;
        self.times.submissions += took.submissions;
        Ok(took)
    }
}

/// State of the consumer of chunks, with its memory for one chunk.
type Consumer<T> = (T, ChunkSums);

/// Minimum number of chunks for which pinned memory, to which the device copies directly, saves
/// more time than pinning takes (docs/notebook/denoising.md).
pub(super) const MIN_PINNED_CHUNKS: usize = 4;

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
        let kernel = self.ready_for(parts.settings, parts.rows, parts.samples)?;
        Ok(self.for_each_prepared_chunk(parts, kernel, watch, state, take)?.0)
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
        kernel: EntryPoint,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        state: T,
        take: &(impl Fn(&mut T, &Range<u32>, &ChunkResult<'_>) -> Result<(), Error> + Sync),
    ) -> Result<(T, PipelineTiming), Error> {
        let mut run = Run { job: *parts, kernel, samples: 0, times: PipelineTiming::default() };
        let count = parts.samples.len() * parts.seeds.len();
        let state = match count < 2 || self.device().info().kind != DeviceKind::Gpu {
            true => self.chunks_in_turn(&mut run, watch, state, take)?,
            false => self.chunks_overlapped(&mut run, watch, state, take)?,
        };
        Ok((state, run.times))
    }

    /// Renders the chunks, each of which `take` gets before the next is rendered.
    fn chunks_in_turn<T>(
        &mut self,
        run: &mut Run<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        mut state: T,
        take: &impl Fn(&mut T, &Range<u32>, &ChunkResult<'_>) -> Result<(), Error>,
    ) -> Result<T, Error> {
        let job = run.job;
        for (seed, samples) in job.chunks().take_while(|_| (job.should_continue)()) {
            let ChunkTiming { device, submissions, .. } = run.chunk(self, (seed, samples), watch)?;
            let start = Instant::now();
            let ChunkSums { pixels, aovs } = &self.pipeline.current;
            take(&mut state, samples, &ChunkResult { pixels, aovs, seed, device, submissions })?;
            run.times.waited += start.elapsed();
        }
        Ok(state)
    }

    /// Renders the chunks, each of which `take` gets on another thread while the next is rendered.
    fn chunks_overlapped<T: Send>(
        &mut self,
        run: &mut Run<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        state: T,
        take: &(impl Fn(&mut T, &Range<u32>, &ChunkResult<'_>) -> Result<(), Error> + Sync),
    ) -> Result<T, Error> {
        let job = run.job;
        if job.samples.len() * job.seeds.len() >= MIN_PINNED_CHUNKS {
            let pixels = job.settings.width as usize * job.rows.len() as usize;
            self.pin_chunks(pixels, job.settings.guides);
        }
        std::thread::scope(|scope| {
            let mut held = ConsumerState::Idle((state, std::mem::take(&mut self.pipeline.spare)));
            for (seed, samples) in job.chunks().take_while(|_| (job.should_continue)()) {
                let ChunkTiming { device, submissions, .. } = run.chunk(self, (seed, samples), watch)?;
                let start = Instant::now();
                let (mut state, free) = held.wait()?;
                let chunk = std::mem::replace(&mut self.pipeline.current, free);
                let work = move || {
                    let ChunkSums { pixels, aovs } = &chunk;
                    take(&mut state, samples, &ChunkResult { pixels, aovs, seed, device, submissions })?;
                    Ok((state, chunk))
                };
                let thread = std::thread::Builder::new().spawn_scoped(scope, work);
                held = ConsumerState::Running(
                    thread.map_err(|error| refused(1, "thread that adds samples", &error))?,
                );
                run.times.waited += start.elapsed();
            }
            let start = Instant::now();
            let (state, free) = held.wait()?;
            self.pipeline.spare = std::mem::replace(&mut self.pipeline.current, free);
            run.times.waited += start.elapsed();
            Ok(state)
        })
    }

    /// Pins memory for two chunks of `pixels` pixels, if the device is a GPU.
    pub fn pin_chunks(&mut self, pixels: usize, with_aovs: bool) {
        self.pipeline.pin(self.uploaded.device_mut(), pixels, with_aovs);
    }
}
