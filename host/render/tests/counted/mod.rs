//! A global allocator that counts bytes, for tests and examples that measure memory: the counts do
//! not depend on the machine.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Global allocator that counts the allocated bytes. A reallocation counts twice while it lasts,
/// because it may copy.
struct Counted;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

impl Counted {
    fn more(bytes: usize) {
        let now = NOW.fetch_add(bytes, Relaxed) + bytes;
        PEAK.fetch_max(now, Relaxed);
    }
}

// SAFETY: each call is passed to the system's allocator unchanged.
#[allow(unsafe_code, reason = "counts what is allocated")]
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::more(size);
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counted = Counted;

/// Bytes that a process held more than before.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// At the peak.
    pub peak: usize,
    /// At the end.
    #[allow(dead_code, reason = "not all who measure ask for it")]
    pub kept: usize,
}

/// Runs `what`. Returns what it made, and how many bytes it held. Other threads count, too.
pub fn held<T>(what: impl FnOnce() -> T) -> (T, Held) {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    let made = what();
    let of = |count: &AtomicUsize| count.load(Relaxed).saturating_sub(before);
    (made, Held { peak: of(&PEAK), kept: of(&NOW) })
}
