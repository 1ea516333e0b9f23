//! Converts live frames for a display, on wgpu: runs the display kernel over the film or the
//! denoised image, and copies 8-bit sRGB pixels to the host.

use super::Wgpu;
use super::pipeline::Pipelines;
use crate::BackendError;
use crate::DisplayLaunch;
use crate::RowTarget;
use crate::target::span;
use std::time::{Duration, Instant};
use trisect_kernels::{DISPLAY, WORKGROUP};
use trisect_shared::display::DisplayParams;
use trisect_shared::film::PixelSums;
use wgpu::{Buffer, BufferUsages, ComputePassDescriptor, ComputePassTimestampWrites};

/// Image for a display, and a pipeline with a layout of its own.
pub(super) struct Display {
    pipelines: Pipelines,
    params: Buffer,
    image: Buffer,
    /// Buffer through which the image is read.
    staging: Buffer,
}

impl Display {
    /// Allocates the buffers for `pixels` pixels.
    fn new(of: &Wgpu, pixels: u64) -> Result<Self, BackendError> {
        let what = "the display image";
        let size = size_of::<DisplayParams>() as u64;
        Ok(Self {
            pipelines: Pipelines::new(&of.gpu, of.route, 2, 1)?,
            params: of.buffer(size, BufferUsages::UNIFORM | BufferUsages::COPY_DST, what)?,
            image: of.buffer(pixels * 4, BufferUsages::STORAGE | BufferUsages::COPY_SRC, what)?,
            staging: of.buffer(pixels * 4, BufferUsages::MAP_READ | BufferUsages::COPY_DST, what)?,
        })
    }
}

impl Wgpu {
    /// Implements [`Backend::display`](crate::Backend::display). Without timestamp queries
    /// it returns the wall time, which includes the copy to the host.
    pub(super) fn display_frame(
        &mut self,
        frame: &DisplayLaunch,
        to: &mut RowTarget<'_>,
    ) -> Result<Duration, BackendError> {
        let DisplayParams { width, height, .. } = frame.params;
        let count = u64::from(width) * u64::from(height);
        let mut display = match self.display.take() {
            Some(display) if display.image.size() == (count * 4).max(super::MIN_BUFFER) => display,
            other => {
                drop(other); // freed before the new one is allocated
                Display::new(self, count)?
            }
        };
        let Some(film) = &self.film else { return Err(self.misuse("no frame was rendered")) };
        let span = span(frame.params.first_row, to.rows());
        let fits = to.width() == width as usize
            && span.end <= height
            && film.sums.size() >= count * size_of::<PixelSums>() as u64;
        let source = match (frame.image, &self.denoiser) {
            // The film stands in for the denoised image: the kernel reads it but shows only means.
            (None, _) => Some((&film.sums, None)),
            (Some(_), Some(denoiser)) => denoiser.shown(frame, count),
            (Some(_), None) => None,
        };
        let Some((denoised, accumulated)) = source.filter(|_| fits) else {
            return Err(self.misuse("no pass wrote this image"));
        };
        display.pipelines.compile(&self.gpu, DISPLAY, self.math)?;
        self.gpu.queue.write_buffer(&display.params, 0, bytemuck::bytes_of(&frame.params));
        let buffers = [&display.params, accumulated.unwrap_or(&film.sums), denoised, &display.image];
        let group = display.pipelines.bind(&self.gpu.device, buffers);
        let start = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
                label: Some(DISPLAY),
                timestamp_writes: self.timer.as_ref().map(|timer| ComputePassTimestampWrites {
                    query_set: &timer.queries,
                    beginning_of_pass_write_index: Some(0),
                    end_of_pass_write_index: Some(1),
                }),
            });
            pass.set_pipeline(display.pipelines.get(DISPLAY, self.math)?);
            pass.set_bind_group(0, &group, &[]);
            let rows = span.len() as u32;
            pass.dispatch_workgroups(width.div_ceil(WORKGROUP.0), rows.div_ceil(WORKGROUP.1), 1);
        }
        let row = u64::from(width) * 4;
        let mut done = 0;
        for block in to.rows().blocks() {
            let (first, length) = (u64::from(block.start) * row, block.len() as u64 * row);
            encoder.copy_buffer_to_buffer(&display.image, first, &display.staging, done, length);
            done += length;
        }
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.staging, 0, 16);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.map(&display.staging, done, "reading the image", |bytes| {
            to.copy_from(bytemuck::cast_slice(bytes))
        })?;
        self.display = Some(display);
        let Some(timer) = &self.timer else { return Ok(start.elapsed()) };
        let mut ticks = [0u64; 2];
        self.gpu.read(&timer.staging, bytemuck::cast_slice_mut(&mut ticks), "reading the image")?;
        let nanoseconds = ticks[1].wrapping_sub(ticks[0]) as f64 * timer.nanoseconds_per_tick;
        Ok(Duration::from_nanos(nanoseconds as u64))
    }
}
