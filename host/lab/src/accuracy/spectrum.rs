//! Splits relMSE by spatial frequency, which tells grain from blotches of several pixels.

use super::truth::Truth;
use crate::statistics::Interval;
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use trisect::image::Image;
use trisect::metrics::REL_MSE_EPSILON as EPSILON;

/// Upper ends of the bands but the last one, in cycles per pixel.
const ENDS: [f64; 5] = [1.0 / 64.0, 1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0];

/// Number of bands.
const BANDS: usize = ENDS.len() + 1;

/// Part of relMSE in a band of spatial frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SpectrumBand {
    /// Lowest frequency in cycles per pixel: 1 / 64 is a period of 64 pixels.
    pub from: f64,
    /// Frequency at which the next band begins, in cycles per pixel; that of the last band is the
    /// diagonal's highest one, 1 / √2.
    pub to: f64,
    /// Part of relMSE in this band. All parts add up to relMSE.
    pub rel_mse: Interval,
    /// Share of relMSE over share of the frequencies: 1 for noise that is independent between
    /// pixels. NaN if relMSE is not positive.
    pub density: f64,
}

/// Transforms of images of one size.
struct Transform {
    width: usize,
    height: usize,
    rows: Arc<dyn Fft<f64>>,
    columns: Arc<dyn Fft<f64>>,
}

impl Transform {
    fn new(width: usize, height: usize) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            width,
            height,
            rows: planner.plan_fft_forward(width),
            columns: planner.plan_fft_forward(height),
        }
    }

    /// Returns the transform of values by pixel, as columns: that of frequency (x, y) is at
    /// x * height + y.
    fn of(&self, mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        let (width, height) = (self.width, self.height);
        values.par_chunks_exact_mut(width).for_each(|row| self.rows.process(row));
        let mut columns = vec![Complex::default(); values.len()];
        columns.par_chunks_exact_mut(height).enumerate().for_each(|(x, column)| {
            for (y, value) in column.iter_mut().enumerate() {
                *value = values[y * width + x];
            }
            self.columns.process(column);
        });
        columns
    }

    /// Returns the band of a column and row of the transform.
    fn band(&self, x: usize, y: usize) -> usize {
        let of = |index: usize, size: usize| index.min(size - index) as f64 / size as f64;
        let frequency = of(x, self.width).hypot(of(y, self.height));
        ENDS.iter().position(|&end| frequency < end).unwrap_or(BANDS - 1)
    }

    /// Returns the sum by band of Re(D conj(E)) over the frequencies, where D and E are the
    /// transforms of the real and the imaginary parts of values.
    ///
    /// With the transform Z of both together, that is Im(Z(k) Z(-k)) / 2.
    fn cross_power(&self, values: Vec<Complex<f64>>) -> [f64; BANDS] {
        let (width, height) = (self.width, self.height);
        let found = self.of(values);
        let of_column = |x: usize| {
            let mut sums = [0.0; BANDS];
            let opposite = (width - x) % width * height;
            for y in 0..height {
                let product = found[x * height + y] * found[opposite + (height - y) % height];
                sums[self.band(x, y)] += 0.5 * product.im;
            }
            sums
        };
        let columns: Vec<[f64; BANDS]> = (0..width).into_par_iter().map(of_column).collect();
        columns.iter().fold([0.0; BANDS], |sums, column| std::array::from_fn(|i| sums[i] + column[i]))
    }

    /// Returns the number of frequencies in each band.
    fn counts(&self) -> [usize; BANDS] {
        let mut counts = [0; BANDS];
        for x in 0..self.width {
            (0..self.height).for_each(|y| counts[self.band(x, y)] += 1);
        }
        counts
    }
}

/// Returns the parts of relMSE of images with different seeds by spatial frequency, ascending;
/// bands that the size has no frequency in are left out. Pixels with a NaN or infinite value count
/// as without error.
///
/// The error is multiplied by the root of relMSE's weight 1 / (r² + 0.01) before it is transformed,
/// so that the sum over all frequencies is relMSE (Parseval's theorem). Each image's errors against
/// the two halves of the reference are multiplied with each other: the halves' own noise is
/// independent, so it adds nothing in the mean.
pub(crate) fn spectrum(images: &[Image], truth: &Truth) -> Vec<SpectrumBand> {
    let (width, height) = (truth.image.width as usize, truth.image.height as usize);
    let pixels = width * height;
    let transform = Transform::new(width, height);
    let of_image = |image: &Image| {
        let mut sums = [0.0; BANDS];
        for c in 0..3 {
            let value = |pixel: usize| {
                let [a, b] = truth.halves.map(|half| f64::from(half.pixels[pixel][c]));
                let x = f64::from(image.pixels[pixel][c]);
                let r = 0.5 * (a + b);
                let scale = 1.0 / (r * r + EPSILON).sqrt();
                let error = Complex::new((x - a) * scale, (x - b) * scale);
                if error.is_finite() { error } else { Complex::default() }
            };
            let power = transform.cross_power((0..pixels).into_par_iter().map(value).collect());
            sums.iter_mut().zip(power).for_each(|(sum, power)| *sum += power);
        }
        sums.map(|sum| sum / (3.0 * (pixels * pixels) as f64))
    };
    let each: Vec<[f64; BANDS]> = images.iter().map(of_image).collect();
    let counts = transform.counts();
    let all = each.iter().flatten().sum::<f64>() / each.len().max(1) as f64;
    let band = |index: usize| {
        let parts: Vec<f64> = each.iter().map(|sums| sums[index]).collect();
        let rel_mse = Interval::of_mean(&parts);
        let share = counts[index] as f64 / pixels as f64;
        SpectrumBand {
            from: if index == 0 { 0.0 } else { ENDS[index - 1] },
            to: ENDS.get(index).copied().unwrap_or(std::f64::consts::FRAC_1_SQRT_2),
            rel_mse,
            density: if all > 0.0 { rel_mse.value / all / share } else { f64::NAN },
        }
    };
    (0..BANDS).filter(|&index| counts[index] > 0).map(band).collect()
}

#[cfg(test)]
mod tests;
