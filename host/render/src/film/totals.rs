//! Totals of a film's pixels: exact sums, or the sums of one chunk, which are exact as they are.

use super::{AovTotals, FilmCounts, HostRecords, PixelTotals, TASK};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use trisect_device::HostMemory;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// Totals of one pixel, over chunks that kernels sum.
pub trait OverChunks: Pod + Send + Sync + std::fmt::Debug {
    /// Totals over no samples.
    const EMPTY: Self;

    /// Sums of a chunk.
    type Sums: Pod + Zeroable + Send + Sync + std::fmt::Debug;

    /// Returns the totals of a chunk that should hold `samples`.
    fn of_chunk(sums: &Self::Sums, samples: &Range<u32>) -> Self;
}

impl OverChunks for PixelTotals {
    const EMPTY: Self = Self::EMPTY;
    type Sums = PixelSums;

    #[inline]
    fn of_chunk(sums: &PixelSums, samples: &Range<u32>) -> Self {
        Self::of(sums, samples.len() as u32)
    }
}

impl OverChunks for AovTotals {
    const EMPTY: Self = Self::EMPTY;
    type Sums = AovSums;

    #[inline]
    fn of_chunk(sums: &AovSums, samples: &Range<u32>) -> Self {
        let mut totals = Self::EMPTY;
        totals.merge(sums, samples.start, samples.len() as u32);
        totals
    }
}

/// Totals of each pixel of an image. Those of a film of no chunk or of one are computed when they
/// are asked for: the first touch of memory for all totals takes longer than a few samples.
#[derive(Debug)]
pub enum Totals<T: OverChunks> {
    /// No samples, in this number of pixels.
    Empty(usize),
    /// Totals, in memory to which a device can copy.
    Exact(HostRecords<T>),
    /// Sums of the only chunk.
    Chunk {
        /// Sums of each pixel.
        sums: HostRecords<T::Sums>,
        /// Samples that each pixel should hold.
        samples: Range<u32>,
    },
}

impl<T: OverChunks> Totals<T> {
    /// Returns totals of so many pixels, each of which `of` returns, on all threads if they are
    /// more than a task.
    pub(crate) fn of_each(pixels: usize, of: impl Fn(usize) -> T + Send + Sync) -> Self {
        let mut exact = HostRecords::new(pixels);
        if pixels <= TASK {
            exact.iter_mut().enumerate().for_each(|(pixel, totals)| *totals = of(pixel));
            return Self::Exact(exact);
        }
        let all = exact.par_iter_mut().enumerate().with_min_len(TASK);
        all.for_each(|(pixel, totals)| *totals = of(pixel));
        Self::Exact(exact)
    }

    /// Returns the number of pixels.
    pub fn len(&self) -> usize {
        match self {
            Self::Empty(pixels) => *pixels,
            Self::Exact(totals) => totals.len(),
            Self::Chunk { sums, .. } => sums.len(),
        }
    }

    /// Returns whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether the pixels are too few to be shared by threads: to wake another thread takes
    /// longer.
    fn is_one_task(&self) -> bool {
        self.len() <= TASK
    }

    /// Returns the number of bytes in memory.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Empty(_) => 0,
            Self::Exact(totals) => size_of_val(&totals[..]) as u64,
            Self::Chunk { sums, .. } => size_of_val(&sums[..]) as u64,
        }
    }

    /// Returns the totals of a pixel, or `None` beyond the last.
    pub fn get(&self, pixel: usize) -> Option<T> {
        match self {
            Self::Empty(pixels) => (pixel < *pixels).then_some(T::EMPTY),
            Self::Exact(totals) => totals.get(pixel).copied(),
            Self::Chunk { sums, samples } => sums.get(pixel).map(|sums| T::of_chunk(sums, samples)),
        }
    }

    /// Returns the totals of each pixel, in order.
    pub fn iter(&self) -> TotalsIter<'_, T> {
        TotalsIter { totals: self, next: 0 }
    }

    /// Calls `use_totals` with each pixel's totals and its own element of `output`, on all threads
    /// if they are more than a task. Elements beyond the last pixel stay as they are.
    pub fn for_each_with<U: Send>(&self, output: &mut [U], use_totals: impl Fn(&mut U, T) + Send + Sync) {
        if self.is_one_task() {
            return output.iter_mut().zip(self).for_each(|(output, totals)| use_totals(output, totals));
        }
        let output = output.par_iter_mut();
        match self {
            Self::Empty(pixels) => {
                output.take(*pixels).with_min_len(TASK).for_each(|output| use_totals(output, T::EMPTY))
            }
            Self::Exact(totals) => output
                .zip(&totals[..])
                .with_min_len(TASK)
                .for_each(|(output, totals)| use_totals(output, *totals)),
            Self::Chunk { sums, samples } => output
                .zip(&sums[..])
                .with_min_len(TASK)
                .for_each(|(output, sums)| use_totals(output, T::of_chunk(sums, samples))),
        }
    }

    /// Returns `convert` of each pixel's totals, in order.
    pub fn map<U: Send>(&self, convert: impl Fn(T) -> U + Send + Sync) -> Vec<U> {
        match self {
            _ if self.is_one_task() => self.iter().map(convert).collect(),
            // Also in parallel, because of the first touch.
            Self::Empty(pixels) => {
                rayon::iter::repeat_n(T::EMPTY, *pixels).with_min_len(TASK).map(convert).collect()
            }
            Self::Exact(totals) => {
                totals.par_iter().with_min_len(TASK).map(|totals| convert(*totals)).collect()
            }
            Self::Chunk { sums, samples } => {
                sums.par_iter().with_min_len(TASK).map(|sums| convert(T::of_chunk(sums, samples))).collect()
            }
        }
    }

    /// Returns the totals of all pixels.
    pub fn exact(&self) -> Cow<'_, [T]> {
        match self {
            Self::Exact(totals) => Cow::Borrowed(totals),
            Self::Empty(_) | Self::Chunk { .. } => Cow::Owned(self.map(|totals| totals)),
        }
    }

    /// Returns the memory of all totals, if they have memory of their own.
    pub(crate) fn memory(&self) -> Option<&Arc<HostMemory>> {
        match self {
            Self::Exact(totals) => Some(totals.memory()),
            Self::Empty(_) | Self::Chunk { .. } => None,
        }
    }

    /// Returns the totals of all pixels, to change them. It computes those of a chunk first.
    pub fn exact_mut(&mut self) -> &mut [T] {
        if let Self::Empty(_) | Self::Chunk { .. } = self {
            let mut exact = HostRecords::new(self.len());
            self.for_each_with(&mut exact, |to, from| *to = from);
            *self = Self::Exact(exact);
        }
        match self {
            Self::Exact(totals) => totals,
            Self::Empty(_) | Self::Chunk { .. } => &mut [], // it was replaced
        }
    }

    /// Removes all samples. Memory for totals stays.
    pub fn clear(&mut self) {
        match self {
            Self::Exact(totals) if totals.len() <= TASK => totals.fill(T::EMPTY),
            Self::Exact(totals) => {
                totals.par_iter_mut().with_min_len(TASK).for_each(|totals| *totals = T::EMPTY)
            }
            Self::Empty(_) | Self::Chunk { .. } => *self = Self::Empty(self.len()),
        }
    }

    /// Makes these totals those of another film; memory of the same size is reused.
    pub fn copy_from(&mut self, other: &Self) {
        if self.len() != other.len() {
            *self = Self::Empty(other.len());
        }
        other.for_each_with(self.exact_mut(), |to, from| *to = from);
    }
}

/// Iterator over the totals of each pixel.
#[derive(Debug)]
pub struct TotalsIter<'a, T: OverChunks> {
    totals: &'a Totals<T>,
    next: usize,
}

impl<T: OverChunks> Iterator for TotalsIter<'_, T> {
    type Item = T;

    fn next(&mut self) -> Option<T> {
        let totals = self.totals.get(self.next)?;
        self.next += 1;
        Some(totals)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.totals.len() - self.next;
        (left, Some(left))
    }
}

impl<T: OverChunks> ExactSizeIterator for TotalsIter<'_, T> {}

impl<'a, T: OverChunks> IntoIterator for &'a Totals<T> {
    type Item = T;
    type IntoIter = TotalsIter<'a, T>;

    fn into_iter(self) -> TotalsIter<'a, T> {
        self.iter()
    }
}

impl Totals<PixelTotals> {
    /// Returns the counts over these pixels; those beyond the last have none.
    pub fn counts(&self, pixels: Range<usize>) -> FilmCounts {
        let count = |pixel| self.get(pixel).map_or_else(FilmCounts::default, |totals| totals.counts());
        if self.is_one_task() {
            return pixels.map(count).fold(FilmCounts::default(), |a, b| a + b);
        }
        pixels.into_par_iter().with_min_len(TASK).map(count).reduce(FilmCounts::default, |a, b| a + b)
    }
}

impl<T: OverChunks> From<&[T]> for Totals<T> {
    fn from(totals: &[T]) -> Self {
        Self::of_each(totals.len(), |pixel| totals[pixel])
    }
}

impl<T: OverChunks> Default for Totals<T> {
    fn default() -> Self {
        Self::Empty(0)
    }
}

/// The copy of a chunk has totals.
impl<T: OverChunks> Clone for Totals<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Empty(pixels) => Self::Empty(*pixels),
            Self::Exact(totals) => totals[..].into(),
            Self::Chunk { .. } => {
                let mut copy = Self::Empty(self.len());
                copy.copy_from(self);
                copy
            }
        }
    }
}

/// Totals are equal if those of each pixel are.
impl<T: OverChunks + PartialEq> PartialEq for Totals<T> {
    fn eq(&self, other: &Self) -> bool {
        self.exact() == other.exact()
    }
}
