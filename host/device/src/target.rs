//! Host memory that a device copies rows of an image to: packed rows, or whole frames.
#![allow(
    unsafe_code,
    reason = "frames are filled by several processes at once; each block says why it is sound"
)]

use super::{HostMemory, RowSet};
use bytemuck::Pod;
use rayon::prelude::*;
use std::marker::PhantomData;
use std::sync::Arc;

/// Host memory for rows of an image: packed, or at their places in the whole image.
#[derive(Debug)]
pub struct RowTarget<'a> {
    first: *mut u8,
    /// Bytes of a row.
    row: usize,
    rows: RowSet,
    packed: bool,
    memory: PhantomData<&'a mut [u8]>,
}

// SAFETY: nothing else reaches its rows, as with a `&mut [u32]` of each.
unsafe impl Send for RowTarget<'_> {}

/// Blocks of the same number of rows at equal distances, which a device copies as one rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CopyRect {
    /// First row of the image.
    pub start: u32,
    /// Number of adjacent rows in a block.
    pub length: u32,
    /// Number of rows from the start of a block to the start of the next, in the image.
    pub step: u32,
    /// Number of blocks.
    pub count: u32,
}

impl CopyRect {
    /// Returns rectangles that together are `rows`, in order. From the start of one block of a
    /// rectangle to that of the next it is at most `most` rows.
    pub fn all(rows: &RowSet, most: u32) -> Vec<Self> {
        let mut grids: Vec<Self> = Vec::new();
        for block in rows.blocks() {
            let length = block.len() as u32;
            match grids.last_mut() {
                Some(grid)
                    if grid.length == length && grid.count == 1 && block.start - grid.start <= most =>
                {
                    (grid.step, grid.count) = (block.start - grid.start, 2);
                }
                Some(grid)
                    if grid.length == length
                        && grid.count > 1
                        && block.start == grid.start + grid.step * grid.count =>
                {
                    grid.count += 1;
                }
                _ => grids.push(Self { start: block.start, length, step: length, count: 1 }),
            }
        }
        grids
    }

    /// Returns the number of rows in all blocks.
    pub fn rows(&self) -> u32 {
        self.length * self.count
    }
}

/// Number of bytes from which on another thread takes part in a copy.
const MIN_COPY: usize = 1 << 16;

impl<'a> RowTarget<'a> {
    /// Returns a target that packs rows of `width` pixels into `pixels`, which is resized to hold
    /// just these.
    pub fn packed(pixels: &'a mut Vec<u32>, width: u32, rows: &RowSet) -> Self {
        pixels.resize(width as usize * rows.len() as usize, 0);
        Self::records(pixels, rows)
    }

    /// Returns a target that packs rows of records, equally many each, into `records`.
    pub fn records<T: Pod>(records: &'a mut [T], rows: &RowSet) -> Self {
        let row = size_of_val(records) / (rows.len() as usize).max(1);
        let first = records.as_mut_ptr().cast();
        Self { first, row, rows: rows.clone(), packed: true, memory: PhantomData }
    }

    /// Returns the same target for a shorter time.
    pub fn reborrow(&mut self) -> RowTarget<'_> {
        RowTarget { rows: self.rows.clone(), memory: PhantomData, ..*self }
    }

    /// Returns whether the first row's address lies in memory of which `is_own` says so.
    pub(crate) fn starts_in(&self, is_own: impl Fn(usize) -> bool) -> bool {
        is_own(self.first as usize)
    }

    /// Returns the number of bytes of a row.
    pub fn row_bytes(&self) -> usize {
        self.row
    }

    /// Returns the rows of the target.
    pub fn rows(&self) -> &RowSet {
        &self.rows
    }

    /// Returns the address of the first row of a rectangle of [these rows](Self::rows), and the
    /// number of rows there from the start of a block to the start of the next. `before` is the
    /// number of the target's rows before the rectangle.
    pub(crate) fn place(&mut self, grid: &CopyRect, before: u32) -> (*mut u8, u32) {
        let row = if self.packed { before } else { grid.start };
        let step = if self.packed { grid.length } else { grid.step };
        // SAFETY: the row is one of the target's, or one past its last if the rectangle is empty.
        (unsafe { self.first.add(row as usize * self.row) }, step)
    }

    /// Returns the index and the bytes of each row, in order.
    pub fn each_row(&mut self) -> Vec<(u32, &mut [u8])> {
        let (first, bytes, packed) = (self.first, self.row, self.packed);
        let rows = self.rows.iter().zip(0u32..);
        rows.map(|(row, index)| {
            let at = if packed { index } else { row } as usize * bytes;
            // SAFETY: the memory has this row, which differs from all others; `self` stays borrowed
            // as long as any of them is used.
            (row, unsafe { std::slice::from_raw_parts_mut(first.add(at), bytes) })
        })
        .collect()
    }

    /// Copies packed rows to the target.
    pub fn copy_from(&mut self, bytes: &[u8]) {
        let row = self.row.max(1);
        let rows = self.each_row();
        rows.into_par_iter()
            .zip(bytes.par_chunks_exact(row))
            .with_min_len(MIN_COPY.div_ceil(row))
            .for_each(|((_, to), from)| to.copy_from_slice(from));
    }
}

/// Memory for several frames of an image, used in turn, and filled by one process or by the ranks
/// that share it.
#[derive(Debug)]
pub struct FrameMemory {
    memory: Arc<HostMemory>,
    width: u32,
    height: u32,
    frames: u32,
}

impl FrameMemory {
    /// Allocates black frames in this process.
    pub fn new(width: u32, height: u32, frames: u32) -> Self {
        let bytes = Self::words(width, height, frames).saturating_mul(size_of::<u32>());
        let memory = Arc::new(HostMemory::new(bytes));
        Self { memory, width, height, frames }
    }

    /// Wraps memory that several processes share; `None` if it is too small for the frames.
    pub fn of(memory: HostMemory, width: u32, height: u32, frames: u32) -> Option<Self> {
        let fits = memory.bytes() >= Self::words(width, height, frames).saturating_mul(size_of::<u32>());
        fits.then(|| Self { memory: Arc::new(memory), width, height, frames })
    }

    /// Returns the number of pixels in `frames` frames.
    pub fn words(width: u32, height: u32, frames: u32) -> usize {
        (width as usize).saturating_mul(height as usize).saturating_mul(frames as usize)
    }

    /// Returns the memory.
    pub fn memory(&self) -> &Arc<HostMemory> {
        &self.memory
    }

    fn frame(&self, number: u32) -> *mut u32 {
        let place = number % self.frames.max(1);
        // SAFETY: the memory has this frame.
        unsafe { self.memory.first().cast::<u32>().add(Self::words(self.width, self.height, place)) }
    }

    /// Returns a target for rows of frame `number`; frames take turns in the memory. Returns `None`
    /// if the image does not have these rows.
    ///
    /// # Safety
    ///
    /// Nothing else reads or writes these rows of the frame as long as the target is used.
    pub unsafe fn target(&self, number: u32, rows: &RowSet) -> Option<RowTarget<'_>> {
        (rows.end() <= self.height && self.frames > 0).then(|| RowTarget {
            first: self.frame(number).cast(),
            row: self.width as usize * size_of::<u32>(),
            rows: rows.clone(),
            packed: false,
            memory: PhantomData,
        })
    }

    /// Returns the pixels of frame `number`.
    ///
    /// # Safety
    ///
    /// Nothing writes to the frame as long as the pixels are used.
    pub unsafe fn read(&self, number: u32) -> &[u32] {
        if self.frames == 0 {
            return &[];
        }
        // SAFETY: the memory has this frame.
        unsafe { std::slice::from_raw_parts(self.frame(number), Self::words(self.width, self.height, 1)) }
    }
}

/// One frame in memory that can be [pinned](crate::Device::pin), so that a device copies
/// to it directly.
#[derive(Debug)]
pub struct HostFrame(FrameMemory);

impl HostFrame {
    /// Creates a black frame.
    pub fn new(width: u32, height: u32) -> Self {
        Self(FrameMemory::new(width, height, 1))
    }

    /// Returns the number of pixels across and down.
    pub fn size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    /// Returns the memory, for [`Device::pin`](crate::Device::pin).
    pub fn memory(&self) -> &Arc<HostMemory> {
        self.0.memory()
    }

    /// Returns a target for all rows.
    pub fn target(&mut self) -> RowTarget<'_> {
        // Whoever else holds the memory promises not to touch what this lends, and `&mut self`
        // lends it once at a time.
        RowTarget {
            first: self.0.frame(0).cast(),
            row: self.0.width as usize * size_of::<u32>(),
            rows: RowSet::from(0..self.0.height),
            packed: false,
            memory: PhantomData,
        }
    }

    /// Returns the pixels, row by row from the top.
    pub fn pixels(&self) -> &[u32] {
        // SAFETY: whoever else holds the memory promises not to touch it, and no target exists
        // beside `&self`.
        unsafe { self.0.read(0) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn grids_are_the_rows() {
        for height in [1, 7, 16, 225, 1080] {
            for of in [1, 2, 3, 7] {
                for index in 0..of {
                    let rows = RowSet::interleaved(height, 3, index, of);
                    for rows in [rows.part(3..rows.len().saturating_sub(2)), rows] {
                        for most in [0, 1 << 20] {
                            let grids = CopyRect::all(&rows, most);
                            assert!(most == 0 || grids.len() <= 3, "{grids:?}");
                            let all = grids.iter().flat_map(|grid| {
                                (0..grid.count).flat_map(|block| {
                                    let start = grid.start + block * grid.step;
                                    start..start + grid.length
                                })
                            });
                            assert!(all.eq(rows.iter()), "{rows:?} {grids:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn targets_have_their_rows() {
        let memory = FrameMemory::new(3, 20, 2);
        let shares = [0, 1].map(|index| RowSet::interleaved(20, 2, index, 2));
        for (share, value) in shares.iter().zip([10, 20]) {
            // SAFETY: one target is used after the other.
            let mut target = unsafe { memory.target(5, share) }.unwrap();
            let pixels: Vec<u32> = share.iter().flat_map(|row| [value + row; 3]).collect();
            target.copy_from(bytemuck::cast_slice(&pixels));
            let mut packed = Vec::new();
            let mut target = RowTarget::packed(&mut packed, 3, share);
            let rows = target.each_row().into_iter();
            rows.for_each(|(row, to)| bytemuck::cast_slice_mut(to).fill(value + row));
            assert_eq!(packed, pixels);
        }
        // SAFETY: nothing writes.
        let (frame, other) = unsafe { (memory.read(3), memory.read(0)) };
        let expected = |row: u32| row + if (row / 4).is_multiple_of(2) { 10 } else { 20 };
        assert!(frame.iter().zip(0..).all(|(&pixel, at)| pixel == expected(at / 3)));
        assert!(other.iter().all(|&pixel| pixel == 0));
        // SAFETY: there is no such row.
        assert!(unsafe { memory.target(0, &RowSet::from(19..21)) }.is_none());
    }

    /// The rectangles that a device copies go, by `place`, where the rows go.
    #[test]
    fn rectangles_go_where_rows_go() {
        let rows = RowSet::interleaved(225, 3, 1, 3).part(5..60);
        let mut pixels = Vec::new();
        let memory = FrameMemory::new(2, 225, 1);
        // SAFETY: nothing else has the memory.
        let whole = unsafe { memory.target(0, &rows) }.unwrap();
        for mut target in [RowTarget::packed(&mut pixels, 2, &rows), whole] {
            let expected: Vec<(u32, *mut u8)> =
                target.each_row().into_iter().map(|(row, to)| (row, to.as_mut_ptr())).collect();
            let mut found = Vec::new();
            let mut before = 0;
            for grid in CopyRect::all(&rows, u32::MAX) {
                let (first, step) = target.place(&grid, before);
                before += grid.rows();
                for block in 0..grid.count {
                    for row in 0..grid.length {
                        let at = (block * step + row) as usize * 2 * size_of::<u32>();
                        found.push((grid.start + block * grid.step + row, first.wrapping_add(at)));
                    }
                }
            }
            assert_eq!(found, expected);
        }
    }
}
