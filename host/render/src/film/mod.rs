//! The film: exact sums, over all samples, of the chunks that kernels sum in single precision.
//!
//! A [`Renderer`](crate::render::Renderer) merges chunks into a [`Film`]. Films of parts of a
//! render add up to the film of the whole, in any order and grouping.

mod aovs;
mod coverage;
mod sum;
mod tiles;

pub use aovs::AovTotals;
pub use coverage::{Overlap, SampleBlock, SampleCoverage};
pub use sum::ExactSum;
pub use tiles::{TILE, Tiles};
pub use trisect_device::{FrameMemory, HostFrame, HostMemory, HostRecords, RowSet, RowTarget};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use std::ops::Range;
use thiserror::Error;
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{FilteredPixel, GBufferTexel};
use trisect_shared::film::{Compensation, PixelSums};

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
    pub fn of(sums: &PixelSums, samples: u32) -> Self {
        let mut totals = Self::EMPTY;
        totals.merge(sums, samples);
        totals
    }

    fn is_empty(&self) -> bool {
        [self.samples, self.rejected, self.unwritten] == [0; 3]
    }

    /// Adds a chunk that should hold `samples` samples.
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
    pub fn mean(&self) -> [f64; 3] {
        self.radiance.map(|sum| sum.value() / self.samples as f64)
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

/// Result of a render before it is an image: [`PixelTotals`] of all pixels, row-major, top row
/// first, and the samples that they hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` totals.
    pub pixels: Vec<PixelTotals>,
    /// `width * height` AOV totals if the render has [AOV sums](crate::render::Settings::guides),
    /// otherwise none.
    pub aovs: Vec<AovTotals>,
    /// Samples that the totals hold.
    pub coverage: SampleCoverage,
}

/// Counts over some or all pixels of a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilmCounts {
    /// Number of samples in the sums.
    pub samples: u64,
    /// Number of NaN or infinite samples, which are left out.
    pub rejected: u64,
    /// Number of segments traced, shadow rays included.
    pub segments: u64,
    /// Number of pixels that lack samples because no kernel wrote them.
    pub unwritten: u64,
}

/// Error of an addition to a film.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FilmError {
    /// The films differ in size.
    #[error("a film of {}x{} cannot be added to one of {}x{}; render both at the same size", other.0, other.1, film.0, film.1)]
    Size {
        /// Pixels across and down of the film.
        film: (u32, u32),
        /// Pixels across and down of what was to be added.
        other: (u32, u32),
    },
    /// The chunk has the wrong number of pixels, or rows that the image does not have.
    #[error("a chunk of {pixels} pixels with rows {} to {} does not fit a film of {}x{}", rows.start, rows.end, film.0, film.1)]
    Chunk {
        /// Pixels across and down of the film.
        film: (u32, u32),
        /// Number of pixels in the chunk.
        pixels: usize,
        /// Rows of the chunk.
        rows: Range<u32>,
    },
    /// One film has AOV totals, the other has none.
    #[error(
        "one film has normals, albedos and positions, the other none; render both with the same `aov` and `denoise`"
    )]
    Aovs,
    /// Some samples would count twice.
    #[error("samples {} to {} of row {} are in both films; merge each part once", samples.start, samples.end, row)]
    Overlap {
        /// First row with such samples.
        row: u32,
        /// Indices of these samples.
        samples: Range<u32>,
    },
}

impl From<Overlap> for FilmError {
    fn from(Overlap { row, samples }: Overlap) -> Self {
        Self::Overlap { row, samples }
    }
}

/// Minimum number of pixels in a task of the thread pool.
pub const TASK: usize = 4096;

impl Film {
    /// Bytes that one pixel takes on the host: its totals; a chunk on the CPU backend with its
    /// compensation, and one read back; the image, and two copies of it while it is encoded.
    pub const BYTES_PER_PIXEL: u64 =
        (size_of::<PixelTotals>() + 2 * size_of::<PixelSums>() + size_of::<Compensation>() + 3 * 12) as u64;

    /// Additional bytes of one pixel with AOVs: their totals; a chunk of them on the CPU backend,
    /// and one read back; for denoising there, sums and AOV sums, two images, the G-buffer, the
    /// pixels read back and the image.
    pub const BYTES_PER_PIXEL_OF_AOVS: u64 = (size_of::<AovTotals>()
        + 3 * size_of::<AovSums>()
        + size_of::<PixelSums>()
        + 3 * size_of::<FilteredPixel>()
        + size_of::<GBufferTexel>()
        + 12) as u64;

    /// Creates a film without samples.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        // In parallel, because the first touch of fresh memory takes most of the time.
        let pixels = rayon::iter::repeat_n(PixelTotals::EMPTY, pixels).with_min_len(TASK).collect();
        Self { width, height, pixels, aovs: Vec::new(), coverage: SampleCoverage::new(height) }
    }

    /// Creates a film without samples that also has AOV totals.
    pub fn with_aovs(width: u32, height: u32) -> Self {
        let film = Self::new(width, height);
        let guides = rayon::iter::repeat_n(AovTotals::EMPTY, film.pixels.len()).with_min_len(TASK);
        Self { aovs: guides.collect(), ..film }
    }

    /// Returns the number of bytes of one pixel of a film, with or without AOV totals.
    pub fn bytes_per_pixel(guides: bool) -> u64 {
        (size_of::<PixelTotals>() + if guides { size_of::<AovTotals>() } else { 0 }) as u64
    }

    /// Returns the number of bytes of all totals.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.pixels[..]) + size_of_val(&self.aovs[..])) as u64
    }

    /// Makes this film a copy of another; memory of the same size is reused.
    pub fn copy_from(&mut self, other: &Self) {
        (self.width, self.height) = (other.width, other.height);
        copy(&mut self.pixels, &other.pixels, PixelTotals::EMPTY);
        copy(&mut self.aovs, &other.aovs, AovTotals::EMPTY);
        self.coverage = other.coverage.clone();
    }

    /// Removes all samples; the memory stays.
    pub fn clear(&mut self) {
        self.pixels.par_iter_mut().with_min_len(TASK).for_each(|total| *total = PixelTotals::EMPTY);
        self.aovs.par_iter_mut().with_min_len(TASK).for_each(|guides| *guides = AovTotals::EMPTY);
        self.coverage = SampleCoverage::new(self.height);
    }

    /// Adds a `chunk` of the rows of `part`, each pixel of which should hold `part`'s samples. The
    /// order of chunks does not matter.
    ///
    /// A pixel that no kernel wrote in this chunk becomes NaN and stays so.
    ///
    /// # Errors
    ///
    /// [`FilmError`] if the film does not have these pixels, or already has these samples; then it
    /// stays as it was.
    pub fn merge(&mut self, part: &SampleBlock, chunk: &[PixelSums]) -> Result<(), FilmError> {
        let Some(rows) = self.row_range(&part.rows).filter(|rows| chunk.len() == rows.len()) else {
            return Err(self.other_chunk(part, chunk.len()));
        };
        self.coverage.insert(part)?;
        let Some(totals) = self.pixels.get_mut(rows) else { return Err(self.other_chunk(part, chunk.len())) };
        let samples = part.samples.len() as u32;
        totals
            .par_iter_mut()
            .zip(chunk)
            .with_min_len(TASK)
            .for_each(|(total, sums)| total.merge(sums, samples));
        Ok(())
    }

    /// Adds the AOV sums of a block, after its [chunk](Self::merge).
    ///
    /// # Errors
    ///
    /// [`FilmError`] if the film does not have these pixels, or has no AOV totals.
    pub fn merge_aovs(&mut self, part: &SampleBlock, chunk: &[AovSums]) -> Result<(), FilmError> {
        let rows = self.row_range(&part.rows).filter(|rows| chunk.len() == rows.len());
        let Some(totals) = rows.and_then(|rows| self.aovs.get_mut(rows)) else {
            return Err(self.other_chunk(part, chunk.len()));
        };
        let (first, samples) = (part.samples.start, part.samples.len() as u32);
        let pixels = totals.par_iter_mut().zip(chunk).with_min_len(TASK);
        pixels.for_each(|(total, guides)| total.merge(guides, first, samples));
        Ok(())
    }

    /// Adds another film of the same render, with any rows and chunks: the sums are the same in any
    /// order and grouping. A pixel that only one of both films holds is taken from that one.
    ///
    /// The caller ensures that both films are of the same scene and, except for their parts, of the
    /// same settings.
    ///
    /// # Errors
    ///
    /// [`FilmError`] if the sizes differ, only one has AOV totals, or both hold a sample; then the
    /// film stays as it was.
    pub fn add(&mut self, other: &Self) -> Result<(), FilmError> {
        let (film, of) = ((self.width, self.height), (other.width, other.height));
        if film != of || self.pixels.len() != other.pixels.len() {
            return Err(FilmError::Size { film, other: of });
        }
        if self.aovs.len() != other.aovs.len() {
            return Err(FilmError::Aovs);
        }
        self.coverage.merge(&other.coverage)?;
        let guides = self.aovs.par_iter_mut().zip(&other.aovs);
        guides.with_min_len(TASK).for_each(|(total, other)| total.add(other));
        let pixels = self.pixels.par_iter_mut().zip(&other.pixels);
        pixels.with_min_len(TASK).for_each(|(total, other)| total.add(other));
        Ok(())
    }

    fn other_chunk(&self, part: &SampleBlock, pixels: usize) -> FilmError {
        FilmError::Chunk { film: (self.width, self.height), pixels, rows: part.rows.clone() }
    }

    /// Returns the indices of the pixels of `rows`, or `None` if the film does not have these rows.
    fn row_range(&self, rows: &Range<u32>) -> Option<Range<usize>> {
        let index = |row: u32| row as usize * self.width as usize;
        (rows.start <= rows.end && rows.end <= self.height).then(|| index(rows.start)..index(rows.end))
    }

    /// Returns the image: the mean radiance of each pixel.
    pub fn image(&self) -> Image {
        let pixels = self.pixels.par_iter().with_min_len(TASK);
        Image {
            width: self.width,
            height: self.height,
            pixels: pixels.map(|total| total.mean().map(|value| value as f32)).collect(),
        }
    }

    /// Returns the counts over all pixels.
    pub fn counts(&self) -> FilmCounts {
        count(&self.pixels)
    }

    /// Returns the counts over the pixels of `rows`; 0 if the film does not have these rows.
    pub fn counts_in(&self, rows: &Range<u32>) -> FilmCounts {
        self.row_range(rows).and_then(|rows| self.pixels.get(rows)).map_or_else(FilmCounts::default, count)
    }
}

impl std::ops::Add for FilmCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            samples: self.samples.saturating_add(other.samples),
            rejected: self.rejected.saturating_add(other.rejected),
            segments: self.segments.saturating_add(other.segments),
            unwritten: self.unwritten.saturating_add(other.unwritten),
        }
    }
}

/// Copies by all threads, because the first touch of fresh memory takes most of the time.
fn copy<T: Copy + Send + Sync>(to: &mut Vec<T>, from: &[T], empty: T) {
    if to.len() != from.len() {
        *to = rayon::iter::repeat_n(empty, from.len()).with_min_len(TASK).collect();
    }
    to.par_chunks_mut(TASK).zip(from.par_chunks(TASK)).for_each(|(to, from)| to.copy_from_slice(from));
}

fn count(pixels: &[PixelTotals]) -> FilmCounts {
    let counts = pixels.par_iter().with_min_len(TASK).map(PixelTotals::counts);
    counts.reduce(FilmCounts::default, |a, b| a + b)
}

#[cfg(test)]
mod tests;
