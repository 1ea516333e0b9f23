//! The film: exact sums, over all samples, of the chunks that kernels sum in single precision.
//!
//! A [`Renderer`](crate::render::Renderer) merges chunks into a [`Film`]. Films of parts of a
//! render add up to the film of the whole, in any order and grouping.

mod aovs;
mod coverage;
mod pixel;
mod sum;
mod summation;
mod tiles;
mod totals;

pub use aovs::AovTotals;
pub use coverage::{Overlap, SampleBlock, SampleCoverage};
pub use pixel::{PixelTotals, RadianceTotals};
pub use sum::ExactSum;
pub use summation::Summation;
pub use tiles::{TILE, Tiles};
pub use totals::{OverChunks, Totals, TotalsIter};
pub use trisect_device::{FrameMemory, HostFrame, HostMemory, HostRecords, RowSet, RowTarget};

use rayon::prelude::*;
use std::ops::Range;
use thiserror::Error;
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{FilteredPixel, GBufferTexel};
use trisect_shared::film::{Compensation, PixelSums};

/// Result of a render before it is an image: [`PixelTotals`] of all pixels, row-major, top row
/// first, and the samples that they hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` totals.
    pub pixels: Totals<PixelTotals>,
    /// `width * height` AOV totals if the render has [AOV sums](crate::render::Settings::guides),
    /// otherwise none.
    pub aovs: Totals<AovTotals>,
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
        let pixels = Totals::Empty(width as usize * height as usize);
        Self { width, height, pixels, aovs: Totals::default(), coverage: SampleCoverage::new(height) }
    }

    /// Creates a film of one chunk of all rows: of `samples`, which begin and end where a chunk
    /// does. `aovs` is empty for a film without AOV totals.
    ///
    /// # Errors
    ///
    /// [`FilmError::Chunk`] if the chunk does not have these pixels.
    pub fn of_chunk(
        (width, height): (u32, u32),
        samples: Range<u32>,
        pixels: HostRecords<PixelSums>,
        aovs: HostRecords<AovSums>,
    ) -> Result<Self, FilmError> {
        let count = width as usize * height as usize;
        let part = SampleBlock { rows: 0..height, samples: samples.clone() };
        if pixels.len() != count || !aovs.is_empty() && aovs.len() != count {
            return Err(FilmError::Chunk { film: (width, height), pixels: pixels.len(), rows: part.rows });
        }
        let mut coverage = SampleCoverage::new(height);
        coverage.insert(&part)?;
        let pixels = Totals::Chunk { sums: pixels, samples: samples.clone() };
        let aovs = if aovs.is_empty() { Totals::default() } else { Totals::Chunk { sums: aovs, samples } };
        Ok(Self { width, height, pixels, aovs, coverage })
    }

    /// Creates a film without samples that also has AOV totals.
    pub fn with_aovs(width: u32, height: u32) -> Self {
        let film = Self::new(width, height);
        Self { aovs: Totals::Empty(film.pixels.len()), ..film }
    }

    /// Returns the number of bytes of one pixel of a film, with or without AOV totals.
    pub fn bytes_per_pixel(guides: bool) -> u64 {
        (size_of::<PixelTotals>() + if guides { size_of::<AovTotals>() } else { 0 }) as u64
    }

    /// Returns the number of bytes of all totals.
    pub fn bytes(&self) -> u64 {
        self.pixels.bytes() + self.aovs.bytes()
    }

    /// Makes this film a copy of another; memory of the same size is reused.
    pub fn copy_from(&mut self, other: &Self) {
        (self.width, self.height) = (other.width, other.height);
        self.pixels.copy_from(&other.pixels);
        self.aovs.copy_from(&other.aovs);
        self.coverage = other.coverage.clone();
    }

    /// Removes all samples; the memory stays.
    pub fn clear(&mut self) {
        self.pixels.clear();
        self.aovs.clear();
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
        let Some(totals) = self.pixels.exact_mut().get_mut(rows) else {
            return Err(self.other_chunk(part, chunk.len()));
        };
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
        let Some(totals) = rows.and_then(|rows| self.aovs.exact_mut().get_mut(rows)) else {
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
        other.aovs.for_each_with(self.aovs.exact_mut(), |total, other| total.add(&other));
        other.pixels.for_each_with(self.pixels.exact_mut(), |total, other| total.add(&other));
        Ok(())
    }

    /// Returns the totals of some rows, which the caller writes; it also notes their samples in the
    /// coverage.
    ///
    /// # Errors
    ///
    /// [`FilmError::Chunk`] if the film does not have these rows.
    pub(crate) fn rows_mut(
        &mut self,
        rows: &Range<u32>,
    ) -> Result<(&mut [PixelTotals], &mut [AovTotals]), FilmError> {
        let Some(own) = self.row_range(rows) else {
            let film = (self.width, self.height);
            return Err(FilmError::Chunk { film, pixels: 0, rows: rows.clone() });
        };
        let pixels = self.pixels.exact_mut().get_mut(own.clone()).unwrap_or_default();
        Ok((pixels, self.aovs.exact_mut().get_mut(own).unwrap_or_default()))
    }

    /// Returns a film of the same size without samples, with AOV totals if this one has them.
    pub(crate) fn without_samples(&self) -> Self {
        Self { aovs: Totals::Empty(self.aovs.len()), ..Self::new(self.width, self.height) }
    }

    /// Returns whether the film holds no samples.
    pub fn is_empty(&self) -> bool {
        self.coverage.parts().is_empty()
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
        let narrow = |[red, green, blue]: [f64; 3]| [red as f32, green as f32, blue as f32];
        let pixels = self.pixels.map(|total| narrow(total.mean()));
        Image { width: self.width, height: self.height, pixels }
    }

    /// Returns the share of each pixel's camera rays that hit something; `None` without AOV totals.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        (self.aovs.len() == self.pixels.len()).then(|| self.aovs.map(|aov| aov.alpha()))
    }

    /// Returns the counts over all pixels.
    pub fn counts(&self) -> FilmCounts {
        self.pixels.counts(0..self.pixels.len())
    }

    /// Returns the counts over the pixels of `rows`; 0 if the film does not have these rows.
    pub fn counts_in(&self, rows: &Range<u32>) -> FilmCounts {
        self.row_range(rows).map_or_else(FilmCounts::default, |rows| self.pixels.counts(rows))
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

#[cfg(test)]
mod tests;
