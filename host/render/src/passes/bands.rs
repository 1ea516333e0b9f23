//! Reading of totals by bands of rows, through memory to which a GPU copies directly.

use super::film::DeviceFilm;
use super::totals_launch::{launch, params};
use bytemuck::{Pod, cast_slice};
use std::ops::Range;
use trisect_device::{BackendError, Buffer, Command, Device, HostRecords, RowSet, RowTarget, Started};
use trisect_kernels::FILM_READ;
use trisect_shared::totals::TotalsParams;

/// Host memory for bands of up to two films: while the device fills one, threads use another.
#[derive(Default)]
pub(super) struct Bands {
    words: [[HostRecords<u32>; 2]; 2],
}

/// Records to read: so many sums of the pixels of some rows, from totals with an output each, which
/// has room for a row of any record.
pub(super) struct Read<'a, const N: usize> {
    pub film: &'a DeviceFilm,
    /// Pixels across and down the image.
    pub size: (u32, u32),
    pub from: [(&'a Buffer, &'a Buffer); N],
    pub rows: &'a RowSet,
    pub sums: u32,
}

/// Function that gets a band: its place among the pixels of the rows, and the records from each of
/// `N` films.
pub(crate) type UseBand<'a, T, const N: usize> = dyn FnMut(Range<usize>, [&[T]; N]) + Send + 'a;

impl Bands {
    /// Unpins the memory: the device goes to another scene.
    pub fn unpin(&self, device: &mut dyn Device) {
        self.words.iter().flatten().for_each(|words| device.unpin(words.memory()));
    }

    /// Makes room for so many words in each band of `N` films, and pins it.
    pub fn prepare<const N: usize>(&mut self, device: &mut dyn Device, words: usize) {
        for band in self.words.iter_mut().flat_map(|bands| bands.iter_mut().take(N)) {
            if band.memory().bytes() < 4 * words {
                device.unpin(band.memory());
            }
            band.resize(words);
            device.pin(band.memory());
        }
    }

    /// Reads records of all pixels of the rows, and calls `use_band` with those of each band, in
    /// order, while the device writes the next one.
    ///
    /// The caller has checked that the rows are those of totals of the film's size.
    pub fn for_each<T: Pod + Sync, const N: usize>(
        &mut self,
        device: &mut dyn Device,
        read: &Read<'_, N>,
        use_band: &mut UseBand<'_, T, N>,
    ) -> Result<(), BackendError> {
        let width = read.size.0 as usize;
        let band = read.band_of::<T>();
        self.prepare::<N>(device, width * band as usize * size_of::<T>() / 4);
        let [mut current, mut other] = self.words.each_mut();
        let mut before: Option<(Range<usize>, Started)> = None;
        let mut outcome = Ok(());
        for first in (0..read.rows.len()).step_by(band as usize) {
            let rows = read.rows.part(first..first + band);
            let pixels = first as usize * width..(first + rows.len()) as usize * width;
            let words = pixels.len() * size_of::<T>() / 4;
            current.iter_mut().take(N).for_each(|memory| memory.resize(words));
            let packed = RowSet::from(0..rows.len());
            let targets = current.iter_mut().map(|memory| RowTarget::records(memory, &packed));
            let started = rayon::in_place_scope(|scope| {
                // A device that returns when it has ended reads while other threads copy.
                if let Some((pixels, _)) = before.take_if(|(_, started)| started.has_ended()) {
                    let (other, use_band) = (&*other, &mut *use_band);
                    scope.spawn(move |_| use_band(pixels, std::array::from_fn(|i| cast_slice(&other[i]))));
                }
                // SAFETY: nothing accesses this memory before the device was waited for.
                unsafe { read.start_band(device, &rows, targets) }
            });
            if let Some((pixels, started)) = before.take() {
                outcome = device.wait(started).map(|_| ());
                if outcome.is_ok() {
                    use_band(pixels, std::array::from_fn(|i| cast_slice(&other[i])));
                }
            }
            match started {
                Ok(started) => before = Some((pixels, started)),
                Err(error) => outcome = outcome.and(Err(error)),
            }
            if outcome.is_err() {
                break;
            }
            std::mem::swap(&mut current, &mut other);
        }
        if let Some((pixels, started)) = before {
            let ended = device.wait(started).map(|_| ());
            outcome = outcome.and(ended);
            if outcome.is_ok() {
                use_band(pixels, std::array::from_fn(|i| cast_slice(&other[i])));
            }
        }
        outcome
    }
}

impl<const N: usize> Read<'_, N> {
    /// Returns the number of rows of records that a band has.
    pub fn band_of<T>(&self) -> u32 {
        let row = (self.size.0 as usize * size_of::<T>()).max(1) as u64;
        let room = self.from.iter().map(|(_, output)| output.bytes()).min().unwrap_or(0);
        (room / row).clamp(1, u64::from(self.rows.len().max(1))) as u32
    }

    /// Starts to read the records of the rows of a band, to a target for each film. It has as many
    /// bytes as the records, packed.
    ///
    /// # Safety
    ///
    /// Nothing accesses the memory of the targets before the device was waited for.
    pub unsafe fn start_band<'b>(
        &self,
        device: &mut dyn Device,
        rows: &RowSet,
        to: impl IntoIterator<Item = RowTarget<'b>>,
    ) -> Result<Started, BackendError> {
        let params = TotalsParams { sums: self.sums, ..params(self.size, rows, &(0..0)) };
        let mut commands = Vec::new();
        for ((totals, output), to) in self.from.iter().zip(to) {
            let arrays = [&self.film.sums, &self.film.aovs, totals, output];
            commands.push(launch(FILM_READ, &params, arrays, (self.size.0, rows.len()))?);
            commands.push(Command::Read { from: output, to });
        }
        // SAFETY: the totals have words for each pixel of the rows, as the caller has checked; the
        // output has a place for as many records as there are threads.
        unsafe { device.start(commands) }
    }
}
