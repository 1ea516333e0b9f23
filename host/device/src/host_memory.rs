//! Host memory that devices copy to, which a backend can pin.
#![allow(unsafe_code, reason = "a device or other processes write to it; each block says why it is sound")]

use bytemuck::{Pod, Zeroable};
use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::any::Any;
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// Bytes at an address that does not change, so that a device may [copy there
/// directly](crate::Device::pin). This type itself does not access the bytes: those who
/// share the memory agree on who reads and writes.
#[derive(Debug)]
pub struct HostMemory {
    first: *mut u8,
    bytes: usize,
    owner: Owner,
}

/// Owner of memory, which keeps it valid.
#[derive(Debug)]
enum Owner {
    /// An allocation, which contains the bytes, and which this value frees.
    Allocation(*mut u8, Layout),
    /// Records that are only read.
    Records(#[allow(dead_code, reason = "it keeps the records")] LentRecords),
    /// Whoever shares the memory of several processes.
    Elsewhere,
}

/// Records in host memory that do not change while a device reads them in place.
#[derive(Clone)]
pub struct LentRecords {
    /// Keeps the records in place.
    owner: Arc<dyn Any + Send + Sync>,
    first: *const u8,
    bytes: usize,
}

// SAFETY: it is the address of records that its owner, which is `Send` and `Sync`, keeps.
unsafe impl Send for LentRecords {}
// SAFETY: as above; nothing writes to the records.
unsafe impl Sync for LentRecords {}

impl LentRecords {
    /// Lends records.
    pub fn of<T: Pod + Send + Sync>(records: Arc<Vec<T>>) -> Self {
        let (first, bytes) = (records.as_ptr().cast(), size_of_val(records.as_slice()));
        Self { owner: records, first, bytes }
    }

    /// Returns the bytes of the records.
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: the records have these bytes, any of which are valid, and no one can write to
        // them while `owner` holds them.
        unsafe { std::slice::from_raw_parts(self.first, self.bytes) }
    }
}

impl fmt::Debug for LentRecords {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let owners = Arc::strong_count(&self.owner);
        write!(formatter, "LentRecords of {} bytes with {owners} owners", self.bytes)
    }
}

// SAFETY: it is an address and a length.
unsafe impl Send for HostMemory {}
// SAFETY: it is an address and a length.
unsafe impl Sync for HostMemory {}

/// Bytes of a page, the unit of pinning.
const PAGE: usize = 4096;

impl HostMemory {
    /// Allocates `bytes` zeros. They have pages of their own: pinning would also pin anything else
    /// in the last page.
    pub fn new(bytes: usize) -> Self {
        // Aligned by hand: the system has zeros ready for small alignments only, and for pages one
        // thread would write them.
        let pages = bytes.max(1).checked_next_multiple_of(PAGE);
        let size = pages.and_then(|pages| pages.checked_add(PAGE)).unwrap_or(usize::MAX);
        let Ok(layout) = Layout::from_size_align(size, 16) else {
            handle_alloc_error(Layout::new::<u8>()) // more than half of all addresses
        };
        // SAFETY: the layout has a size above 0.
        let start = unsafe { alloc_zeroed(layout) };
        if start.is_null() {
            handle_alloc_error(layout);
        }
        let before = (start as usize).next_multiple_of(PAGE) - start as usize;
        // SAFETY: less than a page is skipped, and the allocation is a page longer than the bytes.
        Self { first: unsafe { start.add(before) }, bytes, owner: Owner::Allocation(start, layout) }
    }

    /// Wraps memory that several processes share.
    ///
    /// # Safety
    ///
    /// From `first`, a multiple of 16, `bytes` bytes stay valid as long as this value is used.
    pub unsafe fn shared(first: *mut u8, bytes: usize) -> Self {
        Self { first, bytes, owner: Owner::Elsewhere }
    }

    /// Wraps records that are only read.
    pub fn lent(records: LentRecords) -> Self {
        let (first, bytes) = (records.first.cast_mut(), records.bytes);
        Self { first, bytes, owner: Owner::Records(records) }
    }

    /// Returns whether the bytes are lent records, to which no one may write.
    pub fn is_lent(&self) -> bool {
        matches!(self.owner, Owner::Records(_))
    }

    /// Returns the address of the first byte, a multiple of 16.
    pub fn first(&self) -> *mut u8 {
        self.first
    }

    /// Returns the number of bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

impl Drop for HostMemory {
    fn drop(&mut self) {
        if let Owner::Allocation(start, layout) = self.owner {
            // SAFETY: `new` allocated it with this layout.
            unsafe { dealloc(start, layout) };
        }
    }
}

/// Records in host memory that devices copy to.
#[derive(Debug)]
pub struct HostRecords<T> {
    memory: Arc<HostMemory>,
    count: usize,
    of: PhantomData<T>,
}

impl<T: Pod + Zeroable> HostRecords<T> {
    /// Allocates `count` records of zeros.
    pub fn new(count: usize) -> Self {
        const { assert!(align_of::<T>() <= PAGE) };
        let memory = Arc::new(HostMemory::new(count.saturating_mul(size_of::<T>())));
        Self { memory, count, of: PhantomData }
    }

    /// Sets the number of records, and allocates other memory if there is too little. The records'
    /// values are then unspecified.
    pub fn resize(&mut self, count: usize) {
        if count.saturating_mul(size_of::<T>()) > self.memory.bytes() {
            *self = Self::new(count);
        }
        self.count = count;
    }

    /// Returns the memory, for [`Device::pin`](crate::Device::pin). Only the owner of
    /// the records may write to it.
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
        // SAFETY: the memory has `count` records, any bytes are valid ones, and whoever else holds
        // the memory leaves it to this value.
        unsafe { std::slice::from_raw_parts(self.memory.first().cast(), self.count) }
    }
}

impl<T: Pod> DerefMut for HostRecords<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: the memory has `count` records, any bytes are valid ones, and whoever else holds
        // the memory leaves it to this value.
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
        for bytes in [0, 1, PAGE - 1, PAGE, PAGE + 1, 1 << 21] {
            assert_eq!(HostMemory::new(bytes).first() as usize % PAGE, 0, "{bytes}");
        }
    }
}
