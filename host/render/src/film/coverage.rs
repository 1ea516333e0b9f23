//! Sample coverage: the samples that a film holds, for each row of the image.
//!
//! It rejects samples that would count twice, and lists those that a film lacks.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Block of samples of a frame: some rows, and a range of samples of each of their pixels.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleBlock {
    /// Rows of the whole image, 0 at the top.
    pub rows: Range<u32>,
    /// Indices of samples, among all samples of a pixel.
    pub samples: Range<u32>,
}

impl SampleBlock {
    /// Returns the number of rows times samples.
    pub fn size(&self) -> u64 {
        self.rows.len() as u64 * self.samples.len() as u64
    }
}

/// Samples of a row that would count twice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// First row with such samples.
    pub row: u32,
    /// Indices of these samples.
    pub samples: Range<u32>,
}

/// Samples that a film holds, by row. Equal sets are equal, however they were put together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampleCoverage {
    /// Ranges of sample indices of each row, in order; they neither overlap nor touch.
    rows: Vec<Vec<Range<u32>>>,
}

impl SampleCoverage {
    /// Creates a coverage of `height` rows without samples.
    pub fn new(height: u32) -> Self {
        Self { rows: vec![Vec::new(); height as usize] }
    }

    /// Returns the number of rows of the image.
    pub fn height(&self) -> u32 {
        self.rows.len() as u32
    }

    /// Returns the ranges of sample indices that row `row` holds, in order; none for a row beyond
    /// the image.
    pub fn samples(&self, row: u32) -> &[Range<u32>] {
        self.rows.get(row as usize).map_or(&[], Vec::as_slice)
    }

    /// Returns all samples held, as blocks sorted by first sample, then first row. Adjacent rows
    /// with the same samples form one block.
    pub fn parts(&self) -> Vec<SampleBlock> {
        together(self.rows.iter().map(Vec::as_slice))
    }

    /// Returns the samples of `samples` that are not held, as blocks in the order of
    /// [`parts`](Self::parts).
    pub fn missing(&self, samples: &Range<u32>) -> Vec<SampleBlock> {
        let gaps: Vec<Vec<Range<u32>>> = self.rows.iter().map(|held| gaps(held, samples)).collect();
        together(gaps.iter().map(Vec::as_slice))
    }

    /// Returns the samples of `part` that are not held, as blocks in the order of
    /// [`parts`](Self::parts).
    pub fn missing_in(&self, part: &SampleBlock) -> Vec<SampleBlock> {
        let within = |Range { start, end }: Range<u32>| start.max(part.rows.start)..end.min(part.rows.end);
        let missing = self.missing(&part.samples).into_iter();
        let inside = missing.map(|block| SampleBlock { rows: within(block.rows), ..block });
        inside.filter(|block| !block.rows.is_empty()).collect()
    }

    /// Adds the block `part`; rows beyond the image are ignored.
    ///
    /// # Errors
    ///
    /// [`Overlap`] if some of its samples are held already; then nothing is added.
    pub fn insert(&mut self, part: &SampleBlock) -> Result<(), Overlap> {
        let rows = part.rows.clone().filter(|_| !part.samples.is_empty());
        self.insert_rows(rows.map(|row| (row, std::slice::from_ref(&part.samples))))
    }

    /// Adds all samples of another coverage.
    ///
    /// # Errors
    ///
    /// [`Overlap`] if some of them are held already; then nothing is added.
    pub fn merge(&mut self, other: &Self) -> Result<(), Overlap> {
        self.insert_rows((0..).zip(other.rows.iter().map(Vec::as_slice)))
    }

    fn insert_rows<'a>(
        &mut self,
        rows: impl Iterator<Item = (u32, &'a [Range<u32>])> + Clone,
    ) -> Result<(), Overlap> {
        for (row, ranges) in rows.clone() {
            for new in ranges {
                // The ranges are in order, so only those before and after can overlap.
                let held = self.samples(row);
                let at = held.partition_point(|old| old.start < new.start);
                let common = |old: &Range<u32>| old.start.max(new.start)..old.end.min(new.end);
                let mut beside = held[at.saturating_sub(1)..].iter().take(2).map(common);
                if let Some(samples) = beside.find(|range| !range.is_empty()) {
                    return Err(Overlap { row, samples });
                }
            }
        }
        for (row, ranges) in rows {
            let Some(held) = self.rows.get_mut(row as usize) else { continue };
            for new in ranges {
                // The range goes into its place, then it is joined with the neighbours that it
                // touches.
                let at = held.partition_point(|old| old.start < new.start);
                held.insert(at, new.clone());
                if held.get(at + 1).is_some_and(|next| next.start == new.end) {
                    held[at].end = held.remove(at + 1).end;
                }
                if at > 0 && held[at - 1].end == new.start {
                    held[at - 1].end = held.remove(at).end;
                }
            }
        }
        Ok(())
    }
}

/// Returns the parts of `within` that no range of `held` covers; the ranges of `held` are in order.
fn gaps(held: &[Range<u32>], within: &Range<u32>) -> Vec<Range<u32>> {
    let mut gaps = Vec::new();
    let mut next = within.start;
    for range in held {
        if next < range.start.min(within.end) {
            gaps.push(next..range.start.min(within.end));
        }
        next = next.max(range.end);
    }
    if next < within.end {
        gaps.push(next..within.end);
    }
    gaps
}

/// Combines the ranges of each row into blocks: adjacent rows with the same ranges form one block.
fn together<'a>(rows: impl Iterator<Item = &'a [Range<u32>]>) -> Vec<SampleBlock> {
    let mut parts: Vec<SampleBlock> = Vec::new();
    let mut open: (u32, &[Range<u32>]) = (0, &[]);
    let mut close = |rows: Range<u32>, ranges: &[Range<u32>]| {
        parts.extend(
            ranges.iter().map(|samples| SampleBlock { rows: rows.clone(), samples: samples.clone() }),
        );
    };
    let mut end = 0;
    for (row, ranges) in (0u32..).zip(rows) {
        end = row + 1;
        if ranges != open.1 {
            close(open.0..row, open.1);
            open = (row, ranges);
        }
    }
    close(open.0..end, open.1);
    parts.sort_by_key(|part| (part.samples.start, part.rows.start));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(rows: Range<u32>, samples: Range<u32>) -> SampleBlock {
        SampleBlock { rows, samples }
    }

    #[test]
    fn how_it_came_together_does_not_show() {
        let mut whole = SampleCoverage::new(4);
        whole.insert(&part(0..4, 0..1024)).unwrap();
        let pieces = [part(0..2, 256..512), part(2..4, 512..1024), part(0..2, 512..1024), part(0..4, 0..256)];
        let last = part(2..4, 256..512);
        let mut one = SampleCoverage::new(4);
        for piece in pieces.iter().chain([&last]) {
            assert_ne!(one, whole);
            one.insert(piece).unwrap();
        }
        assert_eq!(one, whole);
        let (mut a, mut b) = (SampleCoverage::new(4), SampleCoverage::new(4));
        pieces[..2].iter().for_each(|p| a.insert(p).unwrap());
        pieces[2..].iter().chain([&last]).for_each(|p| b.insert(p).unwrap());
        a.merge(&b).unwrap();
        assert_eq!(a, whole);
        assert_eq!(a.samples(3), std::slice::from_ref(&(0..1024)));
        assert!(a.samples(4).is_empty());
    }

    #[test]
    fn what_is_there_and_what_is_not() {
        let mut one = SampleCoverage::new(4);
        assert_eq!((one.parts(), one.missing(&(0..512))), (vec![], vec![part(0..4, 0..512)]));
        one.insert(&part(0..4, 0..256)).unwrap();
        one.insert(&part(1..3, 256..512)).unwrap();
        one.insert(&part(3..4, 768..1024)).unwrap();
        let held = [part(0..1, 0..256), part(1..3, 0..512), part(3..4, 0..256), part(3..4, 768..1024)];
        assert_eq!(one.parts(), held);
        let missing = [part(0..1, 256..1024), part(3..4, 256..768), part(1..3, 512..1024)];
        assert_eq!(one.missing(&(0..1024)), missing);
        assert_eq!(one.missing(&(300..400)), [part(0..1, 300..400), part(3..4, 300..400)]);
        assert_eq!(one.missing(&(0..256)), []);
        assert_eq!(one.missing_in(&part(2..4, 0..768)), [part(3..4, 256..768), part(2..3, 512..768)]);
        assert_eq!(one.missing_in(&part(1..3, 0..512)), []);
        assert_eq!(one.missing_in(&part(4..9, 0..512)), []);
        // What was held and what was missing together are all samples.
        missing.iter().for_each(|part| one.insert(part).unwrap());
        assert_eq!(one.parts(), [part(0..4, 0..1024)]);
    }

    #[test]
    fn what_is_there_twice_is_named_and_nothing_is_added() {
        let mut one = SampleCoverage::new(4);
        one.insert(&part(2..3, 256..512)).unwrap();
        let before = one.clone();
        assert_eq!(one.insert(&part(0..4, 0..300)), Err(Overlap { row: 2, samples: 256..300 }));
        assert_eq!(one.merge(&before), Err(Overlap { row: 2, samples: 256..512 }));
        assert_eq!(one, before);
        one.insert(&part(2..3, 512..600)).unwrap();
        one.insert(&part(2..3, 9..9)).unwrap();
        assert_eq!(one.samples(2), std::slice::from_ref(&(256..600)));
    }
}
