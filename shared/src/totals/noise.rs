//! Noise of the tiles of an image.
#![allow(unsafe_code, reason = "see buffer")]

use super::{NOISE_WORDS, TILE, TotalsParams};
use crate::buffer::{SharedSlice, load_shared, store_shared};
use crate::film::PixelSums;
use crate::noise::PixelNoise;

/// Returns one past the last row or column of a tile that begins at `first`.
#[inline(always)]
fn end(first: u32, of: u32) -> u32 {
    if first + TILE < of { first + TILE } else { of }
}

/// Writes the mean noise of a tile's pixels, [`NOISE_WORDS`] words: error, variances and work by
/// half. With errors, it writes the error of each pixel of the image behind the noise of all tiles.
///
/// # Safety
///
/// The output has these words. There are two records for each pixel, those of the first half before
/// those of the second.
#[inline(always)]
pub unsafe fn write_noise(
    params: &TotalsParams,
    sums: &SharedSlice<PixelSums>,
    output: &mut SharedSlice<u32>,
    x: u32,
    y: u32,
) {
    let (first_column, first_row) = (x * TILE, y * TILE);
    // Also lanes beyond the launch have such a row or column.
    if first_column >= params.width || first_row >= params.height {
        return;
    }
    let (pixels, tile) = (params.width * params.height, y * params.tiles_across + x);
    let tiles = params.tiles_across * params.height.div_ceil(TILE);
    let (end_column, end_row) = (end(first_column, params.width), end(first_row, params.height));
    let mut noise = PixelNoise::ZERO;
    // SAFETY: the caller's promise.
    unsafe {
        let mut row = first_row;
        while row < end_row {
            let mut column = first_column;
            while column < end_column {
                let pixel = row * params.width + column;
                let first = load_shared::<PixelSums>(sums, pixel);
                let second = load_shared::<PixelSums>(sums, pixels + pixel);
                let own = PixelNoise::of(first, second, params.noise_from_halves != 0);
                noise.add(own);
                if params.with_errors != 0 {
                    let at = tiles * NOISE_WORDS + pixel;
                    store_shared::<u32>(output, at, own.error.to_bits());
                }
                column += 1;
            }
            row += 1;
        }
        let mean = noise.mean((end_column - first_column) * (end_row - first_row));
        let at = tile * NOISE_WORDS;
        store_shared::<u32>(output, at, mean.error.to_bits());
        store_shared::<u32>(output, at + 1, mean.variance.0.to_bits());
        store_shared::<u32>(output, at + 2, mean.variance.1.to_bits());
        store_shared::<u32>(output, at + 3, mean.work.0.to_bits());
        store_shared::<u32>(output, at + 4, mean.work.1.to_bits());
    }
}
