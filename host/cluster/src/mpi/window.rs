//! Memory that the ranks of one host share (MPI 4.0, section 12.2.3): for long messages
//! (`shared_memory`) and for the frames of a series (`mpi`).
#![allow(unsafe_code, reason = "calls MPI; each block says why it is sound")]

use super::check;
use crate::ClusterError;
use ::mpi::collective::SystemOperation;
use ::mpi::ffi;
use ::mpi::topology::{Communicator, SimpleCommunicator};
use ::mpi::traits::{AsRaw, CommunicatorCollectives, Root};
use std::mem::MaybeUninit;

/// Shared memory with a part for each rank of a host, at multiples of 16 bytes.
pub(super) struct Window {
    handle: ffi::MPI_Win,
}

/// Free shared memory that must remain per rank: other windows take theirs only when it is written
/// to.
const MIN_FREE_BYTES: u64 = 1 << 26;

/// Returns whether the host has enough shared memory for all parts. Its first rank, which allocates
/// them, decides: Open MPI 4.1 leaves the other ranks waiting if there is not enough.
fn fits(host: &SimpleCommunicator, bytes: usize) -> bool {
    let mut all = 0u64;
    host.all_reduce_into(&(bytes as u64), &mut all, SystemOperation::sum());
    let ranks = u64::from(host.size().unsigned_abs());
    let mut enough =
        host.rank() != 0 || free().is_none_or(|free| free / 2 > all && free > all + ranks * MIN_FREE_BYTES);
    host.process_at_rank(0).broadcast_into(&mut enough);
    enough
}

/// Returns the free bytes of `/dev/shm`, which holds shared memory; `None` if unknown.
fn free() -> Option<u64> {
    let mut about = MaybeUninit::<libc::statvfs>::uninit();
    // SAFETY: the path ends with a zero byte, and the record is written if the call succeeds.
    let found = unsafe { libc::statvfs(c"/dev/shm".as_ptr(), about.as_mut_ptr()) } == 0;
    // SAFETY: the call succeeded, so the record was written.
    let about = found.then(|| unsafe { about.assume_init() })?;
    Some(about.f_bavail.saturating_mul(about.f_frsize))
}

impl Window {
    /// Allocates shared memory; all ranks of the host call this, each with the size of its own part
    /// in bytes. Returns `None` if there is not enough memory.
    pub fn allocate(host: &SimpleCommunicator, bytes: usize) -> Result<Option<Self>, ClusterError> {
        if !fits(host, bytes) {
            return Ok(None);
        }
        // SAFETY: the communicator is valid. With MPI's default error handler, lack of memory would
        // end the job.
        let code = unsafe { ffi::MPI_Comm_set_errhandler(host.as_raw(), ffi::RSMPI_ERRORS_RETURN) };
        check("sharing memory", code)?;
        let mut own: *mut std::ffi::c_void = std::ptr::null_mut();
        let mut handle = MaybeUninit::uninit();
        // SAFETY: all ranks of the host call this; pointer and window are written.
        let code = unsafe {
            ffi::MPI_Win_allocate_shared(
                bytes.next_multiple_of(16) as ffi::MPI_Aint,
                1,
                ffi::RSMPI_INFO_NULL,
                host.as_raw(),
                (&raw mut own).cast(),
                handle.as_mut_ptr(),
            )
        };
        let made = code == ffi::MPI_SUCCESS as i32;
        let mut all = 0i32;
        host.all_reduce_into(&i32::from(made), &mut all, SystemOperation::min());
        // SAFETY: the call succeeded on all ranks and wrote the handle.
        Ok((all == 1).then(|| Self { handle: unsafe { handle.assume_init() } }))
    }

    /// Returns the address and the size in bytes of the part of a rank, by its number on the host.
    pub fn part(&self, rank: i32) -> Result<(*mut u8, usize), ClusterError> {
        let (mut size, mut unit) = (0, 0);
        let mut first: *mut u8 = std::ptr::null_mut();
        // SAFETY: the window exists; size, unit and pointer are written.
        let code = unsafe {
            ffi::MPI_Win_shared_query(self.handle, rank, &mut size, &mut unit, (&raw mut first).cast())
        };
        check("sharing memory", code)?;
        Ok((first, usize::try_from(size).unwrap_or(0)))
    }

    /// Frees the memory. All ranks of the host call this, and must not use the memory afterwards.
    pub fn free(mut self) -> Result<(), ClusterError> {
        // SAFETY: the caller promises that no one uses the memory afterwards.
        check("sharing memory", unsafe { ffi::MPI_Win_free(&mut self.handle) })
    }
}
