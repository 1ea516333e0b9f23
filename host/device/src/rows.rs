//! Rows of an image for a launch, a chunk or a rank.

use std::ops::Range;

/// Rows of an image: a range of the rows of a share, such as that of a rank. A share consists of
/// blocks of `2^shift` adjacent rows at equal distances.
///
/// Row k of the share is row `first + k + (k >> shift) * gap` of the image, so that a device
/// computes it with a shift and a multiplication.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RowSet {
    first: u32,
    shift: u32,
    gap: u32,
    /// Range of rows, by their indices in the share.
    places: Range<u32>,
}

/// Maximum number of rows of a block, as a power of two.
const MAX_SHIFT: u32 = 31;

impl From<Range<u32>> for RowSet {
    fn from(rows: Range<u32>) -> Self {
        Self { first: 0, shift: MAX_SHIFT, gap: 0, places: rows }
    }
}

impl RowSet {
    /// Returns share `index` of `of`: every `of`-th block of `2^shift` rows of an image of `height`
    /// rows, from block `index` on. All shares together are the image, each row once.
    pub fn interleaved(height: u32, shift: u32, index: u32, of: u32) -> Self {
        let (shift, of) = (shift.min(MAX_SHIFT - 1), of.max(1));
        let block = 1u64 << shift;
        let first = u64::from(index) * block;
        let period = u64::from(of) * block;
        if first >= u64::from(height) {
            return Self::from(0..0);
        }
        let left = u64::from(height) - first;
        // Whole periods, and the rows of the last block that lie in the image.
        let count = left / period * block + (left % period).min(block);
        // A share of one block has no gap; any other's fits between two rows of the image.
        let gap = if count <= block { 0 } else { (period - block) as u32 };
        let shift = if count <= block { MAX_SHIFT } else { shift };
        Self { first: first as u32, shift, gap, places: 0..count as u32 }
    }

    /// Returns the number of rows.
    pub fn len(&self) -> u32 {
        self.places.end.saturating_sub(self.places.start)
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns some of these rows, by their indices among them; indices beyond the last are
    /// ignored.
    pub fn part(&self, places: Range<u32>) -> Self {
        let place =
            |at: u32| self.places.start.saturating_add(at).min(self.places.end.max(self.places.start));
        Self { places: place(places.start)..place(places.end.max(places.start)), ..self.clone() }
    }

    /// Returns the blocks of adjacent rows of the image, in order.
    pub fn blocks(&self) -> impl Iterator<Item = Range<u32>> + Clone + '_ {
        let Self { first, shift, gap, places: ref own } = *self;
        let mut at = own.start;
        std::iter::from_fn(move || {
            if at >= own.end {
                return None;
            }
            let block = at >> shift;
            let end = ((u64::from(block) + 1) << shift).min(u64::from(own.end)) as u32;
            let offset = first + block * gap;
            let rows = at + offset..end + offset;
            at = end;
            Some(rows)
        })
    }

    /// Returns each row of the image, in order.
    pub fn iter(&self) -> impl Iterator<Item = u32> + Clone + '_ {
        self.blocks().flatten()
    }

    /// Returns one past the last row of the image; 0 if there are no rows.
    pub fn end(&self) -> u32 {
        let Some(last) = self.places.end.checked_sub(1).filter(|_| !self.is_empty()) else { return 0 };
        self.first + last + (last >> self.shift) * self.gap + 1
    }

    /// Returns the rows `own` of a [share](Self::share), or `None` if no image can have them.
    pub fn of_share((first, shift, gap): (u32, u32, u32), own: Range<u32>) -> Option<Self> {
        let last = u64::from(own.end.saturating_sub(1));
        let row = u64::from(first) + last + (last >> shift.min(MAX_SHIFT)) * u64::from(gap);
        let fits = own.start <= own.end && shift <= MAX_SHIFT && row < u64::from(u32::MAX);
        fits.then_some(Self { first, shift, gap, places: own })
    }

    /// Returns the share for launch parameters: its first row, the rows of a block as a power of
    /// two, and the rows between two blocks.
    pub fn share(&self) -> (u32, u32, u32) {
        (self.first, self.shift, self.gap)
    }

    /// Returns the range of rows, by their indices in the share.
    pub fn places(&self) -> Range<u32> {
        self.places.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_the_image() {
        for height in [1, 7, 16, 225, 1080] {
            for shift in [0, 2, 4, 30, 31] {
                for of in [1, 2, 3, 7, height + 1] {
                    let mut seen = vec![0; height as usize];
                    for index in 0..of {
                        let rows = RowSet::interleaved(height, shift, index, of);
                        assert_eq!(rows.iter().count(), rows.len() as usize);
                        rows.iter().for_each(|row| seen[row as usize] += 1);
                        assert!(rows.end() <= height);
                    }
                    assert!(seen.iter().all(|&count| count == 1), "{height} {shift} {of}");
                }
            }
        }
    }

    /// Kernels compute the rows that the host counts.
    #[test]
    fn a_launch_has_the_same_rows() {
        for index in 0..3 {
            let rows = RowSet::interleaved(225, 3, index, 3).part(5..40);
            let (share_row, block_shift, block_gap) = rows.share();
            let params = trisect_shared::params::RenderParams {
                first_row: rows.places().start,
                share_first_row: share_row,
                block_shift,
                block_gap,
                ..bytemuck::Zeroable::zeroed()
            };
            let of_kernel: Vec<u32> = (0..rows.len()).map(|index| params.row(index)).collect();
            assert_eq!(of_kernel, rows.iter().collect::<Vec<_>>());
        }
    }

    #[test]
    fn parts() {
        let rows = RowSet::interleaved(20, 2, 1, 2); // 4-7, 12-15
        assert_eq!(rows.part(2..6).iter().collect::<Vec<_>>(), [6, 7, 12, 13]);
        assert_eq!(rows.part(2..6).part(1..99).iter().collect::<Vec<_>>(), [7, 12, 13]);
        assert_eq!(rows.part(2..6).blocks().collect::<Vec<_>>(), [6..8, 12..14]);
        assert!(rows.part(9..12).is_empty());
        assert_eq!(RowSet::from(3..9).part(1..3).blocks().next(), Some(4..6));
    }
}
