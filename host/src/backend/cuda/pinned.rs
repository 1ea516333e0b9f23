//! Copies to memory of the host: of any, and faster to such as cannot be swapped out.

use super::driver::failed;
use super::{Cuda, not_prepared};
use crate::backend::BackendError;
use crate::film::{CopyRect, HostMemory, RowSet, RowTarget};
use cudarc::driver::{CudaSlice, CudaStream, DevicePtr, sys};
use std::ffi::c_void;
use std::sync::Arc;

/// Bytes from row to row of a rectangle, at most: CU_DEVICE_ATTRIBUTE_MAX_PITCH of every device.
const MAX_PITCH: usize = i32::MAX as usize;

/// Memory that the device writes to without a detour, as long as this is there.
pub(super) struct Pinned {
    memory: Arc<HostMemory>,
    stream: Arc<CudaStream>,
}

impl Pinned {
    /// None where the system or the driver does not allow it: for this memory, or for more.
    pub fn new(stream: &Arc<CudaStream>, memory: &Arc<HostMemory>) -> Option<Self> {
        stream.context().bind_to_thread().ok()?;
        // SAFETY: so many bytes lie there as long as `memory` is held, which the result does until it has taken this back.
        let pinned = unsafe { sys::cuMemHostRegister_v2(memory.first().cast::<c_void>(), memory.bytes(), 0) };
        pinned.result().ok().map(|()| Self { memory: memory.clone(), stream: stream.clone() })
    }

    /// Whether no one else has the memory.
    pub fn is_left(&self) -> bool {
        Arc::strong_count(&self.memory) == 1
    }

    pub fn is_of(&self, memory: &Arc<HostMemory>) -> bool {
        Arc::ptr_eq(&self.memory, memory)
    }
}

impl Drop for Pinned {
    fn drop(&mut self) {
        // The first call may report what failed before.
        let _ = self.stream.context().bind_to_thread();
        let _ = self.stream.context().bind_to_thread();
        let _ = self.stream.synchronize();
        // SAFETY: `new` pinned it.
        if unsafe { sys::cuMemHostUnregister(self.memory.first().cast::<c_void>()) }.result().is_err() {
            // The driver takes the place for pinned still: nothing else may come there.
            std::mem::forget(self.memory.clone());
        }
    }
}

impl Cuda {
    /// Copies rows of what an image's pixels have on the device, one below the other.
    pub(super) fn read_rows(
        &self,
        rows: &RowSet,
        from: &CudaSlice<u8>,
        to: &mut [u8],
    ) -> Result<(), BackendError> {
        let row = to.len() / (rows.len() as usize).max(1);
        let mut rest = to;
        self.read_grids(rows, from, row, |grid, _| {
            let (part, after) = std::mem::take(&mut rest).split_at_mut(grid.rows() as usize * row);
            rest = after;
            (part.as_mut_ptr(), grid.length)
        })
    }

    /// The same of an image's pixels, to where they belong.
    pub(super) fn read_target(
        &self,
        from: &CudaSlice<u8>,
        to: &mut RowTarget<'_>,
    ) -> Result<(), BackendError> {
        let (rows, row) = (to.rows().clone(), to.width() * 4);
        self.read_grids(&rows, from, row, |grid, before| {
            let (first, step) = to.place(grid, before);
            (first.cast(), step)
        })
    }

    /// Copies rectangles, each to where `place` says: its first byte, and how many rows of `row` bytes lie from one block of rows to the next there.
    fn read_grids(
        &self,
        rows: &RowSet,
        from: &CudaSlice<u8>,
        row: usize,
        mut place: impl FnMut(&CopyRect, u32) -> (*mut u8, u32),
    ) -> Result<(), BackendError> {
        if from.len() < rows.end() as usize * row {
            return Err(not_prepared());
        }
        let most = u32::try_from(MAX_PITCH / row.max(1)).unwrap_or(u32::MAX);
        let mut before = 0;
        {
            let (device, _guard) = from.device_ptr(&self.stream);
            for grid in CopyRect::all(rows, most) {
                let (to, step) = place(&grid, before);
                before += grid.rows();
                // One block is a row of so many bytes; a block that is too long for that goes row by row.
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
                    dstHost: to.cast(),
                    dstDevice: 0,
                    dstArray: std::ptr::null_mut(),
                    dstPitch: pitches.1,
                    WidthInBytes: width,
                    Height: height,
                };
                // SAFETY: the image has these rows, as was checked, and the host's memory has them by `place`, which lends it until the end of this
                // function, where the copies have ended.
                let started = unsafe { sys::cuMemcpy2DAsync_v2(&raw const copy, self.stream.cu_stream()) };
                if let Err(error) = started.result() {
                    let _ = self.stream.synchronize();
                    return Err(failed("reading the film")(error));
                }
            }
        }
        self.stream.synchronize().map_err(failed("reading the film"))
    }
}
