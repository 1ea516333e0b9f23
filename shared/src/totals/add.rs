//! Addition of a chunk to the totals.
#![allow(unsafe_code, reason = "see buffer")]

use super::fixed_point::LIMBS;
use super::{ALL_NAN, AOV_SUMS, CHUNK, PRIMITIVE, Place, SEGMENTS, TotalsParams, UNWRITTEN};
use crate::aovs::AovSums;
use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::film::PixelSums;
use glam::Vec3;

/// Returns component `index` of a vector.
#[inline(always)]
fn component(of: Vec3, index: u32) -> f32 {
    if index == 0 {
        of.x
    } else if index == 1 {
        of.y
    } else {
        of.z
    }
}

/// Sums of a pixel's chunk, in the order of its totals.
struct Terms {
    radiance_or_normal: Vec3,
    squares_or_albedo: Vec3,
    position: Vec3,
    emission: Vec3,
    diffuse: f32,
    /// Samples and rejected samples, or hits and misses.
    counts: (u32, u32),
    /// False if no kernel wrote them.
    written: bool,
}

impl Terms {
    #[inline(always)]
    fn of_sums(chunk: PixelSums, samples: u32) -> Self {
        Self {
            radiance_or_normal: chunk.radiance,
            squares_or_albedo: chunk.squares,
            position: Vec3::ZERO,
            emission: Vec3::ZERO,
            diffuse: 0.0,
            counts: (chunk.samples, samples.wrapping_sub(chunk.samples)),
            written: chunk.samples <= samples,
        }
    }

    #[inline(always)]
    fn of_aovs(chunk: AovSums, samples: u32) -> Self {
        Self {
            radiance_or_normal: chunk.normal,
            squares_or_albedo: chunk.albedo,
            position: chunk.position,
            emission: chunk.emission,
            diffuse: chunk.diffuse,
            counts: (chunk.hits, chunk.misses),
            written: chunk.hits <= samples && chunk.misses <= samples,
        }
    }

    #[inline(always)]
    fn get(&self, sum: u32) -> f32 {
        let vector = if sum < 3 {
            self.radiance_or_normal
        } else if sum < 6 {
            self.squares_or_albedo
        } else if sum < 9 {
            self.position
        } else if sum < 12 {
            self.emission
        } else {
            return self.diffuse;
        };
        component(vector, sum % 3)
    }
}

/// Adds a pixel's sums over a chunk to its totals, and resets the chunk's record to
/// [`PixelSums::UNWRITTEN`]; with [`AOV_SUMS`] sums in the parameters its AOV sums to its AOV
/// totals, and to [`AovSums::UNWRITTEN`]. A chunk that no kernel wrote makes the sums NaN. If each
/// tile has its own number of samples, in `counts`, a chunk of none is only reset.
///
/// # Safety
///
/// The thread is one of the launch's; the arrays have a record and words for each pixel of the
/// image, and no other lane accesses those of this pixel.
#[inline(always)]
pub unsafe fn add_chunk(
    params: &TotalsParams,
    sums: &mut SharedSlice<PixelSums>,
    aovs: &mut SharedSlice<AovSums>,
    totals: &mut SharedSlice<u32>,
    counts: &SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let place = Place::of(params, x, y);
    let of_aovs = params.sums == AOV_SUMS;
    let states = params.sums * LIMBS;
    // SAFETY: the caller's promise.
    unsafe {
        let samples = params.samples_of_pixel(counts, x, y);
        let (terms, last);
        if of_aovs {
            let chunk = load_shared::<AovSums>(aovs, place.pixel);
            store_shared::<AovSums>(aovs, place.pixel, AovSums::UNWRITTEN);
            (terms, last) = (Terms::of_aovs(chunk, samples), chunk.primitive);
        } else {
            let chunk = load_shared::<PixelSums>(sums, place.pixel);
            store_shared::<PixelSums>(sums, place.pixel, PixelSums::UNWRITTEN);
            (terms, last) = (Terms::of_sums(chunk, samples), chunk.segments);
        }
        if samples == 0 {
            return;
        }
        if !terms.written {
            place.store(totals, states, ALL_NAN);
            if !of_aovs {
                place.count(totals, UNWRITTEN, samples);
            }
            return;
        }
        // A loop, so that the kernel has the code of an addition once.
        let mut sum = 0;
        while sum < params.sums {
            place.add(totals, sum, terms.get(sum), states);
            sum += 1;
        }
        place.count(totals, states + 1, terms.counts.0);
        place.count(totals, states + 2, terms.counts.1);
        if !of_aovs {
            if place.count(totals, SEGMENTS, last) {
                place.count(totals, SEGMENTS + 1, 1);
            }
        } else if terms.counts.0 > 0 && params.first_sample < !place.load(totals, CHUNK) {
            // Of the chunks with a hit the first names the primitive. Inverses, so that zeros stand
            // for no primitive, and for a chunk after all others.
            place.store(totals, PRIMITIVE, !last);
            place.store(totals, CHUNK, !params.first_sample);
        }
    }
}
