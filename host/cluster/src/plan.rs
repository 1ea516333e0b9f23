//! Assignment of the work to ranks: rows or samples, fixed at the start or handed out on demand.
//!
//! An average is an image in [`DistributionMode::Average`]: ranks render different samples of all
//! rows, and their sums go up a tree of ranks, or directly to the root if the output needs those of
//! each chunk. They are sent in strips of rows and in one or two phases (groups of chunks).
//! `render_image` and the cost model use the functions of this module.

use std::collections::VecDeque;
use std::ops::Range;
use trisect::film::SampleBlock;
pub use trisect::stats::{BLOCK_SHIFT, Balance, ClusterPlan, DistributionMode};
use trisect_shared::film::CHUNK_SAMPLES;

/// Number of strips in which an average is sent, so that one is on its way while the next one is
/// rendered.
pub const STRIPS: u32 = 8;

/// Maximum number of samples of a rank relative to an even share, if chunks stay whole.
const SHARE_TOLERANCE: f64 = 1.03;

/// Returns the band of one of `ranks` ranks: contiguous rows, for filters that read neighbouring
/// rows.
pub fn band(height: u32, rank: u32, ranks: u32) -> Range<u32> {
    let at = |rank: u32| (u64::from(height) * u64::from(rank) / u64::from(ranks.max(1))) as u32;
    at(rank)..at(rank + 1)
}

/// Returns the number of rows of one strip of an average.
pub fn strip_rows(height: u32) -> u32 {
    height.div_ceil(STRIPS).max(1)
}

/// Returns the samples of one of `ranks` ranks in an average. They are whole chunks if no rank then
/// gets more than 1.03 times an even share: the film is then that of one process, bit for bit.
/// Otherwise chunks are split, and each `f32` sum is rounded separately (by at most 2^-24 of it).
pub fn samples_of(samples: u32, rank: u32, ranks: u32) -> Range<u32> {
    let ranks = ranks.max(1);
    let cut = |of: u32, rank: u32| (u64::from(of) * u64::from(rank) / u64::from(ranks)) as u32;
    let chunks = samples.div_ceil(CHUNK_SAMPLES);
    let most = (u64::from(chunks.div_ceil(ranks)) * u64::from(CHUNK_SAMPLES)).min(u64::from(samples));
    if most as f64 <= SHARE_TOLERANCE * f64::from(samples) / f64::from(ranks) {
        let at = |rank| cut(chunks, rank).saturating_mul(CHUNK_SAMPLES).min(samples);
        return at(rank)..at(rank + 1);
    }
    cut(samples, rank)..cut(samples, rank + 1)
}

/// Returns the number of ranks that render an average: at most one rank per sample.
pub fn averaging(samples: u32, ranks: u32) -> u32 {
    ranks.min(samples).max(1)
}

/// Returns the number of phases in which an average is sent. With several chunks on each of `ranks`
/// ranks there are two: the sum of all chunks but the last is sent while the last one is rendered.
pub fn phases(samples: u32, ranks: u32) -> u32 {
    let several = |rank| {
        let own = samples_of(samples, rank, ranks);
        own.start < own.end && own.start / CHUNK_SAMPLES != (own.end - 1) / CHUNK_SAMPLES
    };
    if (0..ranks).all(several) { 2 } else { 1 }
}

/// Returns the rank that receives the sums of a rank and of those below it; `None` for the root.
/// The tree is the binomial tree of MPI's reductions.
pub fn parent(rank: u32) -> Option<u32> {
    (rank > 0).then(|| rank & (rank - 1))
}

/// Returns the number of ranks from which a rank receives sums to add to its own.
pub fn children(rank: u32, ranks: u32) -> u32 {
    let below = if rank == 0 { 32 } else { rank.trailing_zeros() };
    (0..below).filter(|&bit| u64::from(rank) + (1u64 << bit) < u64::from(ranks)).count() as u32
}

/// Hands out the missing samples of an image on demand: half of an even share of the remaining
/// samples at a time, so that faster ranks get more and all end together (guided self-scheduling:
/// Polychronopoulos and Kuck, IEEE Transactions on Computers C-36(12), 1987).
#[derive(Clone, Debug)]
pub struct WorkQueue {
    /// Blocks that were not handed out, the next one first.
    parts: VecDeque<SampleBlock>,
    /// Samples of a pixel that are handed out together; `None` for all samples of a row.
    together: Option<u32>,
    min_rows: u32,
    ranks: u32,
    left: u64,
    assigned: u64,
}

impl WorkQueue {
    /// Queues an image of `height` rows; all samples of a row are handed out together. A block has
    /// at least `least` rows, if as many are left.
    pub fn rows(height: u32, samples: u32, least: u32, ranks: u32) -> Self {
        Self::new(vec![SampleBlock { rows: 0..height, samples: 0..samples }], None, least, ranks)
    }

    /// Queues blocks whose samples begin at a chunk. Whole chunks of some rows are handed out, of
    /// at least `least` rows if the block has as many.
    pub fn chunks(parts: Vec<SampleBlock>, least: u32, ranks: u32) -> Self {
        Self::new(parts, Some(CHUNK_SAMPLES), least, ranks)
    }

    fn new(parts: Vec<SampleBlock>, together: Option<u32>, least: u32, ranks: u32) -> Self {
        let left = parts.iter().map(SampleBlock::size).sum();
        Self { parts: parts.into(), together, min_rows: least.max(1), ranks: ranks.max(1), left, assigned: 0 }
    }

    /// Returns the next block, or `None` if all were handed out. The block has at most `most`
    /// samples, counted as rows times samples per pixel, or else one chunk of the minimum number of
    /// rows. `most` has no effect if all samples of a row are handed out together.
    pub fn take(&mut self, most: u64) -> Option<SampleBlock> {
        let all = self.parts.pop_front()?;
        let (step, most) = match self.together {
            Some(step) => (step.min(all.samples.len() as u32), most),
            None => (all.samples.len() as u32, u64::MAX),
        };
        let share = (self.left / (2 * u64::from(self.ranks))).min(most) / u64::from(step.max(1));
        let height = all.rows.len() as u64;
        let rows = (share.max(u64::from(self.min_rows)) / u64::from(self.min_rows)
            * u64::from(self.min_rows))
        .min(height);
        let steps = if rows < height { 1 } else { (share / height.max(1)).max(1) };
        let end = steps.saturating_mul(u64::from(step)).saturating_add(u64::from(all.samples.start));
        let end = end.min(u64::from(all.samples.end)) as u32;
        let part = SampleBlock {
            rows: all.rows.start..all.rows.start + rows as u32,
            samples: all.samples.start..end,
        };
        // First the same samples of the rows below, then the later samples.
        let later = SampleBlock { rows: all.rows.clone(), samples: end..all.samples.end };
        let below = SampleBlock { rows: part.rows.end..all.rows.end, samples: part.samples.clone() };
        [later, below]
            .into_iter()
            .filter(|part| part.size() > 0)
            .for_each(|part| self.parts.push_front(part));
        self.left -= part.size();
        self.assigned += part.size();
        Some(part)
    }

    /// Discards what was not handed out.
    pub fn stop(&mut self) {
        self.parts.clear();
        self.left = 0;
    }

    /// Returns the samples that were handed out, counted as rows times samples per pixel; `None`
    /// while more are left.
    pub fn total_assigned(&self) -> Option<u64> {
        self.parts.is_empty().then_some(self.assigned)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use trisect::film::SampleCoverage;

    #[test]
    fn all_samples_once() {
        for samples in [1, 2, 7, 100, 255, 256, 257, 1000, 1024, 100_000, u32::MAX] {
            for ranks in [1, 2, 3, 4, 7, 16, 1000] {
                let mut next = 0;
                let mut most = 0;
                for rank in 0..ranks {
                    let own = samples_of(samples, rank, ranks);
                    assert_eq!(own.start, next);
                    next = own.end;
                    most = most.max(own.len());
                }
                assert_eq!(next, samples);
                assert!(most as f64 <= (1.03 * f64::from(samples) / f64::from(ranks)).max(1.0).ceil());
            }
        }
        // Whole chunks where they divide evenly enough.
        assert_eq!(samples_of(1024, 1, 4), 256..512);
        assert_eq!(samples_of(100_000, 1, 2), 49920..100_000);
        assert_eq!(samples_of(100, 1, 4), 25..50);
    }

    #[test]
    fn each_rank_has_one_parent() {
        for ranks in 1..70 {
            let mut counted = vec![0; ranks as usize];
            for rank in 1..ranks {
                let above = parent(rank).unwrap_or(u32::MAX);
                assert!(above < rank);
                counted[above as usize] += 1;
            }
            for rank in 0..ranks {
                assert_eq!(children(rank, ranks), counted[rank as usize], "{rank} of {ranks}");
            }
        }
    }

    #[test]
    fn rows_are_handed_out_once() {
        for (height, least, ranks) in [(1, 8, 3), (225, 8, 2), (1080, 16, 7), (5, 1, 100)] {
            let mut all = WorkQueue::rows(height, 1000, least, ranks);
            let mut next = 0;
            let mut last = u32::MAX;
            while let Some(SampleBlock { rows, samples }) = all.take(1) {
                assert_eq!((rows.start, samples), (next, 0..1000));
                assert!(rows.len() as u32 <= last);
                last = rows.len() as u32;
                next = rows.end;
            }
            assert_eq!(next, height);
            assert_eq!(all.total_assigned(), Some(1000 * u64::from(height)));
        }
    }

    #[test]
    fn chunks_are_handed_out_once_and_in_bounds() {
        let parts = [
            SampleBlock { rows: 3..40, samples: 0..1000 },
            SampleBlock { rows: 0..3, samples: 256..512 },
            SampleBlock { rows: 0..40, samples: 1024..3000 },
        ];
        for (least, ranks, most) in [(8, 3, 5000), (1, 1, u64::MAX), (16, 100, 0), (8, 2, 40 * 512)] {
            let mut all = WorkQueue::chunks(parts.to_vec(), least, ranks);
            let mut held = SampleCoverage::new(40);
            let mut handed = 0;
            while let Some(part) = all.take(most) {
                assert!(part.samples.start % CHUNK_SAMPLES == 0, "{part:?}");
                assert!(part.samples.end % CHUNK_SAMPLES == 0 || [1000, 3000].contains(&part.samples.end));
                assert!(part.size() <= most.max(u64::from(least) * u64::from(CHUNK_SAMPLES)), "{part:?}");
                held.insert(&part).unwrap();
                handed += part.size();
            }
            assert!(parts.iter().all(|part| {
                part.rows.clone().all(|row| {
                    held.samples(row)
                        .iter()
                        .any(|held| held.start <= part.samples.start && held.end >= part.samples.end)
                })
            }));
            assert_eq!(handed, parts.iter().map(SampleBlock::size).sum::<u64>());
            assert_eq!(all.total_assigned(), Some(handed));
        }
        let mut stopped = WorkQueue::chunks(parts.to_vec(), 8, 2);
        let first = stopped.take(5000).map(|part| part.size());
        assert_eq!(stopped.total_assigned(), None);
        stopped.stop();
        assert_eq!((stopped.take(5000), stopped.total_assigned()), (None, first));
    }
}
