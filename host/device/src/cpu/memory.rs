//! Memory of the CPU's buffers, with a stamp of its content.

use crate::HostMemory;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Memory of a buffer.
#[derive(Debug)]
pub(super) struct Memory {
    of: HostMemory,
    stamp: AtomicU64,
}

/// Returns a number above 0 that no other call returns.
fn fresh() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Relaxed)
}

impl Memory {
    /// Wraps memory with a new stamp.
    pub fn of(memory: HostMemory) -> Self {
        Self { of: memory, stamp: AtomicU64::new(fresh()) }
    }

    /// Gives the content a new stamp, before it is written.
    pub fn change(&self) {
        self.stamp.store(fresh(), Relaxed);
    }

    /// Returns a number that differs from that of any other memory, and of this one with other
    /// content.
    #[cfg(target_family = "wasm")]
    pub fn stamp(&self) -> u64 {
        self.stamp.load(Relaxed)
    }
}

impl Deref for Memory {
    type Target = HostMemory;

    fn deref(&self) -> &HostMemory {
        &self.of
    }
}
