//! Totals of one pixel: exact sums of radiance and of its squares, and counts.

use super::{ExactSum, FilmCounts};
use bytemuck::{Pod, Zeroable};
use trisect_shared::film::PixelSums;

/// Totals over all samples of one pixel so far. They do not depend on the order or grouping of
/// chunks and films, within the limits of [`ExactSum`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PixelTotals {
    /// Sum of the radiance, by channel. NaN until the first chunk is merged, so that a pixel that
    /// was not written is visible.
    pub radiance: [ExactSum; 3],
    /// Sum of the squared radiance, by channel.
    pub squares: [ExactSum; 3],
    /// Number of samples in the sums.
    pub samples: u64,
    /// Number of samples that were NaN or infinite and are not in the sums.
    pub rejected: u64,
    /// Number of segments traced, shadow rays included.
    pub segments: u64,
    /// Number of samples that should have been taken and that no kernel wrote; if it is not 0, the
    /// sums stay NaN.
    pub unwritten: u64,
}

/// Totals of the radiance over all samples of one pixel so far, as in [`PixelTotals`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct RadianceTotals {
    /// Sum of the radiance, by channel; NaN if the pixel lacks samples because no kernel wrote
    /// them.
    pub radiance: [ExactSum; 3],
    /// Number of samples in the sums.
    pub samples: u64,
}

/// Returns the mean of sums over `samples`, by channel; NaN without samples.
#[inline]
fn mean(sums: &[ExactSum; 3], samples: u64) -> [f64; 3] {
    let n = samples as f64;
    [sums[0].value() / n, sums[1].value() / n, sums[2].value() / n]
}

impl RadianceTotals {
    /// Returns the mean radiance, by channel; NaN without samples.
    #[inline]
    pub fn mean(&self) -> [f64; 3] {
        mean(&self.radiance, self.samples)
    }
}

impl PixelTotals {
    pub(crate) const EMPTY: Self = Self {
        radiance: [ExactSum::NAN; 3],
        squares: [ExactSum::NAN; 3],
        samples: 0,
        rejected: 0,
        segments: 0,
        unwritten: 0,
    };

    /// Returns the totals of one chunk, which should hold `samples` samples.
    #[inline]
    pub fn of(sums: &PixelSums, samples: u32) -> Self {
        let mut totals = Self::EMPTY;
        totals.merge(sums, samples);
        totals
    }

    #[inline]
    fn is_empty(&self) -> bool {
        [self.samples, self.rejected, self.unwritten] == [0; 3]
    }

    /// Adds a chunk that should hold `samples` samples.
    #[inline]
    pub(crate) fn merge(&mut self, sums: &PixelSums, samples: u32) {
        let is_first = self.is_empty();
        if sums.samples > samples {
            self.radiance = [ExactSum::NAN; 3];
            self.squares = [ExactSum::NAN; 3];
            self.unwritten += u64::from(samples);
            return;
        }
        for c in 0..3 {
            let (radiance, squares) = (f64::from(sums.radiance[c]), f64::from(sums.squares[c]));
            if is_first {
                (self.radiance[c], self.squares[c]) = (radiance.into(), squares.into());
            } else {
                self.radiance[c].add(radiance);
                self.squares[c].add(squares);
            }
        }
        self.samples += u64::from(sums.samples);
        self.rejected += u64::from(samples - sums.samples);
        self.segments += u64::from(sums.segments);
    }

    /// Adds the totals that another film has of the same pixel.
    pub(crate) fn add(&mut self, other: &Self) {
        if other.is_empty() {
            return;
        }
        if self.is_empty() {
            *self = *other;
            return;
        }
        for c in 0..3 {
            self.radiance[c].merge(other.radiance[c]);
            self.squares[c].merge(other.squares[c]);
        }
        self.samples += other.samples;
        self.rejected += other.rejected;
        self.segments += other.segments;
        self.unwritten += other.unwritten;
    }

    /// Returns the counts of this pixel.
    #[inline]
    pub fn counts(&self) -> FilmCounts {
        FilmCounts {
            samples: self.samples,
            rejected: self.rejected,
            segments: self.segments,
            unwritten: u64::from(self.unwritten > 0 || self.is_empty()),
        }
    }

    /// Returns the totals over all chunks in the kernels' format, rounded to f32; NaN and 0 samples
    /// if there are none, or if no kernel wrote some.
    pub fn sums(&self) -> PixelSums {
        if self.unwritten > 0 || self.is_empty() {
            return PixelSums { samples: 0, ..PixelSums::UNWRITTEN };
        }
        let round = |sums: [ExactSum; 3]| sums.map(|sum| sum.value() as f32).into();
        PixelSums {
            radiance: round(self.radiance),
            samples: u32::try_from(self.samples).unwrap_or(u32::MAX),
            squares: round(self.squares),
            segments: u32::try_from(self.segments).unwrap_or(u32::MAX),
        }
    }

    /// Returns the mean radiance, by channel; NaN without samples.
    #[inline]
    pub fn mean(&self) -> [f64; 3] {
        mean(&self.radiance, self.samples)
    }

    /// Returns the estimated variance of the mean, by channel: the sample variance over n. With
    /// fewer than two samples it has no meaning.
    pub fn variance_of_mean(&self) -> [f64; 3] {
        let n = self.samples as f64;
        std::array::from_fn(|c| {
            let mean = self.radiance[c].value() / n;
            ((self.squares[c].value() / n - mean * mean) / (n - 1.0)).max(0.0)
        })
    }
}
