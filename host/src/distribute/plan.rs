//! Which rank renders what.

use crate::film::Rows;
use std::ops::Range;
use trisect_shared::film::CHUNK_SAMPLES;

/// How an image is shared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Each rank renders all samples of some rows.
    Rows,
    /// Each rank renders some samples of all rows.
    Average,
}

/// Which rows a rank gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Balance {
    /// Interleaved blocks, known from the start.
    Static,
    /// The root hands out rows, fewer and fewer, to whoever has none left.
    Dynamic,
}

/// Who renders what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Plan {
    /// How.
    pub mode: Mode,
    /// Of rows.
    pub balance: Balance,
    /// Rows of a block, as a power of two.
    pub block_shift: u32,
}

/// Rows of a block, as a power of two, unless told otherwise: a multiple of the tiles that devices work on, small enough to spread what takes long.
pub const BLOCK_SHIFT: u32 = 3;

impl Default for Plan {
    fn default() -> Self {
        Self { mode: Mode::Rows, balance: Balance::Static, block_shift: BLOCK_SHIFT }
    }
}

/// Strips that an average travels in, so that one is on its way while the next is rendered.
pub const STRIPS: u32 = 8;

/// How much more than its share a rank may get, so that chunks stay whole.
const LENIENCE: f64 = 1.03;

impl Plan {
    /// The rows of one of so many ranks.
    pub fn rows(&self, height: u32, rank: u32, ranks: u32) -> Rows {
        match self.mode {
            Mode::Rows => Rows::interleaved(height, self.block_shift, rank, ranks),
            Mode::Average => Rows::from(0..height),
        }
    }
}

/// The band of one of so many ranks: rows that are neighbours, for what reaches beyond a row.
pub fn band(height: u32, rank: u32, ranks: u32) -> Range<u32> {
    let at = |rank: u32| (u64::from(height) * u64::from(rank) / u64::from(ranks.max(1))) as u32;
    at(rank)..at(rank + 1)
}

/// Rows of one strip of an average.
pub fn strip_rows(height: u32) -> u32 {
    height.div_ceil(STRIPS).max(1)
}

/// The samples of one of so many ranks, when they average. Whole chunks, where that leaves no rank with much more than its share: the film is
/// then that of one process, bit for bit. Else chunks are split, and each f32 sum rounds by itself (at most 2^-24 of it).
pub fn samples_of(samples: u32, rank: u32, ranks: u32) -> Range<u32> {
    let ranks = ranks.max(1);
    let cut = |of: u32, rank: u32| (u64::from(of) * u64::from(rank) / u64::from(ranks)) as u32;
    let chunks = samples.div_ceil(CHUNK_SAMPLES);
    let most = (u64::from(chunks.div_ceil(ranks)) * u64::from(CHUNK_SAMPLES)).min(u64::from(samples));
    if most as f64 <= LENIENCE * f64::from(samples) / f64::from(ranks) {
        let at = |rank| cut(chunks, rank).saturating_mul(CHUNK_SAMPLES).min(samples);
        return at(rank)..at(rank + 1);
    }
    cut(samples, rank)..cut(samples, rank + 1)
}

/// Ranks that have samples to average: no more than there are samples.
pub fn averaging(samples: u32, ranks: u32) -> u32 {
    ranks.min(samples).max(1)
}

/// In how many phases an average travels: where each of so many ranks has several chunks, first what all but the last hold, while that is rendered.
pub fn phases(samples: u32, ranks: u32) -> u32 {
    let several = |rank| {
        let own = samples_of(samples, rank, ranks);
        own.start < own.end && own.start / CHUNK_SAMPLES != (own.end - 1) / CHUNK_SAMPLES
    };
    if (0..ranks).all(several) { 2 } else { 1 }
}

/// To whom a rank sends what it and those below it averaged; none for the root. The tree is the binomial one of MPI's reductions.
pub fn parent(rank: u32) -> Option<u32> {
    (rank > 0).then(|| rank & (rank - 1))
}

/// From how many ranks a rank gets sums to add to its own.
pub fn children(rank: u32, ranks: u32) -> u32 {
    let below = if rank == 0 { 32 } else { rank.trailing_zeros() };
    (0..below).filter(|&bit| u64::from(rank) + (1u64 << bit) < u64::from(ranks)).count() as u32
}

/// Hands out rows: half of an even share of what is left at a time, so that ranks that are fast get more and all end together (guided
/// self-scheduling: Polychronopoulos and Kuck, IEEE Transactions on Computers C-36(12), 1987).
#[derive(Clone, Debug)]
pub struct Dispenser {
    next: u32,
    height: u32,
    least: u32,
    ranks: u32,
}

impl Dispenser {
    /// For an image of so many rows.
    pub fn new(height: u32, least: u32, ranks: u32) -> Self {
        Self { next: 0, height, least: least.max(1), ranks: ranks.max(1) }
    }

    /// Rows for the next who asks; none when all are handed out.
    pub fn take(&mut self) -> Option<Range<u32>> {
        let left = self.height - self.next;
        let share = (left / (2 * self.ranks)).max(self.least) / self.least * self.least;
        let rows = self.next..(self.next + share.min(left));
        self.next = rows.end;
        (!rows.is_empty()).then_some(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        // Whole chunks where they share well.
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
            let mut all = Dispenser::new(height, least, ranks);
            let mut next = 0;
            let mut last = u32::MAX;
            while let Some(rows) = all.take() {
                assert_eq!(rows.start, next);
                assert!(rows.len() as u32 <= last);
                last = rows.len() as u32;
                next = rows.end;
            }
            assert_eq!(next, height);
        }
    }
}
