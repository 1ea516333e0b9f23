//! Margin of mirrored pixels around an image. Without one the network sees black beyond the image:
//! it darkens the pixels at a corner, and changes images of a few pixels by a multiple.

use rayon::prelude::*;

/// Minimum width of the margin, in pixels.
const MIN_MARGIN: usize = 4;
/// Minimum side of an image with its margin, in pixels.
const MIN_SIDE: usize = 64;

/// Image size with its margin, in pixels across and down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Margin {
    /// Size of the image.
    size: [usize; 2],
    /// Width of the margin at the left and the right, and at the top and the bottom.
    width: [usize; 2],
}

impl Margin {
    /// Returns the margin of an image of at least one pixel.
    pub fn of(width: u32, height: u32) -> Self {
        let size = [width as usize, height as usize];
        let around = |side: usize| MIN_SIDE.saturating_sub(side).div_ceil(2).max(MIN_MARGIN);
        Self { size, width: size.map(around) }
    }

    /// Returns the size of the image with the margin, across and down.
    pub fn outer(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.size[axis] + 2 * self.width[axis])
    }

    /// Returns the image with its margin.
    pub fn add(&self, image: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let [across, down] = self.outer();
        let [x, y] = [0, 1].map(|axis| move |at: usize| mirror(at, self.width[axis], self.size[axis]));
        let row = |row: usize| {
            let from = y(row) * self.size[0];
            (0..across).into_par_iter().with_min_len(across).map(move |at| image[from + x(at)])
        };
        (0..down).into_par_iter().flat_map(row).collect()
    }

    /// Returns the image without its margin.
    pub fn remove(&self, image: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let [width, height] = self.size;
        let row = |row: usize| {
            let from = (row + self.width[1]) * self.outer()[0] + self.width[0];
            &image[from..from + width]
        };
        (0..height).flat_map(row).copied().collect()
    }
}

/// Returns the position in an image of `side` pixels that is shown `at` pixels from the start of a
/// margin of `width` pixels, beyond which the image is mirrored as often as needed.
fn mirror(at: usize, width: usize, side: usize) -> usize {
    let period = 2 * side;
    let place = (at + period - width % period) % period;
    place.min(period - 1 - place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_is_mirrored() {
        let row: Vec<usize> = (0..13).map(|at| mirror(at, 5, 3)).collect();
        assert_eq!(row, [1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
        assert!((0..9).all(|at| mirror(at, 4, 1) == 0));
        assert_eq!(Margin::of(1920, 1080).outer(), [1928, 1088]);
        assert_eq!(Margin::of(1, 63).outer(), [65, 71]);
    }

    #[test]
    fn what_is_added_is_removed() {
        for (width, height) in [(1, 1), (3, 200), (70, 5)] {
            let image: Vec<[f32; 3]> = (0..width * height).map(|pixel| [pixel as f32, 1.0, 2.0]).collect();
            let margin = Margin::of(width, height);
            let around = margin.add(&image);
            let [across, down] = margin.outer();
            assert_eq!(around.len(), across * down);
            assert_eq!(margin.remove(&around), image);
        }
    }
}
