//! Radiance sums of a pixel that ranks send and add: of a chunk, in `f64`, or exact.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use trisect::film::{ExactSum, FilmCounts, PixelTotals, RadianceTotals};
use trisect_shared::film::PixelSums;

/// Radiance sum of a chunk, and its sample count.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct ChunkSum {
    pub radiance: [f32; 3],
    pub samples: u32,
}

/// Radiance sum that `f64` holds exactly, and its sample count: as words, because its 28 bytes are
/// not a multiple of 8.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct DoubleSum {
    radiance: [[u32; 2]; 3],
    samples: u32,
}

impl DoubleSum {
    pub fn of(sum: &MeanSum) -> Self {
        let radiance = sum.radiance.map(|pair| bytemuck::cast(pair[0].to_bits()));
        Self { radiance, samples: sum.samples as u32 }
    }

    pub fn mean(&self) -> MeanSum {
        let radiance = self.radiance.map(|words| [f64::from_bits(bytemuck::cast(words)), 0.0]);
        MeanSum { radiance, samples: u64::from(self.samples) }
    }
}

/// Exact radiance sum of any number of samples, and their count.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeanSum {
    pub(super) radiance: [[f64; 2]; 3],
    pub(super) samples: u64,
}

/// A device's sums over chunks are sent as they are read.
const _: () = assert!(size_of::<MeanSum>() == size_of::<RadianceTotals>());

impl MeanSum {
    /// Sum of no samples.
    pub const ZERO: Self = Self { radiance: [[0.0; 2]; 3], samples: 0 };

    pub(super) fn of(totals: &PixelTotals) -> Self {
        let parts = |sum: ExactSum| <[f64; 2]>::from(sum.parts());
        Self { radiance: totals.radiance.map(parts), samples: totals.samples }
    }

    /// Returns whether the pixel lacks samples because no kernel wrote them.
    pub(super) fn is_nan(&self) -> bool {
        self.radiance.iter().all(|pair| pair[0].is_nan())
    }

    /// Returns whether [`DoubleSum`] holds the sum exactly.
    pub(super) fn is_double(&self) -> bool {
        self.radiance.iter().all(|pair| pair[1] == 0.0) && self.samples <= u64::from(u32::MAX)
    }

    pub(super) fn of_chunk(chunk: &ChunkSum) -> Self {
        Self { radiance: chunk.radiance.map(|sum| [f64::from(sum), 0.0]), samples: u64::from(chunk.samples) }
    }

    /// Adds another rank's sum of the same pixel. The sum is exact, so the order does not matter.
    pub fn add(&mut self, other: &Self) {
        for (sum, other) in self.radiance.iter_mut().zip(&other.radiance) {
            let mut exact = ExactSum::of_parts(sum[0], sum[1]);
            exact.merge(ExactSum::of_parts(other[0], other[1]));
            *sum = exact.parts().into();
        }
        self.samples += other.samples;
    }

    /// Returns the mean radiance; NaN without samples.
    pub fn mean(&self) -> [f32; 3] {
        self.radiance.map(|sum| (ExactSum::of_parts(sum[0], sum[1]).value() / self.samples as f64) as f32)
    }
}

/// Returns the counts over a chunk's pixels, which should have `samples` samples each.
pub(super) fn counts_of(sums: &[PixelSums], samples: u32) -> FilmCounts {
    let counts = sums.par_iter().with_min_len(4096).map(|sums| PixelTotals::of(sums, samples).counts());
    counts.reduce(FilmCounts::default, |a, b| a + b)
}

/// Adds a chunk, whose pixels should have `samples` samples each, to `means` and `counts`.
pub(super) fn add_chunk(means: &mut [MeanSum], counts: &mut FilmCounts, sums: &[PixelSums], samples: u32) {
    let pairs = means.par_iter_mut().zip(sums).with_min_len(4096);
    let added = pairs.map(|(mean, sums)| {
        let totals = PixelTotals::of(sums, samples);
        mean.add(&MeanSum::of(&totals));
        // A pixel that lacks samples of several chunks counts once.
        FilmCounts { unwritten: u64::from(mean.is_nan()), ..totals.counts() }
    });
    let added = added.reduce(FilmCounts::default, |a, b| a + b);
    *counts = FilmCounts { unwritten: added.unwritten, ..*counts + added };
}
