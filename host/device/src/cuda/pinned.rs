//! Copies from the device to host memory, which are faster if the memory is pinned (page-locked).

use super::driver::failed;
use super::{Cuda, NAME};
use crate::command::{check_rows, handle};
use crate::target::CopyRect;
use crate::{BackendError, Buffer, HostMemory, RowTarget};
use cudarc::driver::{CudaSlice, CudaStream, DevicePtr, sys};
use std::ffi::c_void;
use std::sync::Arc;

/// Maximum distance in bytes from row to row of a rectangle: CU_DEVICE_ATTRIBUTE_MAX_PITCH of every
/// device.
const MAX_PITCH: usize = i32::MAX as usize;

/// Host memory that stays pinned as long as this value exists, so that the device writes to it
/// directly.
pub(super) struct Pinned {
    memory: Arc<HostMemory>,
    /// Streams that copy to it.
    streams: [Arc<CudaStream>; 2],
}

impl Pinned {
    /// Pins `memory`. Returns `None` if the system or the driver refuses it, for this memory or for
    /// any more.
    pub fn new(streams: [&Arc<CudaStream>; 2], memory: &Arc<HostMemory>) -> Option<Self> {
        streams[0].context().bind_to_thread().ok()?;
        // SAFETY: the memory has these bytes as long as `memory` is held, which the result does
        // until it has unpinned them.
        let pinned = unsafe { sys::cuMemHostRegister_v2(memory.first().cast::<c_void>(), memory.bytes(), 0) };
        pinned.result().ok().map(|()| Self { memory: memory.clone(), streams: streams.map(Arc::clone) })
    }

    /// Returns whether nothing else holds the memory.
    pub fn is_left(&self) -> bool {
        Arc::strong_count(&self.memory) == 1
    }

    /// Returns whether all these bytes are in the memory.
    pub fn has(&self, bytes: &[u8]) -> bool {
        let (own, other) = (self.memory.first() as usize, bytes.as_ptr() as usize);
        other.checked_sub(own).is_some_and(|before| before + bytes.len() <= self.memory.bytes())
    }

    /// Returns whether the memory has the byte at this address.
    pub fn has_address(&self, address: usize) -> bool {
        let first = self.memory.first() as usize;
        address.checked_sub(first).is_some_and(|before| before < self.memory.bytes())
    }

    pub fn is_of(&self, memory: &Arc<HostMemory>) -> bool {
        Arc::ptr_eq(&self.memory, memory)
    }
}

impl Drop for Pinned {
    fn drop(&mut self) {
        // The first call may report an earlier failure.
        let _ = self.streams[0].context().bind_to_thread();
        let _ = self.streams[0].context().bind_to_thread();
        for stream in &self.streams {
            let _ = stream.synchronize();
        }
        // SAFETY: `new` pinned it.
        if unsafe { sys::cuMemHostUnregister(self.memory.first().cast::<c_void>()) }.result().is_err() {
            // The driver still takes this address for pinned, so the memory is leaked: nothing else
            // may be allocated there.
            std::mem::forget(self.memory.clone());
        }
    }
}

impl Cuda {
    /// Starts copying rows of an image's per-pixel records to the host, in a stream of this device.
    /// The target must live until the stream was synchronised.
    pub(super) fn read(
        &self,
        stream: &CudaStream,
        from: &Buffer,
        to: &mut RowTarget<'_>,
    ) -> Result<(), BackendError> {
        check_rows(NAME, from, to)?;
        let (rows, row) = (to.rows().clone(), to.row_bytes());
        let most = u32::try_from(MAX_PITCH / row.max(1)).unwrap_or(u32::MAX);
        let mut before = 0;
        let (device, _guard) = handle::<CudaSlice<u8>>(from, NAME)?.device_ptr(stream);
        for grid in CopyRect::all(&rows, most) {
            let (first, step) = to.place(&grid, before);
            before += grid.rows();
            // A block of rows is copied as one row of the rectangle; a block longer than the
            // maximum pitch is copied row by row.
            let block = grid.length as usize * row;
            let (width, height, pitches) = match block <= MAX_PITCH {
                true => (block, grid.count as usize, (grid.step as usize * row, step as usize * row)),
                false => (row, grid.length as usize, (row, row)),
            };
            let copy = sys::CUDA_MEMCPY2D {
                srcXInBytes: 0,
                srcY: 0,
                srcMemoryType: sys::CUmemorytype::CU_MEMORYTYPE_DEVICE,
                srcHost: std::ptr::null(),
                srcDevice: device + grid.start as u64 * row as u64,
                srcArray: std::ptr::null_mut(),
                srcPitch: pitches.0,
                dstXInBytes: 0,
                dstY: 0,
                dstMemoryType: sys::CUmemorytype::CU_MEMORYTYPE_HOST,
                dstHost: first.cast(),
                dstDevice: 0,
                dstArray: std::ptr::null_mut(),
                dstPitch: pitches.1,
                WidthInBytes: width,
                Height: height,
            };
            // SAFETY: the image has these rows, as was checked, and the target has places for them
            // until the stream was synchronised.
            unsafe { sys::cuMemcpy2DAsync_v2(&raw const copy, stream.cu_stream()) }
                .result()
                .map_err(failed("reading from the device"))?;
        }
        Ok(())
    }
}
