//! Passes of the denoiser and of the display, on CUDA.

use super::driver::{Argument, failed};
use super::{Cuda, not_prepared};
use crate::BackendError;
use crate::RowTarget;
use crate::target::span;
use crate::{DisplayLaunch, Pass};
use cudarc::driver::{CudaEvent, CudaFunction, CudaSlice, LaunchConfig, PushKernelArg};
use std::time::Duration;
use trisect_kernels::{DISPLAY, WORKGROUP, workgroup};
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{FilteredPixel, GBufferTexel, HistoryPixel};
use trisect_shared::display::DisplayParams;
use trisect_shared::film::PixelSums;

/// Buffers between passes, with a record for each pixel.
pub(super) struct Images {
    filtered: [CudaSlice<u8>; 2],
    gbuffer: CudaSlice<u8>,
    temporal: Option<TemporalBuffers>,
}

/// Buffers that frames keep for later ones: history, and sums while the camera rests.
struct TemporalBuffers {
    histories: [CudaSlice<u8>; 2],
    sums: CudaSlice<u8>,
    aovs: CudaSlice<u8>,
}

impl Cuda {
    /// Allocates the buffers for `pixels` pixels.
    fn denoiser_images(&self, pixels: usize) -> Result<Images, BackendError> {
        // Zeroed, because frames of some rows do not write the other rows.
        let lit = || self.zeros(pixels * size_of::<FilteredPixel>(), "the denoised image");
        let edges = self.zeros(pixels * size_of::<GBufferTexel>(), "the G-buffer")?;
        Ok(Images { filtered: [lit()?, lit()?], gbuffer: edges, temporal: None })
    }

    /// Allocates the buffers that are kept from frame to frame, for `pixels` pixels.
    fn denoiser_temporal(&self, pixels: usize) -> Result<TemporalBuffers, BackendError> {
        let bytes = |size: usize| self.zeros(pixels * size, "the denoiser's history");
        let past = size_of::<HistoryPixel>();
        Ok(TemporalBuffers {
            histories: [bytes(past)?, bytes(past)?],
            sums: bytes(size_of::<PixelSums>())?,
            aovs: bytes(size_of::<AovSums>())?,
        })
    }

    /// Runs the passes over a film with as many pixels as `images`. Returns the device time of each
    /// pass.
    fn run_passes(
        &mut self,
        passes: &[Pass],
        film: &mut super::Film,
        images: &mut Images,
    ) -> Result<Vec<Duration>, BackendError> {
        let kernels: Vec<CudaFunction> =
            passes.iter().map(|pass| self.kernel(pass.kernel.name(), self.math)).collect::<Result<_, _>>()?;
        passes.iter().try_for_each(|pass| pass.check_groups("cuda", super::GRID_LIMIT))?;
        let context = self.stream.context();
        let flags = cudarc::driver::sys::CUevent_flags::CU_EVENT_DEFAULT;
        let events: Vec<CudaEvent> = (0..=passes.len())
            .map(|_| context.new_event(Some(flags)).map_err(failed("creating an event")))
            .collect::<Result<_, _>>()?;
        let start = |index: usize| events[index].record(&self.stream).map_err(failed("starting the timer"));
        start(0)?;
        for (index, (pass, kernel)) in passes.iter().zip(&kernels).enumerate() {
            let params = Argument(pass.params);
            let (groups, threads) = (pass.groups(), workgroup(pass.kernel.name()));
            let config = LaunchConfig {
                grid_dim: (groups.0, groups.1, 1),
                block_dim: (threads.0, threads.1, 1),
                shared_mem_bytes: 0,
            };
            let Images { filtered: [first, second], gbuffer: edges, temporal: frames, .. } = &mut *images;
            let (from, to) = if pass.to == 1 { (&*first, second) } else { (&*second, first) };
            let own = (&mut film.sums, &mut film.aovs);
            match frames {
                Some(frames) if pass.kernel.is_temporal() => {
                    let mut arguments = self.stream.launch_builder(kernel);
                    arguments.arg(&params);
                    let [first, second] = &mut frames.histories;
                    let (past, next) = if pass.past == 0 { (&*first, second) } else { (&*second, first) };
                    let kept = (&mut frames.sums, &mut frames.aovs);
                    let (of, other) = if pass.accumulated { (kept, own) } else { (own, kept) };
                    arguments.arg(&*of.0).arg(&*of.1).arg(from).arg(&*edges).arg(past);
                    arguments.arg(to).arg(next).arg(other.0).arg(other.1);
                    // SAFETY: the arguments are those of every temporal pass (see trisect_kernels),
                    // and each has a record for each pixel.
                    unsafe { arguments.launch(config) }.map_err(failed("launching"))?;
                }
                frames => {
                    let mut arguments = self.stream.launch_builder(kernel);
                    arguments.arg(&params);
                    let kept = frames.as_ref().filter(|_| pass.accumulated);
                    let of = kept.map_or((&*own.0, &*own.1), |frames| (&frames.sums, &frames.aovs));
                    arguments.arg(of.0).arg(of.1).arg(from).arg(to).arg(edges);
                    // SAFETY: the arguments are those of every other pass (see trisect_kernels),
                    // and each has a record for each pixel.
                    unsafe { arguments.launch(config) }.map_err(failed("launching"))?;
                }
            }
            start(index + 1)?;
        }
        let Some(last) = events.last() else { return Ok(Vec::new()) };
        last.synchronize().map_err(failed("denoising"))?;
        let between = |pair: &[CudaEvent]| {
            let milliseconds = pair[0].elapsed_ms(&pair[1]).map_err(failed("reading the timer"))?;
            Ok(Duration::from_secs_f64(f64::from(milliseconds.max(0.0)) * 1e-3))
        };
        events.windows(2).map(between).collect()
    }

    /// Implements [`Backend::write_film`](crate::Backend::write_film).
    pub(super) fn write_sums(&mut self, film: &[PixelSums], guides: &[AovSums]) -> Result<(), BackendError> {
        let Some(memory) = &mut self.film else { return Err(not_prepared()) };
        let (sums, guides): (&[u8], &[u8]) = (bytemuck::cast_slice(film), bytemuck::cast_slice(guides));
        if memory.sums.len() != sums.len() || memory.aovs.len() < guides.len() {
            return Err(not_prepared());
        }
        self.stream.memcpy_htod(sums, &mut memory.sums).map_err(failed("writing the film"))?;
        let mut to = memory.aovs.slice_mut(0..guides.len());
        self.stream.memcpy_htod(guides, &mut to).map_err(failed("writing the film"))?;
        self.stream.synchronize().map_err(failed("writing the film"))
    }

    /// Implements [`Backend::denoise`](crate::Backend::denoise).
    pub(super) fn denoise_film(&mut self, passes: &[Pass]) -> Result<Vec<Duration>, BackendError> {
        let Some(mut film) = self.film.take() else { return Err(not_prepared()) };
        let pixels = film.sums.len() / size_of::<PixelSums>();
        let is_image = |pass: &Pass| pass.params.width as usize * pass.params.height as usize == pixels;
        if film.aovs.len() != pixels * size_of::<AovSums>() || !passes.iter().all(is_image) {
            self.film = Some(film);
            return Err(not_prepared());
        }
        let images = match self.denoiser.take() {
            Some(images) if images.filtered[0].len() == pixels * size_of::<FilteredPixel>() => Ok(images),
            other => {
                drop(other); // freed before the new one is allocated
                self.denoiser_images(pixels)
            }
        };
        let times = images.and_then(|mut images| {
            if images.temporal.is_none()
                && passes.iter().any(|pass| pass.accumulated || pass.kernel.is_temporal())
            {
                images.temporal = Some(self.denoiser_temporal(pixels)?);
            }
            let times = self.run_passes(passes, &mut film, &mut images);
            self.denoiser = Some(images);
            times
        });
        self.film = Some(film);
        times
    }

    /// Copies one of the denoiser's two images to `pixels`.
    pub(super) fn read_image(
        &mut self,
        image: usize,
        pixels: &mut [FilteredPixel],
    ) -> Result<(), BackendError> {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(pixels);
        let images = self.denoiser.as_ref().and_then(|images| images.filtered.get(image));
        let Some(image) = images.filter(|image| image.len() == bytes.len()) else {
            return Err(not_prepared());
        };
        self.stream.memcpy_dtoh(image, bytes).map_err(failed("reading the denoised image"))?;
        self.stream.synchronize().map_err(failed("reading the denoised image"))
    }

    /// Implements [`Backend::display`](crate::Backend::display).
    pub(super) fn display_frame(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        let DisplayParams { width, height, .. } = frame.params;
        let count = width as usize * height as usize;
        let kernel = self.kernel(DISPLAY, self.math)?;
        let mut shown = match self.shown.take() {
            Some(shown) if shown.len() == count * 4 => shown,
            other => {
                drop(other); // freed before the new one is allocated
                self.zeros(count * 4, "the display image")?
            }
        };
        let time = self.display_to(frame, &kernel, count, &mut shown, to);
        self.shown = Some(shown);
        time
    }

    fn display_to(
        &self,
        frame: &DisplayLaunch,
        kernel: &CudaFunction,
        count: usize,
        shown: &mut CudaSlice<u8>,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        let Some(film) = &self.film else { return Err(not_prepared()) };
        let images = self.denoiser.as_ref();
        let kept = images.and_then(|images| images.temporal.as_ref()).filter(|_| frame.accumulated);
        let sums = kept.map_or(&film.sums, |frames| &frames.sums);
        let lit = match frame.image {
            // The kernel loads records from here, and does not use them.
            None => Some(sums),
            Some(image) => images.and_then(|images| images.filtered.get(image)),
        };
        let span = span(frame.params.first_row, to.rows());
        let Some(lit) = lit.filter(|lit| {
            lit.len() >= count * size_of::<FilteredPixel>()
                && sums.len() == count * size_of::<PixelSums>()
                && span.end <= frame.params.height
                && to.width() == frame.params.width as usize
        }) else {
            return Err(not_prepared());
        };
        let groups = (frame.params.width.div_ceil(WORKGROUP.0), (span.len() as u32).div_ceil(WORKGROUP.1));
        let config = LaunchConfig {
            grid_dim: (groups.0, groups.1.max(1), 1),
            block_dim: (WORKGROUP.0, WORKGROUP.1, 1),
            shared_mem_bytes: 0,
        };
        let argument = Argument(frame.params);
        self.start.record(&self.stream).map_err(failed("starting the timer"))?;
        let mut arguments = self.stream.launch_builder(kernel);
        arguments.arg(&argument).arg(sums).arg(lit).arg(&mut *shown);
        // SAFETY: the arguments are the kernel's (see trisect_kernels), and each has at least a
        // record for each pixel.
        unsafe { arguments.launch(config) }.map_err(failed("launching"))?;
        self.end.record(&self.stream).map_err(failed("stopping the timer"))?;
        self.read_target(shown, to)?;
        let milliseconds = self.start.elapsed_ms(&self.end).map_err(failed("reading the timer"))?;
        Ok(Duration::from_secs_f64(f64::from(milliseconds.max(0.0)) * 1e-3))
    }
}
