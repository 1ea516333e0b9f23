//! Counts of the samples and segments of a chunk.
#![allow(unsafe_code, reason = "see buffer")]

use super::{COUNT_WORDS, COUNTED_ROWS, Place, TotalsParams};
use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::film::PixelSums;

/// Counts of a lane's pixels. Numbers of two words have the lower one first.
#[derive(Clone, Copy)]
struct Counts {
    samples: (u32, u32),
    rejected: (u32, u32),
    segments: (u32, u32),
    unwritten: u32,
}

/// Adds to a number of two words.
#[inline(always)]
fn plus(number: (u32, u32), more: u32) -> (u32, u32) {
    let sum = number.0.wrapping_add(more);
    (sum, number.1 + if sum < more { 1 } else { 0 })
}

impl Counts {
    /// Reads them from the [`COUNT_WORDS`] words of a thread, the first of which is `at`.
    #[inline(always)]
    unsafe fn read(counts: &SharedSlice<u32>, at: u32) -> Self {
        // SAFETY: the caller's promise.
        unsafe {
            Self {
                samples: (load_shared::<u32>(counts, at), load_shared::<u32>(counts, at + 1)),
                rejected: (load_shared::<u32>(counts, at + 2), load_shared::<u32>(counts, at + 3)),
                segments: (load_shared::<u32>(counts, at + 4), load_shared::<u32>(counts, at + 5)),
                unwritten: load_shared::<u32>(counts, at + 6),
            }
        }
    }

    /// Writes them to the same words.
    #[inline(always)]
    unsafe fn write(self, counts: &mut SharedSlice<u32>, at: u32) {
        // SAFETY: the caller's promise.
        unsafe {
            store_shared::<u32>(counts, at, self.samples.0);
            store_shared::<u32>(counts, at + 1, self.samples.1);
            store_shared::<u32>(counts, at + 2, self.rejected.0);
            store_shared::<u32>(counts, at + 3, self.rejected.1);
            store_shared::<u32>(counts, at + 4, self.segments.0);
            store_shared::<u32>(counts, at + 5, self.segments.1);
            store_shared::<u32>(counts, at + 6, self.unwritten);
        }
    }
}

/// Returns the rows of the launch that thread row `y` counts: the first, and one past the last.
#[inline(always)]
fn counted_rows(params: &TotalsParams, y: u32) -> (u32, u32) {
    let first = y * COUNTED_ROWS;
    let last = first + COUNTED_ROWS;
    (first, if last < params.rows { last } else { params.rows })
}

/// Adds samples and segments of a chunk, in [`COUNTED_ROWS`] pixels of column `x`, to the thread's
/// counts. It leaves the chunk as it is.
///
/// # Safety
///
/// As [`add_chunk`](super::add_chunk); there are [`COUNT_WORDS`] words for each thread with rows
/// to count. Others access nothing.
#[inline(always)]
pub unsafe fn count_chunk(
    params: &TotalsParams,
    sums: &SharedSlice<PixelSums>,
    counts: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let (mut row, end) = counted_rows(params, y);
    if row >= end {
        return;
    }
    let at = (y * params.width + x) * COUNT_WORDS;
    // SAFETY: the caller's promise.
    unsafe {
        let mut own = Counts::read(counts, at);
        while row < end {
            let chunk = load_shared::<PixelSums>(sums, Place::of(params, x, row).pixel);
            if chunk.samples > params.samples {
                own.unwritten += 1;
            } else {
                own.samples = plus(own.samples, chunk.samples);
                own.rejected = plus(own.rejected, params.samples - chunk.samples);
                own.segments = plus(own.segments, chunk.segments);
            }
            row += 1;
        }
        own.write(counts, at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    /// Number of threads of a workgroup down.
    const THREADS: usize = 8;

    type Words = [u32; THREADS * COUNT_WORDS as usize];

    /// Counts a chunk of one pixel, as often as asked, with the threads of a workgroup. Returns the
    /// words of all threads.
    fn count(chunk: PixelSums, times: u32, mut words: Words) -> Words {
        let samples = 256;
        let params =
            TotalsParams { width: 1, height: 1, rows: 1, block_shift: 31, samples, ..Zeroable::zeroed() };
        let mut chunk = [chunk];
        // SAFETY: the arrays have a record for the pixel, and words for all threads.
        unsafe {
            let sums = SharedSlice::new(chunk.as_mut_ptr(), chunk.len());
            let mut counts = SharedSlice::new(words.as_mut_ptr(), words.len());
            for _ in 0..times {
                (0..THREADS as u32).for_each(|y| count_chunk(&params, &sums, &mut counts, 0, y));
            }
        }
        words
    }

    /// Launches have whole workgroups, so that some threads have no rows.
    #[test]
    fn threads_without_rows_write_nothing() {
        let mut words = [u32::MAX; THREADS * COUNT_WORDS as usize];
        words[..COUNT_WORDS as usize].fill(0);
        let words = count(PixelSums::zeroed(), 1, words);
        let (own, others) = words.split_at(COUNT_WORDS as usize);
        assert_eq!(own, [0, 0, 256, 0, 0, 0, 0]);
        assert!(others.iter().all(|&word| word == u32::MAX), "{others:?}");
    }

    /// Counts of several chunks carry into their upper words.
    #[test]
    fn counts_carry() {
        let mut words = [0; THREADS * COUNT_WORDS as usize];
        (words[0], words[2], words[6]) = (u32::MAX - 99, u32::MAX, 5);
        let chunk = PixelSums { samples: 200, segments: 1 << 31, ..PixelSums::zeroed() };
        let words = count(chunk, 3, words);
        assert_eq!(words[..COUNT_WORDS as usize], [500, 1, 167, 1, 1 << 31, 1, 5]);
        let words = count(PixelSums::UNWRITTEN, 2, words);
        assert_eq!(words[..COUNT_WORDS as usize], [500, 1, 167, 1, 1 << 31, 1, 7]);
    }
}
