//! Ranks of a render over MPI: the rows of each, and their sums, which rank 0 puts together.

use crate::error::{self, Facts};
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use std::ops::Range;
use trisect::checkpoint::Identity;
use trisect::error::Error;
use trisect::film::{AovTotals, Film, FilmError, PixelTotals, SampleBlock};

/// Maximum number of bands of rows of a rank. Bands of all parts of the image balance the ranks.
const MAX_BANDS: u32 = 16;

/// Ranks of a communicator.
pub struct Ranks {
    /// The communicator, as `trisect._mpi.Ranks`.
    of: Py<PyAny>,
    rank: u32,
    size: u32,
}

/// Rows and samples that the ranks share.
#[derive(Clone)]
pub struct Shared {
    /// Rows of the image.
    pub height: u32,
    /// Indices of the samples.
    pub samples: Range<u32>,
}

impl Ranks {
    /// Returns the ranks of a communicator of mpi4py.
    ///
    /// # Errors
    ///
    /// `ImportError` without mpi4py, `TypeError` for another object.
    pub fn new(comm: &Bound<'_, PyAny>) -> PyResult<Self> {
        let of = comm.py().import("trisect._mpi")?.getattr("Ranks")?.call1((comm,))?;
        let (rank, size) = (of.getattr("rank")?.extract()?, of.getattr("size")?.extract()?);
        Ok(Self { of: of.unbind(), rank, size })
    }

    /// Exchanges the outcome of a step with all ranks, so that none waits for one that has failed.
    /// `fact` of a success is its image and samples, which must be equal on all ranks.
    ///
    /// # Errors
    ///
    /// The error of this rank, else `RankError` for that of another, or for another image there.
    pub fn agree<T>(
        &self,
        py: Python<'_>,
        outcome: PyResult<T>,
        fact: impl FnOnce(&T) -> Option<(Identity, Range<u32>)>,
    ) -> PyResult<T> {
        let fact = outcome.as_ref().ok().and_then(fact);
        let fact = fact.and_then(|fact| serde_json::to_string(&fact).ok()).unwrap_or_default();
        let failed = outcome.as_ref().err().map(|error| error.value(py).to_string());
        let told = self.of.call_method1(py, "exchange", (fact, failed));
        let outcome = outcome?;
        let told: Vec<(String, Option<String>)> = told?.extract(py)?;
        let (facts, failures): (Vec<_>, Vec<_>) = told.into_iter().unzip();
        let failure = failures.into_iter().enumerate().find_map(|(rank, failed)| Some((rank, failed?)));
        match failure.or_else(|| difference(&facts)) {
            Some((rank, message)) => {
                let place = Some(format!("rank {rank}"));
                let facts = Facts { kind: "Rank", place, ..Facts::default() };
                Err(error::raise("RankError", format!("rank {rank}: {message}"), facts))
            }
            None => Ok(outcome),
        }
    }

    /// Returns the blocks that this rank renders.
    pub fn share(&self, of: &Shared) -> Vec<SampleBlock> {
        share(self.rank, self.size, of)
    }

    /// Sends the blocks of this rank to rank 0, which returns the film of all.
    ///
    /// # Errors
    ///
    /// Those of MPI.
    pub fn gather(&self, py: Python<'_>, mut film: Film, of: &Shared) -> PyResult<Option<Film>> {
        if self.rank > 0 {
            let bytes = error::attempted(py, || bytes_of(&film, &self.share(of)))?;
            self.of.call_method1(py, "send", (bytes.into_pyarray(py),))?;
            return Ok(None);
        }
        for rank in 1..self.size {
            let blocks = share(rank, self.size, of);
            let rows: u64 = blocks.iter().map(|block| block.rows.len() as u64).sum();
            let bytes = rows * u64::from(film.width) * Film::bytes_per_pixel(!film.aovs.is_empty());
            let received = self.of.call_method1(py, "receive", (rank, bytes))?;
            let received: PyReadonlyArray1<'_, u8> = received.extract(py)?;
            let received = received.as_slice()?;
            error::guarded(py, || insert(&mut film, &blocks, received))?;
        }
        Ok(Some(film))
    }

    /// Frees the communicator.
    pub fn free(&self, py: Python<'_>) -> PyResult<()> {
        self.of.call_method0(py, "free").map(drop)
    }
}

/// Returns the first rank that renders something else than rank 0, and what differs.
fn difference(facts: &[String]) -> Option<(usize, String)> {
    let first = facts.first()?;
    let (rank, other) = facts.iter().enumerate().find(|(_, fact)| *fact != first)?;
    let [first, other] = [first, other].map(|fact| serde_json::from_str::<(Identity, Range<u32>)>(fact).ok());
    let ((first, samples), (other, of_other)) = (first?, other?);
    let text = match first.check(&other) {
        Err(of) => format!("{} is {} there, but {} on rank 0", of.field, of.other, of.one),
        Ok(()) if samples != of_other => {
            format!("sample_range is {of_other:?} there, but {samples:?} on rank 0")
        }
        Ok(()) => return None,
    };
    Some((rank, text))
}

/// Returns the blocks of a rank: every so many bands of rows, from the band of its number on.
fn share(rank: u32, size: u32, Shared { height, samples }: &Shared) -> Vec<SampleBlock> {
    let bands = if size > 1 { size.saturating_mul(MAX_BANDS) } else { 1 };
    let rows = height.div_ceil(bands).max(1);
    let own = (0..height.div_ceil(rows)).filter(|band| band % size.max(1) == rank);
    let rows = own.map(|band| band * rows..(band * rows).saturating_add(rows).min(*height));
    rows.map(|rows| SampleBlock { rows, samples: samples.clone() }).collect()
}

/// Returns the indices of a block's pixels.
fn pixels(film: &Film, block: &SampleBlock) -> Range<usize> {
    let index = |row: u32| row as usize * film.width as usize;
    index(block.rows.start)..index(block.rows.end)
}

/// Returns the totals of blocks as bytes: of each block the pixels, then their AOV totals.
fn bytes_of(film: &Film, blocks: &[SampleBlock]) -> Vec<u8> {
    let (totals, aovs) = (film.pixels.exact(), film.aovs.exact());
    let mut bytes = Vec::new();
    for block in blocks {
        let own = pixels(film, block);
        bytes.extend_from_slice(bytemuck::cast_slice(totals.get(own.clone()).unwrap_or_default()));
        bytes.extend_from_slice(bytemuck::cast_slice(aovs.get(own).unwrap_or_default()));
    }
    bytes
}

/// Adds blocks that the film lacks, from the bytes of [`bytes_of`].
fn insert(film: &mut Film, blocks: &[SampleBlock], mut bytes: &[u8]) -> Result<(), Error> {
    for block in blocks {
        film.coverage.insert(block).map_err(FilmError::from)?;
        let own = pixels(film, block);
        let totals: &mut [PixelTotals] = film.pixels.exact_mut().get_mut(own.clone()).unwrap_or_default();
        copy(bytemuck::cast_slice_mut(totals), &mut bytes);
        let aovs: &mut [AovTotals] = film.aovs.exact_mut().get_mut(own).unwrap_or_default();
        copy(bytemuck::cast_slice_mut(aovs), &mut bytes);
    }
    Ok(())
}

/// Copies the next bytes; `receive` returned as many as the blocks have.
fn copy(to: &mut [u8], from: &mut &[u8]) {
    if let Some((own, rest)) = from.split_at_checked(to.len()) {
        to.copy_from_slice(own);
        *from = rest;
    }
}
