//! Counts of the samples and segments of a chunk.
#![allow(unsafe_code, reason = "see buffer")]

use super::{COUNT_WORDS, COUNTED_ROWS, Place, TotalsParams};
use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::film::PixelSums;

/// Counts of a lane's pixels. Numbers of two words have the lower one first.
#[derive(Clone, Copy)]
struct Counts {
    samples: u32,
    rejected: u32,
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
    const ZERO: Self = Self { samples: 0, rejected: 0, segments: (0, 0), unwritten: 0 };

    /// Writes them to the [`COUNT_WORDS`] words of a thread.
    #[inline(always)]
    unsafe fn write(self, params: &TotalsParams, output: &mut SharedSlice<u32>, x: u32, y: u32) {
        let at = (y * params.width + x) * COUNT_WORDS;
        // SAFETY: the caller's promise.
        unsafe {
            store_shared::<u32>(output, at, self.samples);
            store_shared::<u32>(output, at + 1, self.rejected);
            store_shared::<u32>(output, at + 2, self.unwritten);
            store_shared::<u32>(output, at + 3, self.segments.0);
            store_shared::<u32>(output, at + 4, self.segments.1);
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

/// Counts samples and segments of a chunk, in [`COUNTED_ROWS`] pixels of column `x`. It leaves the
/// chunk as it is.
///
/// # Safety
///
/// As [`add_chunk`](super::add_chunk); the output has [`COUNT_WORDS`] words for each thread with
/// rows to count. Others write nothing.
#[inline(always)]
pub unsafe fn count_chunk(
    params: &TotalsParams,
    sums: &SharedSlice<PixelSums>,
    output: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let (mut row, end) = counted_rows(params, y);
    if row >= end {
        return;
    }
    let mut counts = Counts::ZERO;
    // SAFETY: the caller's promise.
    unsafe {
        while row < end {
            let chunk = load_shared::<PixelSums>(sums, Place::of(params, x, row).pixel);
            if chunk.samples > params.samples {
                counts.unwritten += 1;
            } else {
                counts.samples += chunk.samples;
                counts.rejected += params.samples - chunk.samples;
                counts.segments = plus(counts.segments, chunk.segments);
            }
            row += 1;
        }
        counts.write(params, output, x, y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    /// Launches have whole workgroups, so that some threads have no rows.
    #[test]
    fn threads_without_rows_write_nothing() {
        let params = TotalsParams { width: 1, height: 1, rows: 1, block_shift: 31, ..Zeroable::zeroed() };
        let mut chunk = [PixelSums::zeroed()];
        let mut output = [u32::MAX; 8 * COUNT_WORDS as usize];
        // SAFETY: the arrays have a record for the pixel, and words for eight threads.
        unsafe {
            let sums = SharedSlice::new(chunk.as_mut_ptr(), chunk.len());
            let mut counts = SharedSlice::new(output.as_mut_ptr(), output.len());
            (0..8).for_each(|y| count_chunk(&params, &sums, &mut counts, 0, y));
        }
        let (own, others) = output.split_at(COUNT_WORDS as usize);
        assert_eq!(own, [0; COUNT_WORDS as usize]);
        assert!(others.iter().all(|&word| word == u32::MAX), "{others:?}");
    }
}
