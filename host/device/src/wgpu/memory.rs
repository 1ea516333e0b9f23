//! Buffers on the device, and those through which the host reads and writes them.

use super::adapter::Gpu;
use super::{MIN_BUFFER, NAME};
use crate::BackendError;
use wgpu::{Buffer, BufferDescriptor, BufferUsages};

impl Gpu {
    /// Creates a buffer, after comparing its size with the adapter's limits.
    pub fn buffer(
        &self,
        bytes: u64,
        usage: BufferUsages,
        what: &'static str,
    ) -> Result<Buffer, BackendError> {
        let limits = self.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > limit {
            return Err(BackendError::TooLarge { backend: NAME, what, needed: bytes, limit });
        }
        let size = bytes.max(MIN_BUFFER).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let descriptor = BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        let buffer = self.device.create_buffer(&descriptor);
        self.check("allocating memory")?;
        Ok(buffer)
    }
}

/// Memory of one of our buffers: a wgpu buffer, or the part of it from a byte on.
pub(super) struct Part {
    pub buffer: Buffer,
    pub first: u64,
}

impl Part {
    /// Returns the memory of a whole buffer.
    pub fn whole(buffer: Buffer) -> Self {
        Self { buffer, first: 0 }
    }
}

/// Bytes that the beginning of each part of a buffer is a multiple of: a row of SPIR-V's arrays.
pub(super) const ROW: u64 = 16;

/// Number of buffers that a pool keeps: those of sums and AOV sums, of a denoised image, and of one
/// for a display.
const KEPT: usize = 4;

/// Host-visible buffers of one usage. They are kept, because creating one takes longer than a copy.
pub(super) struct Pool {
    usage: BufferUsages,
    /// Buffers that are not in use; the last was used last.
    buffers: Vec<Buffer>,
}

impl Pool {
    /// Creates an empty pool.
    pub fn new(usage: BufferUsages) -> Self {
        Self { usage, buffers: Vec::new() }
    }

    /// Takes a buffer of at least `bytes` bytes, and at most twice as many, or creates one.
    pub fn take(&mut self, gpu: &Gpu, bytes: u64, what: &'static str) -> Result<Buffer, BackendError> {
        let bytes = bytes.max(MIN_BUFFER);
        let fits = |buffer: &Buffer| buffer.size() >= bytes && buffer.size() / 2 <= bytes;
        match self.buffers.iter().position(fits) {
            Some(index) => Ok(self.buffers.remove(index)),
            None => gpu.buffer(bytes, self.usage, what),
        }
    }

    /// Gives buffers back.
    pub fn put(&mut self, buffers: impl IntoIterator<Item = Buffer>) {
        self.buffers.extend(buffers);
        let surplus = self.buffers.len().saturating_sub(KEPT);
        self.buffers.drain(..surplus);
    }
}
