//! Counts of the samples and segments of chunks on a device.

use super::film::DeviceFilm;
use super::totals::check_rows;
use super::totals_launch::{compile, launch, params};
use crate::film::FilmCounts;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use trisect_device::{BackendError, Buffer, Command, Device, RowSet, RowTarget};
use trisect_kernels::FILM_COUNT;
use trisect_shared::totals::{COUNT_WORDS, COUNTED_ROWS};

/// Counts of chunks on a device, for parts of an image.
pub(super) struct ChunkCounter {
    size: (u32, u32),
    /// Rows of each part, and its [`LaneCounts`].
    parts: Vec<(RowSet, Buffer)>,
    unused: Buffer,
}

/// Counts of a lane, as the device writes them. Numbers of two words have the lower one first; u64
/// would be aligned to 8 bytes.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LaneCounts {
    samples: [u32; 2],
    rejected: [u32; 2],
    segments: [u32; 2],
    unwritten: u32,
}

const _: () = assert!(size_of::<LaneCounts>() == COUNT_WORDS as usize * 4);

impl ChunkCounter {
    /// Makes counts of no chunk for each of `parts`, rows of films of this size.
    pub fn begin(
        device: &mut dyn Device,
        film: &DeviceFilm,
        other: Option<Self>,
        parts: &[RowSet],
    ) -> Result<Self, BackendError> {
        let size = (film.of.width, film.of.height);
        parts.iter().try_for_each(|rows| check_rows(size, film, rows))?;
        let is_same = |other: &Self| other.size == size && other.parts.iter().map(|part| &part.0).eq(parts);
        let counter = match other.filter(is_same) {
            Some(other) => other,
            None => {
                compile(device, &[FILM_COUNT])?;
                let mut counts = |rows: &RowSet| {
                    let bytes = Self::lanes(size, rows) * size_of::<LaneCounts>();
                    Ok((rows.clone(), device.allocate(bytes as u64, "the film's counts")?))
                };
                let parts = parts.iter().map(&mut counts).collect::<Result<_, BackendError>>()?;
                Self { size, parts, unused: device.allocate(0, "the film's counts")? }
            }
        };
        let clear = counter.parts.iter().map(|(_, counts)| Command::clear(counts)).collect();
        // SAFETY: no launch.
        unsafe { device.start(clear) }?;
        Ok(counter)
    }

    /// Returns the number of lanes that count these rows.
    fn lanes((width, _): (u32, u32), rows: &RowSet) -> usize {
        width as usize * rows.len().div_ceil(COUNTED_ROWS) as usize
    }

    /// Adds the film's chunk of `samples`.
    pub fn add(
        &self,
        device: &mut dyn Device,
        film: &DeviceFilm,
        samples: &Range<u32>,
    ) -> Result<(), BackendError> {
        let params: Vec<_> = self.parts.iter().map(|(rows, _)| params(self.size, rows, samples)).collect();
        let mut launches = Vec::new();
        for ((rows, counts), params) in self.parts.iter().zip(&params) {
            check_rows(self.size, film, rows)?;
            let arrays = [&film.sums, &film.aovs, &self.unused, counts];
            let threads = (self.size.0, rows.len().div_ceil(COUNTED_ROWS));
            launches.push(launch(FILM_COUNT, params, arrays, threads)?);
        }
        // SAFETY: the film has a record for each pixel of the rows, and there are counts for each
        // thread.
        unsafe { device.start(launches) }.map(|_| ())
    }

    /// Returns the counts of each part.
    pub fn read(&self, device: &mut dyn Device) -> Result<Vec<FilmCounts>, BackendError> {
        let none = |(rows, _): &(RowSet, Buffer)| vec![LaneCounts::zeroed(); Self::lanes(self.size, rows)];
        let mut lanes: Vec<Vec<LaneCounts>> = self.parts.iter().map(none).collect();
        let across = self.size.0.max(1) as usize;
        let all: Vec<RowSet> =
            lanes.iter().map(|lanes| RowSet::from(0..(lanes.len() / across) as u32)).collect();
        let targets = lanes.iter_mut().zip(&all).zip(&self.parts);
        let read = targets.map(|((lanes, rows), (_, counts))| Command::Read {
            from: counts,
            to: RowTarget::records(lanes, rows),
        });
        // SAFETY: no launch.
        unsafe { device.run(read.collect()) }?;
        let number = |[low, high]: [u32; 2]| u64::from(high) << 32 | u64::from(low);
        let of = |lane: &LaneCounts| FilmCounts {
            samples: number(lane.samples),
            rejected: number(lane.rejected),
            segments: number(lane.segments),
            unwritten: u64::from(lane.unwritten),
        };
        let sum = |lanes: &Vec<LaneCounts>| lanes.iter().map(of).fold(FilmCounts::default(), |a, b| a + b);
        Ok(lanes.iter().map(sum).collect())
    }
}
