//! Passes of the denoiser, on wgpu.

use super::Wgpu;
use super::adapter::Gpu;
use super::pipeline::Pipelines;
use crate::BackendError;
use crate::MathMode;
use crate::{DisplayLaunch, MAX_PASSES, Pass};
use std::time::{Duration, Instant};
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel};
use trisect_shared::film::PixelSums;
use wgpu::{Buffer, BufferUsages, ComputePassTimestampWrites, QuerySet, QuerySetDescriptor, QueryType};

/// Maximum number of passes in a submission: three before the levels, one after.
const PASSES: u32 = MAX_PASSES;

/// Buffers between passes, and pipelines with a layout of their own.
pub(super) struct Denoiser {
    pipelines: Pipelines,
    /// Launch parameters, a buffer for each pass.
    params: Vec<Buffer>,
    filtered: [Buffer; 2],
    gbuffer: Buffer,
    temporal: Option<TemporalBuffers>,
    /// Buffer through which an image is read.
    staging: Buffer,
    timer: Option<Timer>,
}

/// Buffers that frames keep for later ones, and the pipelines that use them.
struct TemporalBuffers {
    pipelines: Pipelines,
    histories: [Buffer; 2],
    sums: Buffer,
    aovs: Buffer,
}

impl TemporalBuffers {
    /// Allocates the buffers for `pixels` pixels.
    fn new(of: &Wgpu, pixels: u64) -> Result<Self, BackendError> {
        let buffer = |size: usize| {
            let usage = BufferUsages::STORAGE;
            of.buffer(pixels * size as u64, usage, "the denoiser's history")
        };
        Ok(Self {
            pipelines: Pipelines::new(&of.gpu, of.route, 5, 4)?,
            histories: [buffer(size_of::<HistoryPixel>())?, buffer(size_of::<HistoryPixel>())?],
            sums: buffer(size_of::<PixelSums>())?,
            aovs: buffer(size_of::<AovSums>())?,
        })
    }
}

struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    staging: Buffer,
    nanoseconds_per_tick: f64,
}

impl Denoiser {
    /// Allocates the buffers for `pixels` pixels.
    pub fn new(of: &Wgpu, pixels: u64) -> Result<Self, BackendError> {
        let gpu = &of.gpu;
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let bytes = pixels * size_of::<FilteredPixel>() as u64;
        let image = || of.buffer(bytes, storage, "the denoised image");
        let params = || {
            let size = size_of::<DenoiseParams>() as u64;
            of.buffer(size, BufferUsages::UNIFORM | BufferUsages::COPY_DST, "the denoiser's parameters")
        };
        let ticks = u64::from(2 * PASSES) * 8;
        let timer = || -> Result<Timer, BackendError> {
            let resolve = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
            Ok(Timer {
                queries: gpu.device.create_query_set(&QuerySetDescriptor {
                    label: None,
                    ty: QueryType::Timestamp,
                    count: 2 * PASSES,
                }),
                resolved: of.buffer(ticks, resolve, "the denoiser's timer")?,
                staging: of.buffer(ticks, read, "the denoiser's timer")?,
                nanoseconds_per_tick: f64::from(gpu.queue.get_timestamp_period()),
            })
        };
        Ok(Self {
            pipelines: Pipelines::new(gpu, of.route, 3, 2)?,
            params: (0..PASSES).map(|_| params()).collect::<Result<_, _>>()?,
            filtered: [image()?, image()?],
            gbuffer: of.buffer(pixels * size_of::<GBufferTexel>() as u64, storage, "the G-buffer")?,
            temporal: None,
            staging: of.buffer(bytes, read, "the denoised image")?,
            timer: of.timer.is_some().then(timer).transpose()?,
        })
    }

    /// Returns whether the buffers are those for `pixels` pixels.
    pub fn fits(&self, pixels: u64) -> bool {
        self.staging.size() == (pixels * size_of::<FilteredPixel>() as u64).max(super::MIN_BUFFER)
    }

    /// Runs the passes in one submission and waits for them. `own` has this frame's sums and AOV
    /// sums. Returns the device time of each pass; without timestamp queries, the mean wall-clock
    /// time.
    pub fn run(
        &mut self,
        gpu: &Gpu,
        math: MathMode,
        passes: &[Pass],
        own: [&Buffer; 2],
    ) -> Result<Vec<Duration>, BackendError> {
        if passes.len() > PASSES as usize {
            let message = format!("{} passes; the maximum is {PASSES}", passes.len());
            return Err(BackendError::Device { backend: "wgpu", action: "denoising", message });
        }
        let limit = gpu.device.limits().max_compute_workgroups_per_dimension;
        for pass in passes {
            pass.check_groups("wgpu", limit)?;
            let pipelines = match &mut self.temporal {
                Some(frames) if pass.kernel.is_temporal() => &mut frames.pipelines,
                _ => &mut self.pipelines,
            };
            pipelines.compile(gpu, pass.kernel.name(), math)?;
        }
        let start = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for (index, (pass, params)) in (0u32..).zip(passes.iter().zip(&self.params)) {
            gpu.queue.write_buffer(params, 0, bytemuck::bytes_of(&pass.params));
            let [first, second] = &self.filtered;
            let (from, to) = if pass.to == 1 { (first, second) } else { (second, first) };
            let kept = self.temporal.as_ref().map(|frames| [&frames.sums, &frames.aovs]);
            let (film, other) = match kept {
                Some(kept) if pass.accumulated => (kept, own),
                kept => (own, kept.unwrap_or(own)),
            };
            let (pipelines, group) = match &self.temporal {
                Some(frames) if pass.kernel.is_temporal() => {
                    let [first, second] = &frames.histories;
                    let (past, next) = if pass.past == 0 { (first, second) } else { (second, first) };
                    let buffers =
                        [params, film[0], film[1], from, &self.gbuffer, past, to, next, other[0], other[1]];
                    (&frames.pipelines, frames.pipelines.bind(&gpu.device, buffers))
                }
                _ => {
                    let buffers = [params, film[0], film[1], from, to, &self.gbuffer];
                    (&self.pipelines, self.pipelines.bind(&gpu.device, buffers))
                }
            };
            let name = pass.kernel.name();
            let mut recorder = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(name),
                timestamp_writes: self.timer.as_ref().map(|timer| ComputePassTimestampWrites {
                    query_set: &timer.queries,
                    beginning_of_pass_write_index: Some(2 * index),
                    end_of_pass_write_index: Some(2 * index + 1),
                }),
            });
            recorder.set_pipeline(pipelines.get(name, math)?);
            recorder.set_bind_group(0, &group, &[]);
            let groups = pass.groups();
            recorder.dispatch_workgroups(groups.0, groups.1, 1);
        }
        let count = passes.len() as u32;
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2 * count, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.staging, 0, u64::from(2 * count) * 8);
        }
        gpu.queue.submit([encoder.finish()]);
        let Some(timer) = &self.timer else {
            gpu.wait("denoising")?;
            return Ok(vec![start.elapsed() / count.max(1); passes.len()]);
        };
        let mut ticks = vec![0u64; 2 * passes.len()];
        gpu.read(&timer.staging, bytemuck::cast_slice_mut(&mut ticks), "denoising")?;
        let time = |pair: &[u64]| {
            let nanoseconds = pair[1].wrapping_sub(pair[0]) as f64 * timer.nanoseconds_per_tick;
            Duration::from_nanos(nanoseconds as u64)
        };
        Ok(ticks.chunks_exact(2).map(time).collect())
    }

    /// Returns the buffer of the frame's denoised image, and for an accumulated frame that of the
    /// sums over frames. Returns `None` if the frame has no denoised image of `pixels` pixels.
    pub fn shown(&self, frame: &DisplayLaunch, pixels: u64) -> Option<(&Buffer, Option<&Buffer>)> {
        let lit = self.filtered.get(frame.image?).filter(|_| self.fits(pixels))?;
        let kept = self.temporal.as_ref().filter(|_| frame.accumulated);
        Some((lit, kept.map(|frames| &frames.sums)))
    }

    /// Copies one of the two images to `pixels`.
    pub fn read(&self, gpu: &Gpu, image: usize, pixels: &mut [FilteredPixel]) -> Result<(), BackendError> {
        let image = self.filtered.get(image).filter(|_| self.fits(pixels.len() as u64));
        let Some(image) = image else {
            let message = "no pass wrote this image".to_owned();
            return Err(BackendError::Device { backend: "wgpu", action: "denoising", message });
        };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(image, 0, &self.staging, 0, image.size());
        gpu.queue.submit([encoder.finish()]);
        gpu.read(&self.staging, bytemuck::cast_slice_mut(pixels), "reading the denoised image")
    }
}

impl Wgpu {
    /// Implements [`Backend::write_film`](crate::Backend::write_film).
    pub(super) fn write_sums(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError> {
        let Some(mut memory) = self.film.take() else { return Err(self.misuse("no film was prepared")) };
        let (sums, guides): (&[u8], &[u8]) = (bytemuck::cast_slice(film), bytemuck::cast_slice(guides));
        let to = &mut memory.aovs;
        let written = match memory.sums.size() < sums.len() as u64 || to.records.size() < guides.len() as u64
        {
            true => Err(self.misuse("the sums are for an image of another size")),
            false => self
                .write(&mut memory.upload, &memory.sums, sums, "writing the film")
                .and_then(|()| self.write(&mut to.upload, &to.records, guides, "writing the AOV sums")),
        };
        self.film = Some(memory);
        written
    }

    /// Implements [`Backend::denoise`](crate::Backend::denoise).
    pub(super) fn denoise_film(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        let (Some(film), Some(first)) = (&self.film, passes.first()) else {
            return Err(self.misuse("no film was prepared"));
        };
        let pixels = |pass: &Pass| u64::from(pass.params.width) * u64::from(pass.params.height);
        let of_image = pixels(first);
        if film.aovs.records.size() < of_image * size_of::<AovSums>() as u64
            || film.sums.size() < of_image * size_of::<PixelSums>() as u64
            || !passes.iter().all(|pass| pixels(pass) == of_image)
        {
            return Err(self.misuse("the film has no AOV sums, or is of another size"));
        }
        let mut denoiser = match self.denoiser.take() {
            Some(denoiser) if denoiser.fits(of_image) => denoiser,
            other => {
                drop(other); // freed before the new one is allocated
                Denoiser::new(self, of_image)?
            }
        };
        if denoiser.temporal.is_none()
            && passes.iter().any(|pass| pass.accumulated || pass.kernel.is_temporal())
        {
            denoiser.temporal = Some(TemporalBuffers::new(self, of_image)?);
        }
        let times = denoiser.run(&self.gpu, self.math, passes, [&film.sums, &film.aovs.records]);
        self.denoiser = Some(denoiser);
        times
    }
}
