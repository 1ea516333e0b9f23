//! Two halves of an image on a device: totals that share no random number, and their noise.

use super::bands::{Bands, Read, UseBand};
use super::film::{DeviceFilm, FilmDesc};
use super::misuse;
use super::totals::{DeviceTotals, check_rows};
use super::totals_launch::{compile, launch, params};
use bytemuck::{Pod, cast_slice};
use std::ops::Range;
use trisect_device::{BackendError, Buffer, Command, Device, HostRecords, RowSet, RowTarget};
use trisect_kernels::{FILM_ADD, FILM_NOISE, FILM_REQUEST, FILM_SUMS};
use trisect_shared::film::PixelSums;
use trisect_shared::noise::PixelNoise;
use trisect_shared::totals::{NOISE_WORDS, TILE, TotalsParams};

/// Totals of both halves of an image without AOVs on a device.
pub(super) struct DeviceHalves {
    /// Pixels across and down.
    size: (u32, u32),
    of: [DeviceTotals; 2],
    /// [`PixelSums`] of the first half, then those of the second.
    sums: Buffer,
    /// Number of samples by tile.
    counts: Buffer,
    /// Noise of each tile, and the error of each pixel.
    noise: Buffer,
    /// Copy of the noise on the host.
    read: HostRecords<u32>,
}

/// Noise of an image by tiles, and by pixels if that was asked for.
pub(crate) struct MeasuredNoise<'a> {
    pub tiles: Vec<PixelNoise>,
    /// Squared relative error of each pixel, or none.
    pub errors: &'a [f32],
}

impl DeviceHalves {
    /// Makes halves without samples for images of a film's size, with the memory of others if that
    /// fits.
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
        if film.of.has_aovs() {
            return Err(misuse("halves on a device have no AOVs"));
        }
        compile(device, &[FILM_REQUEST, FILM_SUMS, FILM_NOISE])?;
        let size = (film.of.width, film.of.height);
        let (pixels, tiles) = (film.of.pixels(), Self::tiles(size));
        let fits = |halves: &Self| halves.size == size;
        let (first, second, rest) = match other.filter(fits) {
            Some(Self { of: [first, second], sums, counts, noise, read, .. }) => {
                (Some(first), Some(second), Some((sums, counts, noise, read)))
            }
            None => (None, None, None),
        };
        let of = [DeviceTotals::begin(device, film, first)?, DeviceTotals::begin(device, film, second)?];
        let tiles = u64::from(tiles.0) * u64::from(tiles.1);
        let words = tiles * u64::from(NOISE_WORDS) + pixels;
        let (sums, counts, noise, read) = match rest {
            Some(rest) => rest,
            None => (
                device.allocate(2 * pixels * size_of::<PixelSums>() as u64, "the halves' sums")?,
                device.allocate(4 * tiles, "the numbers of samples by tile")?,
                device.allocate(4 * words, "the noise")?,
                HostRecords::new(words as usize),
            ),
        };
        device.pin(read.memory());
        Ok(Self { size, of, sums, counts, noise, read })
    }

    /// Returns whether they are those of images of a film's size.
    pub fn is_of(&self, film: &FilmDesc) -> bool {
        self.size == (film.width, film.height)
    }

    /// Prepares the memory through which the host reads: its first touch takes as long as a copy.
    pub fn prepare(&self, device: &mut dyn Device, bands: &mut Bands) {
        let words = DeviceTotals::band(self.size) * DeviceTotals::row(self.size) / 4;
        bands.prepare::<2>(device, words as usize);
    }

    /// Unpins the memory on the host.
    pub fn unpin(&self, device: &mut dyn Device) {
        device.unpin(self.read.memory());
    }

    /// Returns the number of tiles across and down.
    fn tiles((width, height): (u32, u32)) -> (u32, u32) {
        (width.div_ceil(TILE), height.div_ceil(TILE))
    }

    /// Returns the parameters of a launch over the whole image, with tiles.
    fn params(&self, samples: &Range<u32>) -> TotalsParams {
        let rows = RowSet::from(0..self.size.1);
        TotalsParams { tiles_across: Self::tiles(self.size).0, ..params(self.size, &rows, samples) }
    }

    /// Adds the film's chunk of `samples` to a half, and resets it.
    pub fn add_chunk(
        &self,
        device: &mut dyn Device,
        film: &DeviceFilm,
        half: usize,
        samples: &Range<u32>,
    ) -> Result<(), BackendError> {
        let totals = self.of.get(half).ok_or_else(|| misuse("there are two halves"))?;
        totals.add_chunk(device, film, &RowSet::from(0..self.size.1), samples)
    }

    /// Requests a number of samples for each tile, at most `end`, whose last one is before `end`.
    pub fn request(
        &self,
        device: &mut dyn Device,
        film: &DeviceFilm,
        counts: &[u32],
        end: u32,
    ) -> Result<(), BackendError> {
        check_rows(self.size, film, &RowSet::from(0..self.size.1))?;
        if size_of_val(counts) as u64 != self.counts.bytes() {
            return Err(misuse("the numbers of samples are those of another number of tiles"));
        }
        device.write(&self.counts, 0, cast_slice(counts))?;
        let params = self.params(&(end..end));
        let arrays = [&film.sums, &film.aovs, &self.of[0].totals, &self.counts];
        let launch = launch(FILM_REQUEST, &params, arrays, self.size)?;
        // SAFETY: the film has a record for each pixel, as was compared, and there is a number for
        // each tile.
        unsafe { device.start(vec![launch]) }.map(|_| ())
    }

    /// Adds the film's samples, as many for each tile as were requested last, to a half, and resets
    /// them.
    pub fn add_tiles(
        &self,
        device: &mut dyn Device,
        film: &DeviceFilm,
        half: usize,
    ) -> Result<(), BackendError> {
        check_rows(self.size, film, &RowSet::from(0..self.size.1))?;
        let totals = self.of.get(half).ok_or_else(|| misuse("there are two halves"))?;
        let params = self.params(&(0..0));
        let arrays = [&film.sums, &film.aovs, &totals.totals, &self.counts];
        let launch = launch(FILM_ADD, &params, arrays, self.size)?;
        // SAFETY: as in `request`; the totals have words for each pixel.
        unsafe { device.start(vec![launch]) }.map(|_| ())
    }

    /// Measures the noise: of each tile, and of each pixel `with_errors`.
    pub fn noise(
        &mut self,
        device: &mut dyn Device,
        film: &DeviceFilm,
        from_halves: bool,
        with_errors: bool,
    ) -> Result<MeasuredNoise<'_>, BackendError> {
        let (width, height) = self.size;
        let all = params(self.size, &RowSet::from(0..height), &(0..0));
        let of_half = [0, 1].map(|half| TotalsParams { half, ..all });
        let tiles = Self::tiles(self.size);
        let of_tiles = TotalsParams {
            noise_from_halves: u32::from(from_halves),
            with_errors: u32::from(with_errors),
            ..self.params(&(0..0))
        };
        let mut commands = Vec::new();
        for (params, totals) in of_half.iter().zip(&self.of) {
            let arrays = [&self.sums, &film.aovs, &totals.totals, &totals.output];
            commands.push(launch(FILM_SUMS, params, arrays, self.size)?);
        }
        let arrays = [&self.sums, &film.aovs, &self.of[0].totals, &self.noise];
        commands.push(launch(FILM_NOISE, &of_tiles, arrays, tiles)?);
        let of_pixels = if with_errors { width as usize * height as usize } else { 0 };
        let of_tiles = tiles.0 as usize * tiles.1 as usize * NOISE_WORDS as usize;
        self.read.resize(of_tiles + of_pixels);
        let rows = RowSet::from(0..self.read.len() as u32);
        let to = RowTarget::records(&mut self.read, &rows);
        commands.push(Command::Read { from: &self.noise, to });
        // SAFETY: totals and sums have records for each pixel, and the output has words for each
        // tile and pixel.
        unsafe { device.run(commands) }?;
        let (of_tiles, of_pixels) = self.read.split_at(of_tiles);
        let of = |words: &[u32]| {
            let number = |index: usize| words.get(index).map_or(0.0, |&bits| f32::from_bits(bits));
            PixelNoise { error: number(0), variance: (number(1), number(2)), work: (number(3), number(4)) }
        };
        let tiles = of_tiles.chunks_exact(NOISE_WORDS as usize).map(of).collect();
        Ok(MeasuredNoise { tiles, errors: cast_slice(of_pixels) })
    }

    /// Reads a record of so many sums for each pixel of both halves, by bands: `use_band` gets
    /// their place in the image, and those of each half.
    pub fn read<T: Pod + Sync>(
        &self,
        (device, bands): (&mut dyn Device, &mut Bands),
        film: &DeviceFilm,
        sums: u32,
        use_band: &mut UseBand<'_, T, 2>,
    ) -> Result<(), BackendError> {
        let rows = RowSet::from(0..self.size.1);
        check_rows(self.size, film, &rows)?;
        let from = [0, 1].map(|half: usize| (&self.of[half].totals, &self.of[half].output));
        bands.for_each(device, &Read { film, size: self.size, from, rows: &rows, sums }, use_band)
    }
}
