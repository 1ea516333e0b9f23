//! Totals of a film on a device: chunks add up there exactly, and the host reads the totals.
//!
//! A total is a column of words, one in each plane of the image. Words of zeros are a film without
//! samples. What the host reads has the bits of its own exact sums of the same chunks
//! (docs/explanation/exact-sums.md).
#![allow(unsafe_code, reason = "see buffer")]

mod add;
mod count;
pub mod double_words;
pub mod fixed_point;
mod noise;
mod read;
mod request;
mod sums;

pub use add::add_chunk;
pub use count::count_chunk;
pub use noise::write_noise;
pub use read::write_totals;
pub use request::request_samples;
pub use sums::write_sums;

use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::params::row_of_share;
use bytemuck::{Pod, Zeroable};
use fixed_point::{Accumulator, LIMBS};

/// Launch of a kernel of the film's totals: `rows` rows of a share of the image. 64 bytes.
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
    /// Index of the chunk's first sample; of samples by tiles, one past the last.
    pub first_sample: u32,
    /// Number of samples that each pixel of the chunk should hold.
    pub samples: u32,
    /// Number of sums to add or write: [`SUMS`] or [`AOV_SUMS`]; to write also [`RADIANCE_SUMS`].
    pub sums: u32,
    /// Number of tiles across the image if each tile has its own number of samples, otherwise 0.
    pub tiles_across: u32,
    /// Index of the half whose sums are written, 0 or 1.
    pub half: u32,
    /// 1 if the noise follows from the difference of the halves.
    pub noise_from_halves: u32,
    /// 1 if the error of each pixel is written behind the noise of tiles.
    pub with_errors: u32,
    /// Unused.
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
}

const _: () = assert!(size_of::<TotalsParams>() == 64);

/// Edge length in pixels of a tile that has its own number of samples: that of a workgroup.
pub const TILE: u32 = 8;

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

/// Number of words of a lane's counts: two each for samples, rejected samples and segments, and one
/// for pixels of chunks that no kernel wrote.
pub const COUNT_WORDS: u32 = 7;

/// Number of words of a tile's noise.
pub const NOISE_WORDS: u32 = 5;

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
}

impl TotalsParams {
    /// Returns the number of samples that pixel `x` of row `y` of the launch should have in the
    /// chunk: that of its tile in `counts`, or that of all pixels.
    ///
    /// # Safety
    ///
    /// With tiles, `counts` has a number for each tile of the image.
    #[inline(always)]
    unsafe fn samples_of_pixel(&self, counts: &SharedSlice<u32>, x: u32, y: u32) -> u32 {
        if self.tiles_across == 0 {
            return self.samples;
        }
        // SAFETY: the caller's promise.
        unsafe { load_shared::<u32>(counts, self.row(y) / TILE * self.tiles_across + x / TILE) }
    }

    /// Returns the image row of row `index` of the launch.
    #[inline(always)]
    pub fn row(&self, index: u32) -> u32 {
        row_of_share(self.share_first_row, self.block_shift, self.block_gap, self.first_row + index)
    }
}

const STATES: u32 = SUMS * LIMBS;
const SAMPLES: u32 = STATES + 1;
const UNWRITTEN: u32 = STATES + 3;
const SEGMENTS: u32 = STATES + 4;

const AOV_STATES: u32 = AOV_SUMS * LIMBS;
const HITS: u32 = AOV_STATES + 1;
const PRIMITIVE: u32 = AOV_STATES + 3;
const CHUNK: u32 = AOV_STATES + 4;
