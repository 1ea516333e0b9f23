//! Totals of a film on a device: chunks add up there exactly, and the host reads the totals.

use super::bands::{Bands, Read};
use super::film::DeviceFilm;
use super::misuse;
use super::totals_launch::{compile, launch, params};
use crate::film::{AovTotals, PixelTotals, RadianceTotals, Summation, TASK};
use bytemuck::{Pod, cast_slice};
use rayon::prelude::*;
use std::ops::Range;
use trisect_device::{BackendError, Buffer, Command, Device, DeviceKind, RowSet, RowTarget};
use trisect_kernels::{FILM_ADD, FILM_READ};
use trisect_shared::totals::{
    AOV_SUMS, RADIANCE_SUMS, READ_AOV_WORDS, READ_RADIANCE_WORDS, READ_WORDS, SUMS, TotalsParams,
};
use web_time::Instant;

/// Maximum number of bytes that the host reads at a time, except for a single row.
const MAX_READ: u64 = 8 << 20;

/// Number of bands by which the speed of a copy is measured.
const PROBED_BANDS: u32 = 4;

/// Bytes a second below which a copy by several threads is slower than one by a thread that need
/// not wait for others.
const SLOW: f64 = 4e9;

/// Choice of the threads that copy a band from pinned memory.
#[derive(Clone, Copy)]
enum Copying {
    /// The thread that reads.
    Alone,
    /// All threads of the pool.
    ByAllThreads,
}

/// Totals of an image on a device.
pub(super) struct DeviceTotals {
    /// Pixels across and down.
    size: (u32, u32),
    /// Words of [`TotalsParams`]' totals, by plane.
    pub(super) totals: Buffer,
    /// Words of the AOV totals, by plane; none if the film has no AOVs.
    aov_totals: Buffer,
    /// Records of some rows, for the host.
    pub(super) output: Buffer,
}

const _: () = assert!(size_of::<RadianceTotals>() == READ_RADIANCE_WORDS as usize * 4);
const _: () = assert!(size_of::<PixelTotals>() == READ_WORDS as usize * 4);
const _: () = assert!(size_of::<AovTotals>() == READ_AOV_WORDS as usize * 4);

/// Checks that a film has these rows.
pub(super) fn check_rows(size: (u32, u32), film: &DeviceFilm, rows: &RowSet) -> Result<(), BackendError> {
    match (film.of.width, film.of.height) == size && rows.end() <= size.1 {
        true => Ok(()),
        false => Err(misuse("the totals are those of a film of another size")),
    }
}

impl DeviceTotals {
    /// Makes totals without samples for a film, with the memory of others if that fits.
    ///
    /// # Errors
    ///
    /// [`BackendError::TooLarge`] if the device does not have as much memory, or no kernel can
    /// address it.
    pub fn begin(
        device: &mut dyn Device,
        film: &DeviceFilm,
        other: Option<Self>,
    ) -> Result<Self, BackendError> {
        let (size, pixels) = ((film.of.width, film.of.height), film.of.pixels());
        let aov_bytes = if film.of.has_aovs() { Summation::BYTES_PER_PIXEL_OF_AOVS } else { 0 };
        let (needed, limit) = (pixels * Summation::BYTES_PER_PIXEL.max(aov_bytes), 4 * u64::from(u32::MAX));
        if needed > limit {
            let (backend, what) = (device.info().backend, "the film's totals");
            return Err(BackendError::TooLarge { backend, what, needed, limit });
        }
        compile(device, &[FILM_ADD, FILM_READ])?;
        let fits = |totals: &Self| totals.size == size && totals.aov_totals.bytes() == pixels * aov_bytes;
        let totals = match other.filter(fits) {
            Some(totals) => totals,
            None => Self {
                size,
                totals: device.allocate(pixels * Summation::BYTES_PER_PIXEL, "the film's totals")?,
                aov_totals: device.allocate(pixels * aov_bytes, "the film's AOV totals")?,
                output: device.allocate(Self::row(size) * Self::band(size), "the film's totals")?,
            },
        };
        // SAFETY: no launch.
        unsafe { device.start(vec![Command::clear(&totals.totals), Command::clear(&totals.aov_totals)]) }?;
        Ok(totals)
    }

    /// Returns the number of bytes of a row of the largest records.
    pub(super) fn row((width, _): (u32, u32)) -> u64 {
        4 * u64::from(width) * u64::from(READ_WORDS.max(READ_AOV_WORDS))
    }

    /// Returns the number of rows that the host reads at a time.
    pub(super) fn band(size: (u32, u32)) -> u64 {
        (MAX_READ / Self::row(size).max(1)).clamp(1, u64::from(size.1.max(1)))
    }

    /// Adds the film's chunk of `samples` in these rows, and resets it.
    pub fn add_chunk(
        &self,
        device: &mut dyn Device,
        film: &DeviceFilm,
        rows: &RowSet,
        samples: &Range<u32>,
    ) -> Result<(), BackendError> {
        check_rows(self.size, film, rows)?;
        let params = params(self.size, rows, samples);
        let of_aovs = TotalsParams { sums: AOV_SUMS, ..params };
        let arrays = [&film.sums, &film.aovs, &self.totals, &self.output];
        let mut commands = vec![launch(FILM_ADD, &params, arrays, (self.size.0, rows.len()))?];
        if self.aov_totals.bytes() > 0 {
            let arrays = [&film.sums, &film.aovs, &self.aov_totals, &self.output];
            commands.push(launch(FILM_ADD, &of_aovs, arrays, (self.size.0, rows.len()))?);
        }
        // SAFETY: film and totals have records and words for each pixel of the image, as was
        // compared, and each thread accesses those of its own pixel.
        unsafe { device.start(commands) }.map(|_| ())
    }

    /// Reads the totals of all pixels of some rows, and their AOV totals if there are any.
    pub fn read(
        &self,
        (device, bands): (&mut dyn Device, &mut Bands),
        film: &DeviceFilm,
        rows: &RowSet,
        pixels: &mut [PixelTotals],
        aovs: &mut [AovTotals],
    ) -> Result<(), BackendError> {
        self.read_records((device, bands), film, rows, SUMS, pixels)?;
        match self.aov_totals.bytes() > 0 {
            true => self.read_records((device, bands), film, rows, AOV_SUMS, aovs),
            false if aovs.is_empty() => Ok(()),
            false => Err(misuse("the totals have no AOVs")),
        }
    }

    /// Reads the radiance of all pixels of some rows.
    pub fn read_radiance(
        &self,
        (device, bands): (&mut dyn Device, &mut Bands),
        film: &DeviceFilm,
        rows: &RowSet,
        pixels: &mut [RadianceTotals],
    ) -> Result<(), BackendError> {
        self.read_records((device, bands), film, rows, RADIANCE_SUMS, pixels)
    }

    /// Reads a record of so many sums for each pixel of some rows.
    fn read_records<T: Pod + Send + Sync>(
        &self,
        (device, bands): (&mut dyn Device, &mut Bands),
        film: &DeviceFilm,
        rows: &RowSet,
        sums: u32,
        records: &mut [T],
    ) -> Result<(), BackendError> {
        let from = match sums == AOV_SUMS {
            true => (&self.aov_totals, &self.output),
            false => (&self.totals, &self.output),
        };
        if records.len() != rows.len() as usize * self.size.0 as usize {
            return Err(misuse("the totals are those of another number of pixels"));
        }
        check_rows(self.size, film, rows)?;
        let of = Read { film, size: self.size, from: [from], rows, sums };
        if device.info().kind != DeviceKind::Gpu {
            return Self::read_directly(device, &of, 0..rows.len(), records);
        }
        if device.is_pinned(cast_slice(records)) {
            return Self::read_directly(device, &of, 0..rows.len(), records);
        }
        let probe = rows.len().min(PROBED_BANDS * of.band_of::<T>());
        bands.prepare::<1>(device, (self.output.bytes() / 4) as usize);
        let start = Instant::now();
        Self::read_by_bands((device, bands), &of, 0..probe, records, Copying::ByAllThreads)?;
        let bytes = (probe as usize * self.size.0 as usize * size_of::<T>()) as f64;
        // A host under load wakes threads late.
        let copying = match start.elapsed().as_secs_f64() > bytes / SLOW {
            true => Copying::Alone,
            false => Copying::ByAllThreads,
        };
        Self::read_by_bands((device, bands), &of, probe..rows.len(), records, copying)
    }

    /// Reads a record for each pixel of some of the rows: the device copies them to their place,
    /// band after band without waiting for the host.
    fn read_directly<T: Pod>(
        device: &mut dyn Device,
        of: &Read<'_, 1>,
        own: Range<u32>,
        records: &mut [T],
    ) -> Result<(), BackendError> {
        let (width, band) = (of.size.0 as usize, of.band_of::<T>());
        let (mut started, mut outcome) = (Vec::new(), Ok(()));
        for first in own.clone().step_by(band as usize) {
            let part = first..(first + band).min(own.end);
            let place = part.start as usize * width..part.end as usize * width;
            if let Some(records) = records.get_mut(place) {
                let packed = RowSet::from(0..part.len() as u32);
                let to = [RowTarget::records(records, &packed)];
                // SAFETY: the records are borrowed until all bands were waited for.
                match unsafe { of.start_band(device, &of.rows.part(part), to) } {
                    Ok(band) => started.push(band),
                    Err(error) => {
                        outcome = Err(error);
                        break;
                    }
                }
            }
        }
        for band in started {
            outcome = device.wait(band).map(|_| ()).and(outcome);
        }
        outcome
    }

    /// Reads a record for each pixel of some of the rows, through pinned memory, from which threads
    /// copy it while the device reads the next band.
    fn read_by_bands<T: Pod + Send + Sync>(
        (device, bands): (&mut dyn Device, &mut Bands),
        of: &Read<'_, 1>,
        own: Range<u32>,
        records: &mut [T],
        copying: Copying,
    ) -> Result<(), BackendError> {
        let before = own.start as usize * of.size.0 as usize;
        let rows = of.rows.part(own);
        bands.for_each(device, &Read { rows: &rows, ..*of }, &mut |band, [from]: [&[T]; 1]| {
            if let Some(to) = records.get_mut(before + band.start..before + band.end) {
                match copying {
                    Copying::Alone => to.copy_from_slice(from),
                    Copying::ByAllThreads => {
                        let (to, from) = (to.par_chunks_mut(TASK), from.par_chunks(TASK));
                        to.zip(from).for_each(|(to, from)| to.copy_from_slice(from));
                    }
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::film::FilmDesc;
    use super::*;
    use bytemuck::Zeroable;
    use trisect_device::{MathMode, cpu::Cpu};
    use trisect_kernels::render_kernel;
    use trisect_shared::film::PixelSums;

    /// Each way of reading gives the same records, also from the middle of a film of several bands.
    #[test]
    fn ways_of_reading_agree() {
        let (width, height) = (700, 301);
        let mut device = Cpu::open(None).unwrap();
        let of = FilmDesc { width, height, kernel: render_kernel(0), math: MathMode::Precise };
        let film = DeviceFilm::begin(&mut device, of, None).unwrap();
        let sums = |pixel: u32| PixelSums { samples: 1 + pixel % 7, segments: pixel, ..PixelSums::ZERO };
        let chunk: Vec<PixelSums> = (0..width * height).map(sums).collect();
        film.write(&mut device, &chunk, &[]).unwrap();
        let totals = DeviceTotals::begin(&mut device, &film, None).unwrap();
        let rows = RowSet::from(0..height);
        totals.add_chunk(&mut device, &film, &rows, &(0..8)).unwrap();
        let read = Read {
            film: &film,
            size: totals.size,
            from: [(&totals.totals, &totals.output)],
            rows: &rows,
            sums: SUMS,
        };
        assert!(height > 3 * read.band_of::<PixelTotals>(), "there are several bands");
        let want: Vec<PixelTotals> = chunk.iter().map(|sums| PixelTotals::of(sums, 8)).collect();
        let mut bands = Bands::default();
        for middle in [0, 1, 100, height] {
            let empty = || vec![PixelTotals::zeroed(); want.len()];
            let (mut direct, mut banded) = (empty(), [empty(), empty()]);
            for own in [0..middle, middle..height] {
                DeviceTotals::read_directly(&mut device, &read, own.clone(), &mut direct).unwrap();
                for (banded, copying) in banded.iter_mut().zip([Copying::Alone, Copying::ByAllThreads]) {
                    let through: (&mut dyn Device, _) = (&mut device, &mut bands);
                    DeviceTotals::read_by_bands(through, &read, own.clone(), banded, copying).unwrap();
                }
            }
            assert!(direct == want && banded.iter().all(|banded| *banded == want), "{middle}");
            // Negative control: the second part only.
            let mut part = empty();
            DeviceTotals::read_directly(&mut device, &read, middle..height, &mut part).unwrap();
            assert_eq!(part == want, middle == 0);
        }
    }
}
