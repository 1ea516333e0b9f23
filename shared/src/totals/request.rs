//! Requests of a number of samples by tile.
#![allow(unsafe_code, reason = "see buffer")]

use super::{Place, TotalsParams};
use crate::buffer::{SharedSlice, store_shared};
use crate::film::PixelSums;

/// Writes the index of a pixel's first sample to its record, from where a render kernel with
/// [`FLAG_PER_PIXEL_RANGE`](crate::params::FLAG_PER_PIXEL_RANGE) takes it: all tiles end at the
/// parameters' `first_sample`.
///
/// # Safety
///
/// As [`add_chunk`](super::add_chunk).
#[inline(always)]
pub unsafe fn request_samples(
    params: &TotalsParams,
    sums: &mut SharedSlice<PixelSums>,
    counts: &SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let pixel = Place::of(params, x, y).pixel;
    // SAFETY: the caller's promise.
    unsafe {
        let samples = params.first_sample - params.samples_of_pixel(counts, x, y);
        store_shared::<PixelSums>(sums, pixel, PixelSums { samples, ..PixelSums::UNWRITTEN });
    }
}
