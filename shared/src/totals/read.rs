//! Totals as the host reads them.
#![allow(unsafe_code, reason = "see buffer")]

use super::double_words::DoubleWords;
use super::{
    ALL_NAN, AOV_SUMS, HITS, Place, RADIANCE_SUMS, READ_AOV_WORDS, READ_RADIANCE_WORDS, READ_WORDS, SAMPLES,
    States, TotalsParams,
};
use crate::buffer::{SharedSlice, store_shared};

impl Place {
    /// Writes a sum as two f64 to four words from `at` on.
    #[inline(always)]
    unsafe fn write_sum(
        self,
        words: &SharedSlice<u32>,
        index: u32,
        state: States,
        output: &mut SharedSlice<u32>,
        at: u32,
    ) {
        // SAFETY: the caller's promise.
        let (mut high, mut low) = unsafe { self.sum(index).pair(words) };
        let state = state >> (2 * index) & 3;
        if state != 0 {
            let special = if state == 3 {
                0x7ff8_0000
            } else if state == 1 {
                0x7ff0_0000
            } else {
                0xfff0_0000
            };
            (high, low) = (DoubleWords { low: 0, high: special }, DoubleWords { low: 0, high: 0 });
        }
        // SAFETY: the caller's promise.
        unsafe {
            store_shared::<u32>(output, at, high.low);
            store_shared::<u32>(output, at + 1, high.high);
            store_shared::<u32>(output, at + 2, low.low);
            store_shared::<u32>(output, at + 3, low.high);
        }
    }
}

/// Writes a pixel's totals as the host's record: [`READ_RADIANCE_WORDS`] words for the radiance and
/// the number of samples, [`READ_WORDS`] for all totals, [`READ_AOV_WORDS`] for AOV totals. The
/// launch's rows are packed.
///
/// # Safety
///
/// As [`add_chunk`](super::add_chunk); the output has a record for each pixel of the launch.
#[inline(always)]
pub unsafe fn write_totals(
    params: &TotalsParams,
    totals: &SharedSlice<u32>,
    output: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let place = Place::of(params, x, y);
    let (sums, of_aovs) = (params.sums, params.sums == AOV_SUMS);
    let of_radiance = sums == RADIANCE_SUMS;
    let words = if of_aovs {
        READ_AOV_WORDS
    } else if of_radiance {
        READ_RADIANCE_WORDS
    } else {
        READ_WORDS
    };
    let at = (y * params.width + x) * words;
    let first = if of_aovs { HITS } else { SAMPLES };
    // SAFETY: the caller's promise.
    unsafe {
        // Samples, rejected and unwritten ones; or hits, misses and a primitive.
        let counts =
            (place.load(totals, first), place.load(totals, first + 1), place.load(totals, first + 2));
        // Before the first chunk the sums are NaN, so that a pixel without samples is visible.
        let is_empty = !of_aovs && counts.0 | counts.1 | counts.2 == 0;
        let states = if is_empty { ALL_NAN } else { place.load(totals, first - 1) };
        let mut sum = 0;
        while sum < sums {
            place.write_sum(totals, sum, states, output, at + 4 * sum);
            sum += 1;
        }
        let at = at + 4 * sums;
        store_shared::<u32>(output, at, counts.0);
        store_shared::<u32>(output, at + 1, 0);
        if of_radiance {
            return;
        }
        store_shared::<u32>(output, at + 2, counts.1);
        store_shared::<u32>(output, at + 3, 0);
        let last = place.load(totals, first + 3);
        if of_aovs {
            store_shared::<u32>(output, at + 4, !counts.2);
            store_shared::<u32>(output, at + 5, !last);
        } else {
            store_shared::<u32>(output, at + 4, last);
            store_shared::<u32>(output, at + 5, place.load(totals, first + 4));
            store_shared::<u32>(output, at + 6, counts.2);
            store_shared::<u32>(output, at + 7, 0);
        }
    }
}
