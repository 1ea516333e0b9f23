//! Tiles of an image, which are the units of adaptive sampling.

use rayon::prelude::*;
use std::ops::Range;

pub use trisect_shared::totals::TILE;

/// Image divided into squares of [`TILE`] pixels, row-major; those at the right and bottom edges
/// may be smaller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tiles {
    width: u32,
    height: u32,
    across: u32,
    down: u32,
}

impl Tiles {
    /// Divides an image of `width` by `height` pixels.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, across: width.div_ceil(TILE), down: height.div_ceil(TILE) }
    }

    /// Returns the pixels across and down the image.
    pub fn image(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Returns the number of tiles.
    pub fn len(&self) -> usize {
        self.across as usize * self.down as usize
    }

    /// Returns whether the image has no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of rows of tiles.
    pub fn down(&self) -> u32 {
        self.down
    }

    /// Returns the tile of a pixel, given by its index in the image.
    pub fn of_pixel(&self, pixel: usize) -> usize {
        let (x, y) = (pixel % self.width as usize, pixel / self.width as usize);
        y / TILE as usize * self.across as usize + x / TILE as usize
    }

    /// Returns the indices of a tile's pixels in the image.
    pub fn pixels(&self, tile: usize) -> impl Iterator<Item = usize> + use<> {
        let (width, [x, y]) = (self.width as usize, self.place(tile));
        let columns = x * TILE..((x + 1) * TILE).min(self.width);
        let rows = y * TILE..((y + 1) * TILE).min(self.height);
        rows.flat_map(move |y| columns.clone().map(move |x| y as usize * width + x as usize))
    }

    /// Returns the number of pixels of a tile.
    pub fn size(&self, tile: usize) -> u32 {
        let [x, y] = self.place(tile);
        (self.width - x * TILE).min(TILE) * (self.height - y * TILE).min(TILE)
    }

    fn place(&self, tile: usize) -> [u32; 2] {
        let across = self.across.max(1) as usize;
        [(tile % across) as u32, (tile / across) as u32]
    }

    /// Returns the image rows of some rows of tiles.
    pub fn rows(&self, tiles: Range<u32>) -> Range<u32> {
        tiles.start * TILE..(tiles.end * TILE).min(self.height)
    }

    /// Returns the samples of a row of tiles, where `counts` are the samples per pixel of each
    /// tile.
    pub fn samples_of_row(&self, row: u32, counts: &[u32]) -> u64 {
        let first = row as usize * self.across as usize;
        let tiles = first..first + self.across as usize;
        tiles.map(|tile| u64::from(self.size(tile)) * u64::from(counts[tile])).sum()
    }

    /// Returns the mean over each tile and its neighbours (3 x 3 tiles), weighted by pixels.
    pub fn around(&self, values: &[f64]) -> Vec<f64> {
        let mean = |tile: usize| {
            let [x, y] = self.place(tile);
            let (mut sum, mut weight) = (0.0, 0.0);
            for row in y.saturating_sub(1)..(y + 2).min(self.down) {
                for column in x.saturating_sub(1)..(x + 2).min(self.across) {
                    let other = row as usize * self.across as usize + column as usize;
                    let size = f64::from(self.size(other));
                    sum += values[other] * size;
                    weight += size;
                }
            }
            sum / weight
        };
        (0..self.len()).into_par_iter().with_min_len(1024).map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_is_in_one_tile() {
        for (width, height) in [(1, 1), (8, 8), (17, 9), (400, 225), (7, 100)] {
            let tiles = Tiles::new(width, height);
            let mut seen = vec![0; (width * height) as usize];
            for tile in 0..tiles.len() {
                assert_eq!(tiles.pixels(tile).count(), tiles.size(tile) as usize);
                for pixel in tiles.pixels(tile) {
                    assert_eq!(tiles.of_pixel(pixel), tile);
                    seen[pixel] += 1;
                }
            }
            assert!(seen.iter().all(|&count| count == 1));
            let counts = vec![3; tiles.len()];
            let samples: u64 = (0..tiles.down()).map(|row| tiles.samples_of_row(row, &counts)).sum();
            assert_eq!(samples, u64::from(width * height) * 3);
            assert_eq!(tiles.rows(0..tiles.down()), 0..height);
        }
    }

    #[test]
    fn a_constant_stays_one() {
        let tiles = Tiles::new(33, 20);
        let around = tiles.around(&vec![2.5; tiles.len()]);
        assert!(around.iter().all(|&value| value == 2.5));
    }
}
