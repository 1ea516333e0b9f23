//! Memory of the device on CUDA.

use super::driver::failed;
use super::{Cuda, NAME};
use crate::BackendError;
use crate::Buffer;
use crate::command::{check_range, handle};
use cudarc::driver::{CudaSlice, DevicePtr, result};

impl Cuda {
    /// Allocates memory whose content is undefined, at least one byte. `what` names it in an error.
    pub(super) fn allocate_bytes(
        &self,
        bytes: u64,
        what: &'static str,
    ) -> Result<CudaSlice<u8>, BackendError> {
        let (free, _) = self.stream.context().mem_get_info().map_err(failed("asking for free memory"))?;
        let count = usize::try_from(bytes).ok().filter(|&count| count <= free);
        let Some(count) = count else {
            return Err(BackendError::TooLarge { backend: NAME, what, needed: bytes, limit: free as u64 });
        };
        // SAFETY: each byte is written before its value is used: by a copy, a fill or a kernel.
        unsafe { self.stream.alloc(count.max(1)) }.map_err(failed("allocating memory"))
    }

    /// Copies bytes to a buffer, and waits until the host's memory is no longer read.
    pub(super) fn write_bytes(&self, to: &Buffer, first: u64, bytes: &[u8]) -> Result<(), BackendError> {
        check_range(NAME, to, first, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let (to, _guard) = handle::<CudaSlice<u8>>(to, NAME)?.device_ptr(&self.stream);
        // SAFETY: the range was checked, and the copy has ended when this function returns.
        unsafe { result::memcpy_htod_async(to + first, bytes, self.stream.cu_stream()) }
            .map_err(failed("copying to the device"))?;
        self.stream.synchronize().map_err(failed("copying to the device"))
    }

    /// Starts setting bytes of a buffer.
    pub(super) fn fill(
        &self,
        buffer: &Buffer,
        first: u64,
        bytes: u64,
        value: u8,
    ) -> Result<(), BackendError> {
        check_range(NAME, buffer, first, bytes)?;
        if bytes == 0 {
            return Ok(());
        }
        let (at, _guard) = handle::<CudaSlice<u8>>(buffer, NAME)?.device_ptr(&self.stream);
        // SAFETY: the range was checked.
        unsafe { result::memset_d8_async(at + first, value, bytes as usize, self.stream.cu_stream()) }
            .map_err(failed("filling memory"))
    }

    /// Starts copying bytes from the start of a buffer to the start of another.
    pub(super) fn copy(&self, from: &Buffer, to: &Buffer, bytes: u64) -> Result<(), BackendError> {
        check_range(NAME, from, 0, bytes)?;
        check_range(NAME, to, 0, bytes)?;
        if bytes == 0 {
            return Ok(());
        }
        let (from, _read) = handle::<CudaSlice<u8>>(from, NAME)?.device_ptr(&self.stream);
        let (to, _written) = handle::<CudaSlice<u8>>(to, NAME)?.device_ptr(&self.stream);
        // SAFETY: the ranges were checked.
        unsafe { result::memcpy_dtod_async(to, from, bytes as usize, self.stream.cu_stream()) }
            .map_err(failed("copying on the device"))
    }
}
