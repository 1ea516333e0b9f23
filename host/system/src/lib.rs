//! Memory, threads and files of the operating system: how much memory is free, threads that may be
//! refused, and files that are opened and replaced safely.

pub mod atomic_file;
pub mod checksummed_file;
pub mod input;
pub mod memory;
pub mod spin;
pub mod threads;
pub mod time;
