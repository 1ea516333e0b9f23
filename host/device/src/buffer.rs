//! Memory on a device.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

/// Memory on a device, which [`Device::allocate`](crate::Device::allocate) returns. Clones share
/// it; it is freed with the last of them.
#[derive(Clone)]
pub struct Buffer {
    memory: Arc<dyn Any + Send + Sync>,
    bytes: u64,
}

impl Buffer {
    /// Wraps a backend's own handle to `bytes` bytes.
    pub(crate) fn new(memory: impl Any + Send + Sync, bytes: u64) -> Self {
        Self { memory: Arc::new(memory), bytes }
    }

    /// Returns the number of bytes that were asked for.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Returns whether another clone of this buffer exists.
    pub fn is_shared(&self) -> bool {
        Arc::strong_count(&self.memory) > 1
    }

    /// Returns the address of the backend's handle, by which buffers are told apart.
    pub fn address(&self) -> usize {
        Arc::as_ptr(&self.memory).addr()
    }

    /// Returns the backend's handle, or `None` if the buffer is another backend's.
    pub fn memory<T: Any>(&self) -> Option<&T> {
        self.memory.downcast_ref()
    }
}

impl fmt::Debug for Buffer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Buffer of {} bytes", self.bytes)
    }
}
