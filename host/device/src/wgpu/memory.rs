//! Buffers on the device, and copies between them.

use super::{Film, MIN_BUFFER, SCENE_USAGE, Wgpu};
use crate::BackendError;
use crate::RowSet;
use bytemuck::Pod;
use wgpu::{Buffer, BufferDescriptor, BufferUsages};

impl Wgpu {
    /// Creates a buffer, after comparing its size with the adapter's limits.
    pub(super) fn buffer(
        &self,
        bytes: u64,
        usage: BufferUsages,
        what: &'static str,
    ) -> Result<Buffer, BackendError> {
        let limits = self.gpu.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > limit {
            return Err(BackendError::TooLarge { backend: "wgpu", what, needed: bytes, limit });
        }
        let size = bytes.max(MIN_BUFFER);
        let buffer = self.gpu.device.create_buffer(&BufferDescriptor {
            label: Some(what),
            size,
            usage,
            mapped_at_creation: false,
        });
        self.gpu.check("allocating memory")?;
        Ok(buffer)
    }

    pub(super) fn store<T: Pod>(&self, records: &[T], what: &'static str) -> Result<Buffer, BackendError> {
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let buffer = self.buffer(bytes.len() as u64, SCENE_USAGE, what)?;
        self.gpu.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    }

    pub(super) fn copy(&self, from: &Buffer, to: &Buffer, action: &'static str) -> Result<(), BackendError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check(action)
    }

    /// Copies rows of an image's per-pixel records, `bytes` bytes in all, packed to a staging
    /// buffer.
    pub(super) fn copy_rows(
        &self,
        rows: &RowSet,
        from: &Buffer,
        to: &Buffer,
        bytes: usize,
    ) -> Result<(), BackendError> {
        let row = (bytes / (rows.len() as usize).max(1)) as u64;
        if from.size() < u64::from(rows.end()) * row || to.size() < bytes as u64 {
            return Err(self.misuse("the rows are outside the prepared film"));
        }
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut done = 0;
        for block in rows.blocks() {
            let length = block.len() as u64 * row;
            encoder.copy_buffer_to_buffer(from, u64::from(block.start) * row, to, done, length);
            done += length;
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check("reading the film")
    }

    /// Resets the AOV sums to `UNWRITTEN`. Its bytes are 0xff, like those of the film's unwritten
    /// sums, from which they are copied.
    pub(super) fn erase_aovs(&self, film: &Film) -> Result<(), BackendError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (ones, guides) = (&film.unwritten, &film.aovs.records);
        let mut done = 0;
        while done < guides.size() {
            let part = ones.size().min(guides.size() - done);
            encoder.copy_buffer_to_buffer(ones, 0, guides, done, part);
            done += part;
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check("erasing the AOV sums")
    }
}
