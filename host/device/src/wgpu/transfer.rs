//! Copies between host and device memory, through mapped buffers and by all threads of the host.

use super::Wgpu;
use super::adapter::Gpu;
use crate::BackendError;
use rayon::prelude::*;
use std::sync::mpsc;
use wgpu::{Buffer, MapMode, WriteOnly};

/// Number of bytes that a thread copies at a time.
const PART: usize = 1 << 16;

/// Maximum number of bytes of a buffer that is kept for the next write: those of meshes are large,
/// and written once.
const MAX_KEPT: u64 = 1 << 26;

fn failed(action: &'static str, error: &dyn std::fmt::Display) -> BackendError {
    BackendError::Device { backend: "wgpu", action, message: error.to_string() }
}

impl Gpu {
    /// Waits for all submitted work and copies `bytes.len()` bytes from the start of a mappable
    /// buffer.
    pub fn read(&self, buffer: &Buffer, bytes: &mut [u8], action: &'static str) -> Result<(), BackendError> {
        self.map(buffer, bytes.len() as u64, action, |from| {
            if bytes.len() <= PART {
                return bytes.copy_from_slice(from); // too few to wake other threads
            }
            let parts = bytes.par_chunks_mut(PART).zip(from.par_chunks(PART));
            parts.for_each(|(to, from)| to.copy_from_slice(from));
        })
    }

    /// Waits for all submitted work and calls `take` with the first `bytes` bytes of a mappable
    /// buffer.
    pub fn map(
        &self,
        buffer: &Buffer,
        bytes: u64,
        action: &'static str,
        take: impl FnOnce(&[u8]),
    ) -> Result<(), BackendError> {
        self.make_mapped(buffer, MapMode::Read, bytes, action)?;
        let view = buffer.slice(..bytes).get_mapped_range().map_err(|error| failed(action, &error))?;
        take(&view);
        drop(view);
        buffer.unmap();
        Ok(())
    }

    fn make_mapped(
        &self,
        buffer: &Buffer,
        mode: MapMode,
        bytes: u64,
        action: &'static str,
    ) -> Result<(), BackendError> {
        let (sender, receiver) = mpsc::channel();
        buffer.slice(..bytes).map_async(mode, move |result| {
            let _ = sender.send(result);
        });
        let mapped = self.wait_for(&receiver, action)?;
        mapped.map_err(|error| failed(action, &error))
    }
}

/// Copies by many threads, because one alone does not saturate the path to GPU memory
/// (docs/notebook/samplers-and-adaptive.md).
fn fill(to: WriteOnly<'_, [u8]>, from: &[u8]) {
    let (parts, rest) = to.into_chunks::<PART>();
    let (from, last) = from.split_at(parts.len() * PART);
    let parts: Vec<WriteOnly<'_, [u8; PART]>> = parts.into_iter().collect();
    parts.into_par_iter().zip(from.par_chunks_exact(PART)).for_each(|(to, from)| {
        WriteOnly::<[u8]>::from(to).copy_from_slice(from);
    });
    { rest }.copy_from_slice(last);
}

impl Wgpu {
    /// Writes `bytes` to the buffer `to`, from its byte `first` on, through a mapped buffer.
    pub(super) fn write_through(
        &mut self,
        to: &Buffer,
        first: u64,
        bytes: &[u8],
    ) -> Result<(), BackendError> {
        let (action, length) = ("copying to the device", bytes.len() as u64);
        let through = self.uploads.take(&self.gpu, length, "a copy to the device")?;
        self.gpu.make_mapped(&through, MapMode::Write, length, action)?;
        let mut view =
            through.slice(..length).get_mapped_range_mut().map_err(|error| failed(action, &error))?;
        fill(view.slice(..), bytes);
        drop(view);
        through.unmap();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&through, 0, to, first, length);
        self.gpu.queue.submit([encoder.finish()]);
        if through.size() <= MAX_KEPT {
            self.uploads.put([through]);
        }
        self.gpu.check(action)
    }
}
