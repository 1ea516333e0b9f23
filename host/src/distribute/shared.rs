//! Memory that the ranks of one host share.
#![allow(unsafe_code, reason = "other processes write there; each block names why it is sound")]

use crate::film::Rows;
use rayon::prelude::*;

/// Words that all ranks on the root's host can read and write: frames of an image, one after the other. They live as long as the network's window.
#[derive(Clone, Copy, Debug)]
pub struct Shared {
    pointer: *mut u32,
    words: usize,
}

// SAFETY: the memory belongs to no thread; who reads and writes when, ranks agree on by messages.
unsafe impl Send for Shared {}

/// A pointer for several threads, which write different rows.
#[derive(Clone, Copy)]
struct Place(*mut u32);

// SAFETY: as its only user says.
unsafe impl Sync for Place {}

impl Place {
    fn get(&self) -> *mut u32 {
        self.0
    }
}

impl Shared {
    /// Of a window.
    ///
    /// # Safety
    ///
    /// So many words lie there, as long as anything is read or written by this.
    #[cfg(feature = "mpi")]
    pub(super) unsafe fn new(pointer: *mut u32, words: usize) -> Self {
        Self { pointer, words }
    }

    /// Writes rows of an image so wide, whose first word is `first`. No one else may read or write these rows meanwhile; nothing is written where they do not fit.
    pub(super) fn write(&self, first: usize, width: usize, rows: &Rows, pixels: &[u32]) {
        let fits = first.saturating_add(rows.end() as usize * width) <= self.words;
        if !fits || pixels.len() != rows.len() as usize * width {
            return;
        }
        let rows: Vec<u32> = rows.iter().collect();
        let place = Place(self.pointer);
        pixels.par_chunks_exact(width.max(1)).zip(rows).with_min_len(32).for_each(|(pixels, row)| {
            // SAFETY: the row is within the window, as was checked, and each row is written by one task; ranks agree on who has which rows of which
            // frame, and wait for the root's word before they write over one.
            unsafe {
                let to = place.get().add(first + row as usize * width);
                std::ptr::copy_nonoverlapping(pixels.as_ptr(), to, pixels.len());
            }
        });
        std::sync::atomic::fence(std::sync::atomic::Ordering::SeqCst);
    }

    /// An image that all have written and that no one writes until the root says so.
    pub(super) fn read(&self, first: usize, words: usize) -> &[u32] {
        std::sync::atomic::fence(std::sync::atomic::Ordering::SeqCst);
        if first.saturating_add(words) > self.words {
            return &[];
        }
        // SAFETY: within the window; whoever writes there has said that it is done, and waits.
        unsafe { std::slice::from_raw_parts(self.pointer.add(first), words) }
    }
}
