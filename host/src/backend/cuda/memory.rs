//! Memory of the device.

use super::driver::failed;
use super::{Cuda, not_prepared};
use crate::backend::BackendError;
use crate::film::Rows;
use bytemuck::Pod;
use cudarc::driver::{CudaSlice, DevicePtrMut, result};

impl Cuda {
    pub(super) fn allocate(&self, bytes: usize, what: &'static str) -> Result<CudaSlice<u8>, BackendError> {
        let (free, _) = self.stream.context().mem_get_info().map_err(failed("asking for free memory"))?;
        if bytes > free {
            let (needed, limit) = (bytes as u64, free as u64);
            return Err(BackendError::TooLarge { backend: "cuda", what, needed, limit });
        }
        // SAFETY: every byte is written before it is read: by `copy` or by `erase`.
        unsafe { self.stream.alloc(bytes.max(1)) }.map_err(failed("allocating memory"))
    }

    pub(super) fn zeros(&self, bytes: usize, what: &'static str) -> Result<CudaSlice<u8>, BackendError> {
        let mut memory = self.allocate(bytes, what)?;
        self.stream.memset_zeros(&mut memory).map_err(failed("allocating memory"))?;
        Ok(memory)
    }

    pub(super) fn copy<T: Pod>(
        &self,
        records: &[T],
        what: &'static str,
    ) -> Result<CudaSlice<u8>, BackendError> {
        let bytes: &[u8] = bytemuck::cast_slice(records);
        let mut memory = self.allocate(bytes.len(), what)?;
        if !bytes.is_empty() {
            self.stream.memcpy_htod(bytes, &mut memory).map_err(failed("copying the scene"))?;
        }
        Ok(memory)
    }

    /// Fills a film's sums with [`PixelSums::UNWRITTEN`].
    pub(super) fn erase(&self, film: &mut CudaSlice<u8>) -> Result<(), BackendError> {
        let bytes = film.len();
        let (pointer, _guard) = film.device_ptr_mut(&self.stream);
        // SAFETY: the pointer is valid for `bytes` bytes.
        unsafe { result::memset_d8_async(pointer, 0xff, bytes, self.stream.cu_stream()) }
            .map_err(failed("erasing the film"))
    }

    /// Copies rows of what an image's pixels have on the device. Blocks of rows are put together there: a copy to the host each would wait for each.
    pub(super) fn read_rows(
        &self,
        rows: &Rows,
        from: &CudaSlice<u8>,
        to: &mut [u8],
    ) -> Result<(), BackendError> {
        let row = to.len() / (rows.len() as usize).max(1);
        let bytes = |block: &std::ops::Range<u32>| block.start as usize * row..block.end as usize * row;
        let mut blocks = rows.blocks();
        let (first, more) = (blocks.next(), blocks.next().is_some());
        if from.len() < rows.end() as usize * row {
            return Err(not_prepared());
        }
        let Some(first) = first else { return Ok(()) };
        let copied = if more {
            let mut together = self.allocate(to.len(), "the rows of a share")?;
            let mut done = 0;
            for block in rows.blocks() {
                let part = from.slice(bytes(&block));
                let mut place = together.slice_mut(done..done + part.len());
                self.stream.memcpy_dtod(&part, &mut place).map_err(failed("reading the film"))?;
                done += part.len();
            }
            self.stream.memcpy_dtoh(&together, to)
        } else {
            self.stream.memcpy_dtoh(&from.slice(bytes(&first)), to)
        };
        copied.map_err(failed("reading the film"))?;
        self.stream.synchronize().map_err(failed("reading the film"))
    }
}
