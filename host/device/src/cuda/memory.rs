//! Allocation of device memory on CUDA.

use super::Cuda;
use super::driver::failed;
use crate::BackendError;
use bytemuck::Pod;
use cudarc::driver::{CudaSlice, DevicePtrMut, result};

impl Cuda {
    /// Allocates memory whose content is undefined, at least one byte. `what` names it in an error.
    pub(super) fn allocate(&self, bytes: usize, what: &'static str) -> Result<CudaSlice<u8>, BackendError> {
        let (free, _) = self.stream.context().mem_get_info().map_err(failed("asking for free memory"))?;
        if bytes > free {
            let (needed, limit) = (bytes as u64, free as u64);
            return Err(BackendError::TooLarge { backend: "cuda", what, needed, limit });
        }
        // SAFETY: each byte is written before its value is used: by a copy, a fill or a kernel.
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

    /// Sets each byte of a film's sums or AOV sums to 0xff, as in their `UNWRITTEN`.
    pub(super) fn erase(&self, film: &mut CudaSlice<u8>) -> Result<(), BackendError> {
        let bytes = film.len();
        let (pointer, _guard) = film.device_ptr_mut(&self.stream);
        // SAFETY: the pointer is valid for `bytes` bytes.
        unsafe { result::memset_d8_async(pointer, 0xff, bytes, self.stream.cu_stream()) }
            .map_err(failed("erasing the film"))
    }
}
