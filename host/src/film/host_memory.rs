//! Memory of the host that devices copy to.
#![allow(unsafe_code, reason = "a device or other processes write to it; each block names why it is sound")]

use bytemuck::{Pod, Zeroable};
use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Bytes at a place that does not change, so that a device may [copy there without a detour](crate::backend::Backend::pin). It reads and writes nothing by
/// itself: those who share it agree on that.
#[derive(Debug)]
pub struct HostMemory {
    first: *mut u8,
    bytes: usize,
    /// Of what is this process's own, and is freed with it.
    own: Option<Layout>,
}

// SAFETY: it is a place and a length.
unsafe impl Send for HostMemory {}
// SAFETY: as above.
unsafe impl Sync for HostMemory {}

/// What devices copy to in whole.
const PAGE: usize = 4096;

impl HostMemory {
    /// Zeros. Whole pages: what else lay in the last one would be pinned with it.
    pub fn new(bytes: usize) -> Self {
        let Ok(layout) =
            Layout::from_size_align(bytes.max(1).checked_next_multiple_of(PAGE).unwrap_or(usize::MAX), PAGE)
        else {
            handle_alloc_error(Layout::new::<u8>()) // more than half of all addresses
        };
        // SAFETY: the layout has a size.
        let first = unsafe { alloc_zeroed(layout) };
        if first.is_null() {
            handle_alloc_error(layout);
        }
        Self { first, bytes, own: Some(layout) }
    }

    /// Of several processes.
    ///
    /// # Safety
    ///
    /// So many bytes lie there, at a multiple of 16, as long as this is used.
    #[cfg(feature = "mpi")]
    pub(crate) unsafe fn shared(first: *mut u8, bytes: usize) -> Self {
        Self { first, bytes, own: None }
    }

    /// Its first byte, at a multiple of 16.
    pub fn first(&self) -> *mut u8 {
        self.first
    }

    /// How many bytes it has.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

impl Drop for HostMemory {
    fn drop(&mut self) {
        if let Some(layout) = self.own {
            // SAFETY: `new` allocated it so.
            unsafe { dealloc(self.first, layout) };
        }
    }
}

/// Records in such memory.
#[derive(Debug)]
pub struct HostRecords<T> {
    memory: Arc<HostMemory>,
    count: usize,
    of: PhantomData<T>,
}

impl<T: Pod + Zeroable> HostRecords<T> {
    /// So many, of zeros.
    pub fn new(count: usize) -> Self {
        const { assert!(align_of::<T>() <= PAGE) };
        let memory = Arc::new(HostMemory::new(count.saturating_mul(size_of::<T>())));
        Self { memory, count, of: PhantomData }
    }

    /// Makes room for so many: other memory, if there is less. What they hold is of no meaning then.
    pub fn resize(&mut self, count: usize) {
        if count.saturating_mul(size_of::<T>()) > self.memory.bytes() {
            *self = Self::new(count);
        }
        self.count = count;
    }

    /// For [`Backend::pin`](crate::backend::Backend::pin), where writing is left to who has the records.
    pub fn memory(&self) -> &Arc<HostMemory> {
        &self.memory
    }
}

impl<T: Pod + Zeroable> Default for HostRecords<T> {
    fn default() -> Self {
        Self::new(0)
    }
}

impl<T: Pod> Deref for HostRecords<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        // SAFETY: the memory has so many, any bytes are some, and whoever else has the memory leaves it to this.
        unsafe { std::slice::from_raw_parts(self.memory.first().cast(), self.count) }
    }
}

impl<T: Pod> DerefMut for HostRecords<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.memory.first().cast(), self.count) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records() {
        let mut records = HostRecords::<[f32; 3]>::new(5);
        records[4] = [1.0, 2.0, 3.0];
        records.resize(4);
        assert_eq!((records.len(), records[3]), (4, [0.0; 3]));
        let place = records.memory().first();
        records.resize(5);
        assert_eq!((records.memory().first(), records[4]), (place, [1.0, 2.0, 3.0]));
        records.resize(1000);
        assert!(records.iter().all(|record| *record == [0.0; 3]));
        assert!(HostRecords::<u32>::default().is_empty());
    }
}
