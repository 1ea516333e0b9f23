//! Where a device copies rows of pixels to.
#![allow(
    unsafe_code,
    reason = "frames are filled by several processes at once; each block names why it is sound"
)]

use super::{HostMemory, RowSet};
use rayon::prelude::*;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

/// Host memory for rows of an image: one below the other, or where a whole image has them.
#[derive(Debug)]
pub struct RowTarget<'a> {
    first: *mut u32,
    width: usize,
    rows: RowSet,
    packed: bool,
    memory: PhantomData<&'a mut [u32]>,
}

// SAFETY: it is the only one to reach its rows, as a `&mut [u32]` of each would be.
unsafe impl Send for RowTarget<'_> {}

/// Rows of the same number at equal distances, as a copy of a rectangle takes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CopyRect {
    /// The image's first row.
    pub start: u32,
    /// Rows that lie below each other.
    pub length: u32,
    /// From one such block to the next, in the image.
    pub step: u32,
    /// Blocks.
    pub count: u32,
}

impl CopyRect {
    /// All of `rows`, in order. No step is longer than `most`.
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

    /// Rows in all.
    pub fn rows(&self) -> u32 {
        self.length * self.count
    }
}

impl<'a> RowTarget<'a> {
    /// Rows one below the other, `width` pixels each, which is all that `pixels` has then.
    pub fn packed(pixels: &'a mut Vec<u32>, width: u32, rows: &RowSet) -> Self {
        let width = width as usize;
        pixels.resize(width * rows.len() as usize, 0);
        Self { first: pixels.as_mut_ptr(), width, rows: rows.clone(), packed: true, memory: PhantomData }
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Which rows.
    pub fn rows(&self) -> &RowSet {
        &self.rows
    }

    /// Where the first row of a grid of [these rows](Self::rows) goes, and how many rows lie from one of its blocks to the next there. `before` rows come
    /// before it.
    pub(crate) fn place(&mut self, grid: &CopyRect, before: u32) -> (*mut u32, u32) {
        let row = if self.packed { before } else { grid.start };
        let step = if self.packed { grid.length } else { grid.step };
        // SAFETY: the row is one of the target's, or one past its last where the grid is empty.
        (unsafe { self.first.add(row as usize * self.width) }, step)
    }

    /// Each row's pixels, in order.
    pub fn each_row(&mut self) -> Vec<(u32, &mut [u32])> {
        let (first, width, packed) = (self.first, self.width, self.packed);
        let rows = self.rows.iter().zip(0u32..);
        rows.map(|(row, index)| {
            let at = if packed { index } else { row } as usize * width;
            // SAFETY: the memory has this row, which differs from all others; `self` is borrowed as long as any is used.
            (row, unsafe { std::slice::from_raw_parts_mut(first.add(at), width) })
        })
        .collect()
    }

    /// Copies rows that lie one below the other.
    pub fn copy_from(&mut self, pixels: &[u32]) {
        let width = self.width.max(1);
        let rows = self.each_row();
        rows.into_par_iter()
            .zip(pixels.par_chunks_exact(width))
            .with_min_len(32)
            .for_each(|((_, to), from)| to.copy_from_slice(from));
    }
}

/// Memory for some frames of an image, one after the other, which several fill: ranks that share it, or one process.
#[derive(Debug)]
pub struct FrameMemory {
    memory: Arc<HostMemory>,
    width: u32,
    height: u32,
    frames: u32,
}

impl FrameMemory {
    /// Of this process, black.
    pub fn new(width: u32, height: u32, frames: u32) -> Self {
        let bytes = Self::words(width, height, frames).saturating_mul(size_of::<u32>());
        let memory = Arc::new(HostMemory::new(bytes));
        Self { memory, width, height, frames }
    }

    /// Of several processes; none where that is not the memory of so many frames.
    #[cfg(feature = "mpi")]
    pub(crate) fn of(memory: HostMemory, width: u32, height: u32, frames: u32) -> Option<Self> {
        let fits = memory.bytes() >= Self::words(width, height, frames).saturating_mul(size_of::<u32>());
        fits.then(|| Self { memory: Arc::new(memory), width, height, frames })
    }

    /// Pixels of so many frames.
    pub fn words(width: u32, height: u32, frames: u32) -> usize {
        (width as usize).saturating_mul(height as usize).saturating_mul(frames as usize)
    }

    /// Where it is.
    pub fn memory(&self) -> &Arc<HostMemory> {
        &self.memory
    }

    fn frame(&self, number: u32) -> *mut u32 {
        let place = number % self.frames.max(1);
        // SAFETY: the memory has this frame.
        unsafe { self.memory.first().cast::<u32>().add(Self::words(self.width, self.height, place)) }
    }

    /// Rows of the frame of this number; frames take turns. None where the image has no such rows.
    ///
    /// # Safety
    ///
    /// No one else reads or writes these rows of the frame as long as the target is used.
    pub unsafe fn target(&self, number: u32, rows: &RowSet) -> Option<RowTarget<'_>> {
        (rows.end() <= self.height && self.frames > 0).then(|| RowTarget {
            first: self.frame(number),
            width: self.width as usize,
            rows: rows.clone(),
            packed: false,
            memory: PhantomData,
        })
    }

    /// The frame of this number.
    ///
    /// # Safety
    ///
    /// No one writes to it as long as it is used.
    pub unsafe fn read(&self, number: u32) -> &[u32] {
        if self.frames == 0 {
            return &[];
        }
        // SAFETY: the memory has this frame.
        unsafe { std::slice::from_raw_parts(self.frame(number), Self::words(self.width, self.height, 1)) }
    }
}

/// One frame that a device may [copy to without a detour](crate::render::Renderer::pin).
#[derive(Debug)]
pub struct HostFrame(FrameMemory);

impl HostFrame {
    /// A black one.
    pub fn new(width: u32, height: u32) -> Self {
        Self(FrameMemory::new(width, height, 1))
    }

    /// Pixels across and down.
    pub fn size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    /// For [`Renderer::pin`](crate::render::Renderer::pin).
    pub fn memory(&self) -> &Arc<HostMemory> {
        self.0.memory()
    }

    /// All of it.
    pub fn target(&mut self) -> RowTarget<'_> {
        // Whoever else has the memory promises not to touch what this hands out, and this does so once at a time.
        RowTarget {
            first: self.0.frame(0),
            width: self.0.width as usize,
            rows: RowSet::from(0..self.0.height),
            packed: false,
            memory: PhantomData,
        }
    }

    /// Row by row from the top.
    pub fn pixels(&self) -> &[u32] {
        // SAFETY: as above.
        unsafe { self.0.read(0) }
    }
}

/// The rows that a device makes of an image whose first shown row is `first`.
pub(crate) fn span(first: u32, rows: &RowSet) -> Range<u32> {
    first..rows.end().max(first)
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
            // SAFETY: one after the other.
            let mut target = unsafe { memory.target(5, share) }.unwrap();
            let pixels: Vec<u32> = share.iter().flat_map(|row| [value + row; 3]).collect();
            target.copy_from(&pixels);
            let mut packed = Vec::new();
            let mut target = RowTarget::packed(&mut packed, 3, share);
            target.each_row().into_iter().for_each(|(row, to)| to.fill(value + row));
            assert_eq!(packed, pixels);
        }
        // SAFETY: no one writes.
        let (frame, other) = unsafe { (memory.read(3), memory.read(0)) };
        let expected = |row: u32| row + if (row / 4).is_multiple_of(2) { 10 } else { 20 };
        assert!(frame.iter().zip(0..).all(|(&pixel, at)| pixel == expected(at / 3)));
        assert!(other.iter().all(|&pixel| pixel == 0));
        // SAFETY: there is no such row.
        assert!(unsafe { memory.target(0, &RowSet::from(19..21)) }.is_none());
    }

    /// A device copies rectangles there: by `place`, as by rows.
    #[test]
    fn rectangles_go_where_rows_go() {
        let rows = RowSet::interleaved(225, 3, 1, 3).part(5..60);
        let mut pixels = Vec::new();
        let memory = FrameMemory::new(2, 225, 1);
        // SAFETY: no one else has it.
        let whole = unsafe { memory.target(0, &rows) }.unwrap();
        for mut target in [RowTarget::packed(&mut pixels, 2, &rows), whole] {
            let expected: Vec<(u32, *mut u32)> =
                target.each_row().into_iter().map(|(row, to)| (row, to.as_mut_ptr())).collect();
            let mut found = Vec::new();
            let mut before = 0;
            for grid in CopyRect::all(&rows, u32::MAX) {
                let (first, step) = target.place(&grid, before);
                before += grid.rows();
                for block in 0..grid.count {
                    for row in 0..grid.length {
                        let at = (block * step + row) as usize * 2;
                        found.push((grid.start + block * grid.step + row, first.wrapping_add(at)));
                    }
                }
            }
            assert_eq!(found, expected);
        }
    }
}
