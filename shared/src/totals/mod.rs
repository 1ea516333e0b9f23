//! Totals of a film on a device: chunks add up there exactly, and the host reads the totals.
//!
//! A total is a column of words, one in each plane of the image. Words of zeros are a film without
//! samples. What the host reads has the bits of its own exact sums of the same chunks
//! (docs/explanation/exact-sums.md).
#![allow(unsafe_code, reason = "see buffer")]

pub mod fixed_point;

use crate::aovs::AovSums;
use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::film::PixelSums;
use crate::params::row_of_share;
use bytemuck::{Pod, Zeroable};
use fixed_point::{Accumulator, DoubleWords, LIMBS};
use glam::Vec3;

/// Launch of a kernel of the film's totals: `rows` rows of a share of the image. 48 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct TotalsParams {
    /// Pixels across the whole image.
    pub width: u32,
    /// Pixels down the whole image.
    pub height: u32,
    /// First row of the launch, counted in the rows of the share.
    pub first_row: u32,
    /// Number of rows of the launch.
    pub rows: u32,
    /// Image row of the share's first row.
    pub share_first_row: u32,
    /// Base-2 logarithm of the rows of a block of the share; 31 if the share is one block.
    pub block_shift: u32,
    /// Number of rows between two blocks of the share.
    pub block_gap: u32,
    /// Index of the chunk's first sample.
    pub first_sample: u32,
    /// Number of samples that each pixel of the chunk should hold.
    pub samples: u32,
    /// Number of sums that [`write_totals`] writes: [`RADIANCE_SUMS`], [`SUMS`] or [`AOV_SUMS`].
    pub sums: u32,
    /// Unused.
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
}

const _: () = assert!(size_of::<TotalsParams>() == 48);

/// Number of sums of a pixel's radiance, the first of its totals.
pub const RADIANCE_SUMS: u32 = 3;

/// Number of sums of a pixel's totals: radiance and its squares, by channel.
pub const SUMS: u32 = 6;

/// Number of sums of a pixel's AOV totals: normal, albedo, position and emission, by component, and
/// diffuseness.
pub const AOV_SUMS: u32 = 13;

/// Number of words of a pixel's totals: sums, states, samples, rejected samples, unwritten samples,
/// and two for segments.
pub const TOTAL_WORDS: u32 = SUMS * LIMBS + 6;

/// Number of words of a pixel's AOV totals: sums, states, hits, misses, and the inverses of the
/// primitive and of its chunk.
pub const AOV_TOTAL_WORDS: u32 = AOV_SUMS * LIMBS + 5;

/// Number of words that the host reads for a pixel's radiance: two f64 for each sum, and a u64.
pub const READ_RADIANCE_WORDS: u32 = 4 * RADIANCE_SUMS + 2;

/// Number of words that the host reads for a pixel's totals: two f64 for each sum, and four u64.
pub const READ_WORDS: u32 = 4 * SUMS + 8;

/// Number of words that the host reads for a pixel's AOV totals: two f64 for each sum, two u64 and
/// two u32.
pub const READ_AOV_WORDS: u32 = 4 * AOV_SUMS + 6;

/// Number of rows whose pixels of one column a lane counts.
pub const COUNTED_ROWS: u32 = 128;

/// Number of words of a lane's counts: samples, rejected samples, pixels that no kernel wrote, and
/// two for segments.
pub const COUNT_WORDS: u32 = 5;

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

/// Bits for each sum: whether it has a term of +infinity, and of -infinity. NaN is both.
type States = u32;

/// State of all sums that are NaN.
const ALL_NAN: States = u32::MAX;

/// A pixel's words.
#[derive(Clone, Copy)]
struct Place {
    /// Index of the pixel in the image.
    pixel: u32,
    /// Number of the image's pixels.
    pixels: u32,
}

impl Place {
    /// Returns the place of the pixel of a launch's thread.
    #[inline(always)]
    fn of(params: &TotalsParams, x: u32, y: u32) -> Self {
        Self { pixel: params.row(y) * params.width + x, pixels: params.width * params.height }
    }

    #[inline(always)]
    fn sum(self, index: u32) -> Accumulator {
        Accumulator { first: index * LIMBS * self.pixels + self.pixel, stride: self.pixels }
    }

    /// Returns the pixel's word of a plane.
    #[inline(always)]
    unsafe fn load(self, words: &SharedSlice<u32>, plane: u32) -> u32 {
        // SAFETY: the caller's promise.
        unsafe { load_shared::<u32>(words, plane * self.pixels + self.pixel) }
    }

    /// Writes the pixel's word of a plane.
    #[inline(always)]
    unsafe fn store(self, words: &mut SharedSlice<u32>, plane: u32, value: u32) {
        // SAFETY: the caller's promise.
        unsafe { store_shared::<u32>(words, plane * self.pixels + self.pixel, value) }
    }

    /// Adds a term to a sum.
    #[inline(always)]
    unsafe fn add(self, words: &mut SharedSlice<u32>, index: u32, term: f32, states: u32) {
        let bits = term.to_bits();
        // SAFETY: the caller's promise.
        unsafe {
            if bits & 0x7f80_0000 != 0x7f80_0000 {
                self.sum(index).add(words, term);
            } else {
                let infinite = if bits >> 31 == 0 { 1 } else { 2 };
                let state = if bits & 0x007f_ffff == 0 { infinite } else { 3 };
                let state = self.load(words, states) | state << (2 * index);
                self.store(words, states, state);
            }
        }
    }

    /// Adds to a word. Returns whether it overflowed.
    #[inline(always)]
    unsafe fn count(self, words: &mut SharedSlice<u32>, plane: u32, more: u32) -> bool {
        // SAFETY: the caller's promise.
        unsafe {
            let sum = self.load(words, plane).wrapping_add(more);
            self.store(words, plane, sum);
            sum < more
        }
    }

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

impl TotalsParams {
    /// Returns the image row of row `index` of the launch.
    #[inline(always)]
    pub fn row(&self, index: u32) -> u32 {
        row_of_share(self.share_first_row, self.block_shift, self.block_gap, self.first_row + index)
    }
}

const STATES: u32 = SUMS * LIMBS;
const SAMPLES: u32 = STATES + 1;
const REJECTED: u32 = STATES + 2;
const UNWRITTEN: u32 = STATES + 3;
const SEGMENTS: u32 = STATES + 4;

/// Adds a pixel's sums over a chunk to its totals, and makes the chunk's record
/// [`PixelSums::UNWRITTEN`]. A chunk that no kernel wrote makes the sums NaN.
///
/// # Safety
///
/// The thread is one of the launch's; the arrays have a record and words for each pixel of the
/// image, and no other lane accesses those of this pixel.
#[inline(always)]
pub unsafe fn add_chunk(
    params: &TotalsParams,
    sums: &mut SharedSlice<PixelSums>,
    totals: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let place = Place::of(params, x, y);
    // SAFETY: the caller's promise.
    unsafe {
        let chunk = load_shared::<PixelSums>(sums, place.pixel);
        store_shared::<PixelSums>(sums, place.pixel, PixelSums::UNWRITTEN);
        if chunk.samples > params.samples {
            place.store(totals, STATES, ALL_NAN);
            place.count(totals, UNWRITTEN, params.samples);
            return;
        }
        // A loop, so that the kernel has the code of an addition once.
        let mut sum = 0;
        while sum < SUMS {
            let of = if sum < 3 { chunk.radiance } else { chunk.squares };
            place.add(totals, sum, component(of, sum % 3), STATES);
            sum += 1;
        }
        place.count(totals, SAMPLES, chunk.samples);
        place.count(totals, REJECTED, params.samples - chunk.samples);
        if place.count(totals, SEGMENTS, chunk.segments) {
            place.count(totals, SEGMENTS + 1, 1);
        }
    }
}

const AOV_STATES: u32 = AOV_SUMS * LIMBS;
const HITS: u32 = AOV_STATES + 1;
const MISSES: u32 = AOV_STATES + 2;
const PRIMITIVE: u32 = AOV_STATES + 3;
const CHUNK: u32 = AOV_STATES + 4;

/// Adds a pixel's AOV sums over a chunk to its totals, as [`add_chunk`] does.
///
/// # Safety
///
/// As [`add_chunk`].
#[inline(always)]
pub unsafe fn add_chunk_aovs(
    params: &TotalsParams,
    aovs: &mut SharedSlice<AovSums>,
    totals: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let place = Place::of(params, x, y);
    // SAFETY: the caller's promise.
    unsafe {
        let chunk = load_shared::<AovSums>(aovs, place.pixel);
        store_shared::<AovSums>(aovs, place.pixel, AovSums::UNWRITTEN);
        if chunk.hits > params.samples || chunk.misses > params.samples {
            place.store(totals, AOV_STATES, ALL_NAN);
            return;
        }
        let mut sum = 0;
        while sum < AOV_SUMS {
            let of = if sum < 3 {
                chunk.normal
            } else if sum < 6 {
                chunk.albedo
            } else if sum < 9 {
                chunk.position
            } else if sum < 12 {
                chunk.emission
            } else {
                Vec3::splat(chunk.diffuse)
            };
            place.add(totals, sum, component(of, sum % 3), AOV_STATES);
            sum += 1;
        }
        place.count(totals, HITS, chunk.hits);
        place.count(totals, MISSES, chunk.misses);
        // Of the chunks with a hit the first names the primitive. Inverses, so that zeros stand for
        // no primitive, and for a chunk after all others.
        if chunk.hits > 0 && params.first_sample < !place.load(totals, CHUNK) {
            place.store(totals, PRIMITIVE, !chunk.primitive);
            place.store(totals, CHUNK, !params.first_sample);
        }
    }
}

/// Writes a pixel's totals as the host's record: [`READ_RADIANCE_WORDS`] words for the radiance and
/// the number of samples, [`READ_WORDS`] for all totals, [`READ_AOV_WORDS`] for AOV totals. The
/// launch's rows are packed.
///
/// # Safety
///
/// As [`add_chunk`]; the output has a record for each pixel of the launch.
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
/// As [`add_chunk`]; the output has [`COUNT_WORDS`] words for each thread.
#[inline(always)]
pub unsafe fn count_chunk(
    params: &TotalsParams,
    sums: &SharedSlice<PixelSums>,
    output: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let (mut row, end) = counted_rows(params, y);
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
