//! Commands as one submission.

use super::memory::Part;
use super::pipeline::PARAMS_STRIDE;
use super::scene_bindings::first_rows;
use super::timer::Timer;
use super::{NAME, STORAGE, Wgpu};
use crate::command::{check_range, check_rows, handle};
use crate::{BackendError, Command, Dispatch, RowTarget};
use std::time::Duration;
use web_time::Instant;
use wgpu::{Buffer, BufferUsages, CommandEncoder, ComputePassDescriptor};

/// Number of launches of most submissions.
pub(super) const LAUNCHES: u32 = 16;

/// Maximum number of bytes of ones, from which larger buffers are filled part by part.
const ONES: u64 = 1 << 24;

/// Host memory, and the buffer through which it is read.
type Readback<'a> = (RowTarget<'a>, Buffer);

impl Wgpu {
    /// Runs commands as one submission, and waits for it. Returns the time of each launch; without
    /// timestamp queries, the mean wall-clock time of the submission's launches.
    pub(super) fn submit(&mut self, commands: Vec<Command<'_>>) -> Result<Vec<Duration>, BackendError> {
        let launches = self.prepare(&commands)?;
        let start = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut reads: Vec<Readback<'_>> = Vec::new();
        let mut launch = 0;
        for command in commands {
            match command {
                Command::Fill { buffer, first, bytes, ones } => {
                    check_range(NAME, buffer, first, bytes)?;
                    let part = handle::<Part>(buffer, NAME)?;
                    let first = part.first + first;
                    if ones {
                        self.fill_with_ones(&mut encoder, &part.buffer, first, bytes);
                    } else if bytes > 0 {
                        encoder.clear_buffer(&part.buffer, first, Some(bytes));
                    }
                }
                Command::Copy { from, to, bytes } => {
                    check_range(NAME, from, 0, bytes)?;
                    check_range(NAME, to, 0, bytes)?;
                    let (from, to) = (handle::<Part>(from, NAME)?, handle::<Part>(to, NAME)?);
                    encoder.copy_buffer_to_buffer(&from.buffer, from.first, &to.buffer, to.first, bytes);
                }
                Command::Dispatch(dispatch) => {
                    self.dispatch(&mut encoder, &dispatch, launch)?;
                    launch += 1;
                }
                Command::Read { from, to } => {
                    check_rows(NAME, from, &to)?;
                    let through = self.copy_rows(&mut encoder, handle(from, NAME)?, &to)?;
                    reads.push((to, through));
                }
            }
        }
        let timer = self.timer.as_ref().filter(|_| launches > 0);
        if let Some(timer) = timer {
            timer.resolve(&mut encoder, launches);
        }
        self.gpu.queue.submit([encoder.finish()]);
        let times = match timer {
            Some(timer) => timer.read(&self.gpu, launches)?,
            None => {
                self.gpu.wait("running commands")?;
                vec![start.elapsed() / launches.max(1); launches as usize]
            }
        };
        for (mut to, through) in reads {
            let bytes = to.row_bytes() as u64 * u64::from(to.rows().len());
            self.gpu.map(&through, bytes, "reading from the device", |bytes| to.copy_from(bytes))?;
            self.readbacks.put([through]);
        }
        Ok(times)
    }

    /// Checks the launches, and makes their parameters, the timer and bytes of ones ready. Returns
    /// the number of launches.
    fn prepare(&mut self, commands: &[Command<'_>]) -> Result<u32, BackendError> {
        let limit = self.gpu.device.limits().max_compute_workgroups_per_dimension;
        let mut params = Vec::new();
        let mut ones = 0;
        for command in commands {
            match command {
                Command::Dispatch(dispatch) => {
                    dispatch.check(NAME)?;
                    dispatch.check_extra(NAME)?;
                    let groups = dispatch.groups();
                    if groups.0.max(groups.1) > limit {
                        return Err(dispatch.too_long(NAME, limit));
                    }
                    self.pipelines.compile(&self.gpu, dispatch.entry_point, dispatch.math)?;
                    params.extend_from_slice(dispatch.params);
                    if dispatch.entry_point.reads_scene() {
                        params.extend_from_slice(bytemuck::bytes_of(&first_rows(dispatch)?));
                    }
                    params.resize(params.len().next_multiple_of(PARAMS_STRIDE as usize), 0u8);
                }
                Command::Fill { bytes, ones: true, .. } => ones = ones.max((*bytes).min(ONES)),
                _ => {}
            }
        }
        let launches = (params.len() as u64 / PARAMS_STRIDE) as u32;
        if self.timer.as_ref().is_some_and(|timer| timer.launches() < launches) {
            self.timer = Some(Timer::new(&self.gpu, launches)?);
        }
        if launches > 0 {
            let place = self.params.take().filter(|buffer| buffer.size() >= params.len() as u64);
            let place = match place {
                Some(buffer) => buffer,
                None => {
                    let size = u64::from(launches.max(LAUNCHES)) * PARAMS_STRIDE;
                    let usage = BufferUsages::UNIFORM | BufferUsages::STORAGE | BufferUsages::COPY_DST;
                    self.gpu.buffer(size, usage, "launch parameters")?
                }
            };
            self.gpu.queue.write_buffer(&place, 0, &params);
            self.params = Some(place);
        }
        if self.ones.as_ref().map_or(0, Buffer::size) < ones {
            self.ones = None; // freed before the new one is allocated
            let buffer = self.gpu.buffer(ones, STORAGE, "ones")?;
            self.gpu.queue.write_buffer(&buffer, 0, &vec![u8::MAX; buffer.size() as usize]);
            self.ones = Some(buffer);
        }
        Ok(launches)
    }

    /// Records a launch.
    fn dispatch(
        &self,
        encoder: &mut CommandEncoder,
        dispatch: &Dispatch<'_>,
        launch: u32,
    ) -> Result<(), BackendError> {
        let Some(params) = &self.params else { return Ok(()) };
        let place = u64::from(launch) * PARAMS_STRIDE;
        let (pipeline, group) = self.pipelines.bind(&self.gpu.device, dispatch, (params, place))?;
        let (mut across, mut down) = dispatch.groups();
        if dispatch.entry_point.queue {
            // As many lanes as pixels; those that start late find the queue empty.
            let (groups, limit) =
                (across * down, self.gpu.device.limits().max_compute_workgroups_per_dimension);
            (across, down) = (groups.min(limit), groups.div_ceil(limit));
        }
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some(dispatch.entry_point.name),
            timestamp_writes: self.timer.as_ref().map(|timer| timer.writes(launch)),
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(across, down, 1);
        Ok(())
    }

    /// Records copies of ones to bytes of a buffer.
    fn fill_with_ones(&self, encoder: &mut CommandEncoder, buffer: &Buffer, first: u64, bytes: u64) {
        let Some(ones) = &self.ones else { return };
        let mut done = 0;
        while done < bytes {
            let part = ones.size().min(bytes - done);
            encoder.copy_buffer_to_buffer(ones, 0, buffer, first + done, part);
            done += part;
        }
    }

    /// Records copies of rows, packed, to a buffer that the host can map.
    fn copy_rows(
        &mut self,
        encoder: &mut CommandEncoder,
        from: &Part,
        to: &RowTarget<'_>,
    ) -> Result<Buffer, BackendError> {
        let row = to.row_bytes() as u64;
        let bytes = row * u64::from(to.rows().len());
        let through = self.readbacks.take(&self.gpu, bytes, "a copy from the device")?;
        let mut done = 0;
        for block in to.rows().blocks() {
            let length = block.len() as u64 * row;
            let first = from.first + u64::from(block.start) * row;
            encoder.copy_buffer_to_buffer(&from.buffer, first, &through, done, length);
            done += length;
        }
        Ok(through)
    }
}
