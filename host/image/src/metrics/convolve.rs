//! Separable filtering of one-channel images, with the border clamped (the
//! edge sample repeats outside the image), as in NVIDIA's FLIP.

use rayon::prelude::*;

/// A one-channel image, row-major, top row first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    width: usize,
    samples: Vec<f32>,
}

impl Plane {
    /// Creates a plane from whole rows of `width` samples; `width` is at least 1.
    pub(super) fn new(width: usize, samples: Vec<f32>) -> Self {
        let width = width.max(1);
        debug_assert!(samples.len().is_multiple_of(width));
        Self { width, samples }
    }

    pub(super) fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// Applies `f` to every sample.
    pub(super) fn map(&self, f: impl Fn(f32) -> f32 + Sync) -> Self {
        let samples = self.samples.par_iter().map(|&s| f(s)).collect();
        Self::new(self.width, samples)
    }

    /// Adds `other`, which has the same shape, to this plane.
    pub(super) fn add(mut self, other: &Self) -> Self {
        let pairs = self.samples.par_iter_mut().zip(&other.samples);
        pairs.for_each(|(sum, term)| *sum += term);
        self
    }

    /// Correlates every row with `kernel`, of odd length 2r + 1.
    pub(super) fn filter_rows(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() / 2;
        let mut samples = vec![0.0; self.samples.len()];
        let rows = self.samples.par_chunks(self.width);
        samples.par_chunks_mut(self.width).zip(rows).for_each_init(Vec::new, |padded, (out, row)| {
            pad_row(padded, row, radius);
            // The outer loop runs over taps and the inner one over samples, so each pass is one
            // vector loop.
            for (tap, window) in kernel.iter().zip(padded.windows(row.len())) {
                accumulate(out, window, *tap);
            }
        });
        Self::new(self.width, samples)
    }

    /// Correlates every column with `kernel`, of odd length 2r + 1.
    pub(super) fn filter_columns(&self, kernel: &[f32]) -> Self {
        let radius = kernel.len() / 2;
        let rows: Vec<&[f32]> = self.samples.chunks(self.width).collect();
        let last = rows.len().saturating_sub(1);
        let mut samples = vec![0.0; self.samples.len()];
        let out_rows = samples.par_chunks_mut(self.width).enumerate();
        out_rows.for_each(|(y, out)| {
            for (offset, tap) in kernel.iter().enumerate() {
                let source = (y + offset).saturating_sub(radius).min(last);
                if let Some(row) = rows.get(source) {
                    accumulate(out, row, *tap);
                }
            }
        });
        Self::new(self.width, samples)
    }
}

/// Fills `padded` with `row` and `radius` copies of its end samples on either side.
fn pad_row(padded: &mut Vec<f32>, row: &[f32], radius: usize) {
    padded.clear();
    if let (Some(&first), Some(&last)) = (row.first(), row.last()) {
        padded.extend(std::iter::repeat_n(first, radius));
        padded.extend_from_slice(row);
        padded.extend(std::iter::repeat_n(last, radius));
    }
}

fn accumulate(out: &mut [f32], row: &[f32], tap: f32) {
    for (sum, sample) in out.iter_mut().zip(row) {
        *sum += tap * sample;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_sample_repeats() {
        let plane = Plane::new(3, vec![1.0, 2.0, 4.0]);
        // Taps address x - 1, x and x + 1 in this order.
        let shifted = plane.filter_rows(&[1.0, 0.0, 0.0]);
        assert_eq!(shifted.samples(), [1.0, 1.0, 2.0]);
        let unchanged = plane.filter_columns(&[0.25, 0.5, 0.25]);
        assert_eq!(unchanged, plane);
    }

    #[test]
    fn rows_and_columns_are_transposes() {
        let kernel = [0.5, 0.25, -1.0, 2.0, 0.125];
        let row = Plane::new(4, vec![3.0, -1.0, 0.5, 8.0]);
        let column = Plane::new(1, vec![3.0, -1.0, 0.5, 8.0]);
        assert_eq!(row.filter_rows(&kernel).samples(), column.filter_columns(&kernel).samples());
    }

    #[test]
    fn a_kernel_may_exceed_the_image() {
        let plane = Plane::new(2, vec![1.0, 3.0, 5.0, 7.0]);
        let kernel = [0.2; 5];
        let filtered = plane.filter_rows(&kernel).filter_columns(&kernel);
        for sample in filtered.samples() {
            assert!((1.0..=7.0).contains(sample));
        }
    }

    #[test]
    fn an_empty_plane_stays_empty() {
        let plane = Plane::new(0, Vec::new());
        let filtered = plane.filter_rows(&[1.0]).filter_columns(&[1.0]);
        assert!(filtered.samples().is_empty());
    }
}
