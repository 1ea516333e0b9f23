//! Commands that a device runs one after another: fills, copies, launches and reads.

use crate::{BackendError, Buffer, MathMode, RowTarget};
use trisect_kernels::EntryPoint;

/// Command for a device. A list of commands has the effect of its commands one after another.
#[derive(Debug)]
pub enum Command<'a> {
    /// Sets each bit of a buffer's bytes.
    Fill {
        /// Buffer to write.
        buffer: &'a Buffer,
        /// First byte, a multiple of 4.
        first: u64,
        /// Number of bytes, a multiple of 4.
        bytes: u64,
        /// True for ones, false for zeros.
        ones: bool,
    },
    /// Copies bytes from the start of one buffer to the start of another.
    Copy {
        /// Buffer to read.
        from: &'a Buffer,
        /// Buffer to write.
        to: &'a Buffer,
        /// Number of bytes, a multiple of 4.
        bytes: u64,
    },
    /// Launches a kernel.
    Dispatch(Dispatch<'a>),
    /// Copies rows of an image's per-pixel records to the host.
    Read {
        /// Buffer with a record for each pixel of the image.
        from: &'a Buffer,
        /// Host memory.
        to: RowTarget<'a>,
    },
}

impl<'a> Command<'a> {
    /// Returns a command that sets each bit of a whole buffer to 1, as in the `UNWRITTEN` of a
    /// film's records.
    pub fn erase(buffer: &'a Buffer) -> Self {
        Self::Fill { buffer, first: 0, bytes: buffer.bytes(), ones: true }
    }

    /// Returns a command that sets a whole buffer to zeros.
    pub fn clear(buffer: &'a Buffer) -> Self {
        Self::Fill { buffer, first: 0, bytes: buffer.bytes(), ones: false }
    }
}

/// Launch of a kernel.
#[derive(Clone, Debug)]
pub struct Dispatch<'a> {
    /// Entry point.
    pub entry_point: EntryPoint,
    /// Math build.
    pub math: MathMode,
    /// Launch parameters, as the entry point's record.
    pub params: &'a [u8],
    /// Record with the numbers of records of the arrays, as long as the entry point says.
    pub lengths: &'a [u8],
    /// Arrays, in the order of the arguments of its PTX.
    pub arrays: Vec<&'a Buffer>,
    /// Threads across and down. If lanes take the threads' pixels from a queue, its counter was set
    /// to 0.
    pub threads: (u32, u32),
}

impl Dispatch<'_> {
    /// Returns the number of work groups across and down.
    pub fn groups(&self) -> (u32, u32) {
        let group = self.entry_point.workgroup();
        (self.threads.0.div_ceil(group.0), self.threads.1.div_ceil(group.1))
    }

    /// Returns the error of a launch that has more work groups along an axis than `limit`.
    pub(crate) fn too_long(&self, backend: &'static str, limit: u32) -> BackendError {
        let (width, rows) = self.threads;
        let group = self.entry_point.workgroup();
        let limit = u64::from(limit) * u64::from(group.0.min(group.1));
        BackendError::TooLong { backend, width, rows, limit }
    }

    /// Checks that parameters, lengths and arrays are as many as the entry point has.
    pub(crate) fn check(&self, backend: &'static str) -> Result<(), BackendError> {
        let of = self.entry_point;
        let has = (self.params.len(), self.lengths.len(), self.arrays.len());
        let wanted = (of.params, of.lengths, of.arrays());
        if has == wanted {
            return Ok(());
        }
        let message = format!(
            "{backend}: {} has parameters and lengths of {} and {} bytes and {} arrays, not of {} and {} and {}",
            of.name, wanted.0, wanted.1, wanted.2, has.0, has.1, has.2
        );
        Err(BackendError::Misuse { message })
    }

    /// Checks, for a GPU, that the entry point has no arrays of the wide BVH.
    pub(crate) fn check_extra(&self, backend: &'static str) -> Result<(), BackendError> {
        match self.entry_point.extra {
            0 => Ok(()),
            _ => Err(misuse(backend, "the wide BVH is for the CPU only")),
        }
    }
}

/// Returns the backend's handles of a launch's arrays.
pub(crate) fn handles<'a, T: 'static>(
    dispatch: &Dispatch<'a>,
    backend: &'static str,
) -> Result<Vec<&'a T>, BackendError> {
    dispatch.arrays.iter().map(|array| handle(array, backend)).collect()
}

/// Returns the backend's handle of a buffer.
pub(crate) fn handle<'a, T: 'static>(
    buffer: &'a Buffer,
    backend: &'static str,
) -> Result<&'a T, BackendError> {
    buffer.memory::<T>().ok_or_else(|| misuse(backend, "the buffer is another device's"))
}

/// Checks that a buffer has these bytes.
pub(crate) fn check_range(
    backend: &'static str,
    buffer: &Buffer,
    first: u64,
    bytes: u64,
) -> Result<(), BackendError> {
    match first.checked_add(bytes).is_some_and(|end| end <= buffer.bytes()) {
        true => Ok(()),
        false => Err(misuse(backend, "the bytes are outside the buffer")),
    }
}

/// Checks that a buffer has the rows that a target asks for.
pub(crate) fn check_rows(
    backend: &'static str,
    from: &Buffer,
    to: &RowTarget<'_>,
) -> Result<(), BackendError> {
    check_range(backend, from, 0, u64::from(to.rows().end()).saturating_mul(to.row_bytes() as u64))
}

/// Returns the error of a call with wrong arguments.
pub(crate) fn misuse(backend: &'static str, message: &str) -> BackendError {
    BackendError::Misuse { message: format!("{backend}: {message}") }
}
