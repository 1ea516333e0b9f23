//! Totals as the sums of a chunk, rounded to f32.
#![allow(unsafe_code, reason = "see buffer")]

use super::{Place, SAMPLES, SEGMENTS, STATES, SUMS, TotalsParams, UNWRITTEN};
use crate::buffer::{SharedSlice, load_local, store_local, store_shared};
use crate::film::PixelSums;
use core::mem::MaybeUninit;
use glam::Vec3;

/// Writes a pixel's totals as sums of a chunk to the records of the parameters' half, of two halves
/// one after the other; counts beyond 32 bits are the greatest number. A pixel without samples, or
/// that lacks some, has 0 samples and NaN.
///
/// # Safety
///
/// As [`add_chunk`](super::add_chunk), with two records for each pixel of the image.
#[inline(always)]
pub unsafe fn write_sums(
    params: &TotalsParams,
    totals: &SharedSlice<u32>,
    sums: &mut SharedSlice<PixelSums>,
    x: u32,
    y: u32,
) {
    let place = Place::of(params, x, y);
    let at = params.half * place.pixels + place.pixel;
    // SAFETY: the caller's promise.
    unsafe {
        let samples = place.load(totals, SAMPLES);
        let rejected = place.load(totals, SAMPLES + 1);
        let unwritten = place.load(totals, UNWRITTEN);
        if unwritten > 0 || samples | rejected == 0 {
            store_shared::<PixelSums>(sums, at, PixelSums { samples: 0, ..PixelSums::UNWRITTEN });
            return;
        }
        let states = place.load(totals, STATES);
        let mut rounded = MaybeUninit::<[u32; SUMS as usize]>::uninit();
        // A loop, so that the kernel has the code once.
        let mut sum = 0;
        while sum < SUMS {
            let state = states >> (2 * sum) & 3;
            let bits = if state == 0 {
                place.sum(sum).single(totals)
            } else if state == 1 {
                0x7f80_0000
            } else if state == 2 {
                0xff80_0000
            } else {
                0x7fc0_0000
            };
            store_local(&mut rounded, sum, bits);
            sum += 1;
        }
        let number = |sum: u32| f32::from_bits(load_local(&rounded, sum));
        let segments = place.load(totals, SEGMENTS);
        let has_more = place.load(totals, SEGMENTS + 1) > 0;
        let pixel = PixelSums {
            radiance: Vec3::new(number(0), number(1), number(2)),
            samples,
            squares: Vec3::new(number(3), number(4), number(5)),
            segments: if has_more { u32::MAX } else { segments },
        };
        store_shared::<PixelSums>(sums, at, pixel);
    }
}
