//! Checkpoints: files with a film and the identity of its image. A render continues from one, and
//! several can be merged.
//!
//! [`Checkpoint`] is the content of a file, [`Identity`] the properties that films of one image
//! share, and [`Saver`] writes while the render continues. The complete film has the same bits as
//! that of an uninterrupted render
//! ([`Renderer::render_missing`](crate::render::Renderer::render_missing)).

mod identity;
mod place;
mod saver;

pub use crate::error::{CheckpointError, Difference};
pub use identity::{Identity, arithmetic};
pub use place::Place;
pub use saver::{SaveInterval, Saver};

use crate::film::{AovTotals, Film, HostRecords, PixelTotals, SampleBlock, SampleCoverage, Totals};
use crate::render::MAX_DEPTH;
use bytemuck::{Pod, cast_slice};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use trisect_image::output::CameraMetadata;
use trisect_shared::film::CHUNK_SAMPLES;
use trisect_system::atomic_file::{self, Claim};
use trisect_system::checksummed_file::{self, ChecksummedFileError, Contents};

/// First bytes of a checkpoint file.
const MAGIC: &[u8; 8] = b"TRISCKP1";

/// Maximum mean number of segments of a pixel's samples in a valid file: each vertex of a path may
/// have a shadow ray, which counts, too.
const MAX_SEGMENTS: u64 = 2 * MAX_DEPTH as u64;

/// Version of the header. It is raised when a field changes its meaning or is removed.
pub const FORMAT: u32 = 1;

/// Header of a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Version of the header: see [`FORMAT`].
    pub format: u32,
    /// Identity of the image; films of one image have the same.
    pub identity: Identity,
    /// Name of the scene.
    pub scene: String,
    /// Arguments of the command that began the render, without the program's name. Empty for a
    /// film that no command of the program began: a caller of the library resumes it.
    pub command: Vec<String>,
    /// Folder to which relative paths in `command` refer.
    pub folder: PathBuf,
    /// Samples per pixel of the complete image.
    pub spp: u32,
    /// Sample indices that the command was to render.
    pub samples: Range<u32>,
    /// Rendering time so far, in seconds.
    pub seconds: f64,
    /// Camera of the image, for the metadata of its file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraMetadata>,
}

/// Header as it is stored, with the size and parts of the film.
#[derive(Serialize, Deserialize)]
struct Stored {
    width: u32,
    height: u32,
    guides: bool,
    parts: Vec<SampleBlock>,
    #[serde(flatten)]
    header: Header,
}

/// Film with its header.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Header of the film.
    pub header: Header,
    /// Film with all samples so far.
    pub film: Film,
}

impl Checkpoint {
    /// Reads a checkpoint.
    ///
    /// # Errors
    ///
    /// [`CheckpointError`] names the file: one that is not a checkpoint, was truncated or damaged,
    /// or has another version.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let io = |source| CheckpointError::Io { path: path.to_owned(), source };
        match checksummed_file::read(path, MAGIC) {
            Ok(contents) => Self::of(contents, path),
            Err(ChecksummedFileError::Io(source)) => Err(io(source)),
            Err(error) => {
                Err(CheckpointError::NotACheckpoint { path: path.to_owned(), message: error.to_string() })
            }
        }
    }

    /// Decodes the bytes of a checkpoint file; `path` is its name in errors.
    ///
    /// # Errors
    ///
    /// Same as [`read`](Self::read).
    pub fn from_bytes(bytes: Vec<u8>, path: &Path) -> Result<Self, CheckpointError> {
        let wrong = |message: String| CheckpointError::NotACheckpoint { path: path.to_owned(), message };
        Self::of(checksummed_file::open(bytes, MAGIC).map_err(|error| wrong(error.to_string()))?, path)
    }

    fn of(contents: Contents, path: &Path) -> Result<Self, CheckpointError> {
        let wrong = |message: String| CheckpointError::NotACheckpoint { path: path.to_owned(), message };
        let Contents { header, data } = contents;
        let format: Format = serde_json::from_slice(&header).map_err(|error| wrong(error.to_string()))?;
        if format.format != FORMAT {
            return Err(CheckpointError::Format {
                path: path.to_owned(),
                format: format.format,
                reads: FORMAT,
            });
        }
        let stored: Stored = serde_json::from_slice(&header).map_err(|error| wrong(error.to_string()))?;
        let film = film(&stored, &data).map_err(wrong)?;
        Ok(Self { header: stored.header, film })
    }

    /// Writes the checkpoint to `path`. An earlier file stays until this one is complete.
    ///
    /// # Errors
    ///
    /// [`CheckpointError::Io`] names the file.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        write(path, &self.header, &self.film)
    }

    /// Adds the film of another checkpoint of the same image.
    ///
    /// # Errors
    ///
    /// Same as [`merge_film`](Self::merge_film).
    pub fn merge(&mut self, path: &Path, other: &Self) -> Result<(), CheckpointError> {
        self.merge_film(path, &other.header, &other.film)
    }

    /// Adds another film of the same image, with its header; `path` is its name in errors.
    ///
    /// # Errors
    ///
    /// [`CheckpointError::Differs`] names the field in which they differ, [`CheckpointError::Film`]
    /// the reason for which films cannot be added, such as samples in both. Nothing is added then.
    pub fn merge_film(&mut self, path: &Path, header: &Header, film: &Film) -> Result<(), CheckpointError> {
        let path = || path.to_owned();
        self.header
            .identity
            .check(&header.identity)
            .map_err(|difference| CheckpointError::Differs { path: path(), difference })?;
        self.film.add(film).map_err(|source| CheckpointError::Film { path: path(), source })?;
        self.header.identity.add_rounding(&header.identity.arithmetic);
        self.header.seconds += header.seconds;
        let (a, b) = (&self.header.samples, &header.samples);
        self.header.samples = a.start.min(b.start)..a.end.max(b.end);
        Ok(())
    }
}

/// Returns the film in a file's data, or a description of what is wrong with it.
fn film(stored: &Stored, data: &[u8]) -> Result<Film, String> {
    let Stored { width, height, guides, ref parts, .. } = *stored;
    let pixels = u64::from(width) * u64::from(height);
    let each = size_of::<PixelTotals>() + if guides { size_of::<AovTotals>() } else { 0 };
    if pixels == 0 || pixels.checked_mul(each as u64) != Some(data.len() as u64) {
        return Err(format!("{} bytes of data do not match a film of {width}x{height}", data.len()));
    }
    let (spp, of) = (stored.header.spp, &stored.header.samples);
    if stored.header.identity.samples() != Some(spp.into()) {
        return Err(format!("its image does not have the {spp} samples per pixel of its header"));
    }
    if of.is_empty() || of.end > spp {
        return Err(format!("samples {} to {} are not a valid range of {spp}", of.start, of.end));
    }
    // Parts are written in this order, so the parts of each row are appended in order.
    if !parts.is_sorted_by_key(|part| (part.samples.start, part.rows.start)) {
        return Err("its parts are not sorted".to_owned());
    }
    let rows: u64 = parts.iter().map(|part| part.rows.len() as u64).sum();
    if rows > data.len() as u64 {
        return Err(format!("it has too many parts: {}", parts.len()));
    }
    let mut coverage = SampleCoverage::new(height);
    for part in parts {
        let Range { start, end } = part.samples;
        let whole = start % CHUNK_SAMPLES == 0 && (end % CHUNK_SAMPLES == 0 || end == spp) && end <= spp;
        let inside = part.rows.start < part.rows.end && part.rows.end <= height && start < end;
        if !inside || !whole || coverage.insert(part).is_err() {
            return Err(format!("a part is invalid or overlaps another: {part:?}"));
        }
    }
    let (totals, of_guides) = data.split_at(pixels as usize * size_of::<PixelTotals>());
    let totals: HostRecords<PixelTotals> = records(totals);
    let held =
        |row: usize| -> u64 { coverage.samples(row as u32).iter().map(|samples| samples.len() as u64).sum() };
    let is_sound = |(row, pixels): (usize, &[PixelTotals])| {
        let held = held(row);
        pixels.iter().all(|pixel| {
            let counts = [pixel.samples, pixel.rejected, pixel.unwritten];
            let sum = counts.iter().try_fold(0u64, |sum, &count| sum.checked_add(count));
            sum == Some(held) && pixel.segments <= held.saturating_mul(MAX_SEGMENTS)
        })
    };
    let rows = totals.par_chunks(width as usize).enumerate();
    if let Some(row) = rows.position_first(|row| !is_sound(row)) {
        return Err(format!("row {row}: sample counts do not match the parts"));
    }
    let guides: HostRecords<AovTotals> = records(of_guides);
    let rows = guides.par_chunks(width as usize).enumerate();
    let wrong = |(row, pixels): (usize, &[AovTotals])| {
        let held = held(row);
        pixels.iter().any(|guides| guides.hits.checked_add(guides.misses).is_none_or(|count| count > held))
    };
    if let Some(row) = rows.position_first(wrong) {
        return Err(format!("row {row} has AOV sums of more samples than it holds"));
    }
    Ok(Film { width, height, pixels: Totals::Exact(totals), aovs: Totals::Exact(guides), coverage })
}

/// Returns the records that bytes consist of.
fn records<T: Pod>(bytes: &[u8]) -> HostRecords<T> {
    let mut records = HostRecords::new(bytes.len() / size_of::<T>());
    let own: &mut [u8] = bytemuck::cast_slice_mut(&mut records);
    own.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    records
}

#[derive(Deserialize)]
struct Format {
    format: u32,
}

/// Checks that [`write()`] can write `path`. Creates nothing under that name, and leaves an
/// existing file unchanged.
///
/// # Errors
///
/// [`CheckpointError::Io`] names the file.
pub fn probe(path: &Path) -> Result<(), CheckpointError> {
    atomic_file::probe_atomic(path).map_err(|source| CheckpointError::Io { path: path.to_owned(), source })
}

/// Writes a checkpoint from a header and a film. An earlier file stays until this one is complete.
///
/// # Errors
///
/// [`CheckpointError::Io`] names the file.
pub fn write(path: &Path, header: &Header, film: &Film) -> Result<(), CheckpointError> {
    let io = |source: io::Error| CheckpointError::Io { path: path.to_owned(), source };
    let header = stored(header, film).map_err(io)?;
    with_data(film, |data| checksummed_file::write(path, MAGIC, &header, data)).map_err(io)
}

/// Returns the bytes of the file that [`write()`] writes.
///
/// # Errors
///
/// [`CheckpointError::Io`] for a header that is too long.
pub fn encode(header: &Header, film: &Film) -> Result<Vec<u8>, CheckpointError> {
    let io = |source: io::Error| CheckpointError::Io { path: PathBuf::from(&header.scene), source };
    let header = stored(header, film).map_err(io)?;
    with_data(film, |data| checksummed_file::encode(MAGIC, &header, data)).map_err(io)
}

/// Writes a checkpoint if there is no file at `path`, or if that file is the one of `claim`.
fn write_claimed(
    path: &Path,
    claim: &mut Claim,
    header: &Header,
    film: &Film,
) -> Result<(), CheckpointError> {
    let io = |source: io::Error| match source.kind() {
        io::ErrorKind::AlreadyExists => CheckpointError::Taken { path: path.to_owned() },
        _ => CheckpointError::Io { path: path.to_owned(), source },
    };
    let header = stored(header, film).map_err(io)?;
    with_data(film, |data| checksummed_file::write_claimed(path, claim, MAGIC, &header, data)).map_err(io)
}

/// Returns the stored header of a film.
fn stored(header: &Header, film: &Film) -> io::Result<Vec<u8>> {
    let stored = Stored {
        width: film.width,
        height: film.height,
        guides: !film.aovs.is_empty(),
        parts: film.coverage.parts(),
        header: header.clone(),
    };
    Ok(serde_json::to_vec(&stored)?)
}

/// Calls `write` with the stored data of a film.
fn with_data<T>(film: &Film, write: impl FnOnce(&[&[u8]; 2]) -> T) -> T {
    let (pixels, aovs) = (film.pixels.exact(), film.aovs.exact());
    write(&[cast_slice(&pixels), cast_slice(&aovs)])
}

/// Numbers are stored as they are in memory.
const _: () = assert!(cfg!(target_endian = "little"), "checkpoints are little-endian");

#[cfg(test)]
mod tests;
