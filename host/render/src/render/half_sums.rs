//! Two halves of an image that add up on the device, for adaptive sampling.

use super::chunk::ChunkTiming;
use super::film_state::FilmState;
use super::{ChunkJob, Renderer, Settings, Summation, TileSamples};
use crate::Error;
use crate::film::{Film, PixelTotals, RadianceTotals, RowSet, TASK, Tiles};
use crate::passes::MeasuredNoise;
use rayon::prelude::*;
use std::ops::{ControlFlow, Range};
use trisect_device::{BackendError, DeviceKind};
use trisect_image::Image;

impl Renderer {
    /// Prepares the kernel, and makes halves without samples on the device. Returns false where the
    /// host should have them: as the settings say, or because the device lacks the memory.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk).
    pub(crate) fn begin_halves(&mut self, settings: &Settings) -> Result<bool, Error> {
        let is_gpu = self.device().info().kind == DeviceKind::Gpu;
        let rows = RowSet::from(0..settings.height);
        self.ready_for(settings, &rows, std::slice::from_ref(&(0..1)))?;
        self.summed = (Summation::Host, None);
        match settings.sums {
            Summation::Host => return Ok(false),
            Summation::Auto if !is_gpu => return Ok(false),
            Summation::Auto | Summation::Device => {}
        }
        if settings.guides {
            let asked = settings.sums == Summation::Device;
            self.summed.1 = asked.then(|| "halves with AOVs add up on the host".to_owned());
            return Ok(false);
        }
        match self.uploaded.begin_halves() {
            Ok(()) => {
                self.summed.0 = Summation::Device;
                Ok(true)
            }
            Err(error @ BackendError::TooLarge { .. }) if settings.sums == Summation::Auto => {
                self.summed.1 = Some(error.to_string());
                Ok(false)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Frees the halves' memory on the device.
    pub(crate) fn drop_halves(&mut self) {
        self.uploaded.drop_halves();
    }

    /// Renders chunks of the whole image, one for each half in turn, which add up on the device.
    /// `take` gets the half, the samples and the times of each.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk).
    pub(crate) fn add_chunks_to_halves(
        &mut self,
        job: &ChunkJob<'_>,
        watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
        take: &mut dyn FnMut(usize, &Range<u32>, &ChunkTiming),
    ) -> Result<(), Error> {
        let kernel = self.ready_for(job.settings, job.rows, job.samples)?;
        for samples in job.samples {
            for (half, &seed) in job.seeds.iter().enumerate() {
                if !(job.should_continue)() {
                    return Ok(());
                }
                let settings = Settings { seed, ..job.settings.clone() };
                let took = self.trace_chunk(&settings, job.rows, samples.clone(), watch)?;
                self.uploaded.add_chunk_to_half(half, samples)?;
                self.film_state = FilmState::Empty(settings, kernel);
                take(half, samples, &took);
            }
        }
        Ok(())
    }

    /// Renders a number of samples for each tile, which add up to a half on the device.
    ///
    /// # Errors
    ///
    /// The errors of [`render_chunk`](Self::render_chunk).
    pub(crate) fn add_tiles_to_half(
        &mut self,
        settings: &Settings,
        own: &TileSamples<'_>,
        half: usize,
        watch: &mut dyn FnMut(u64, u64) -> ControlFlow<()>,
    ) -> Result<ChunkTiming, Error> {
        let kernel = self.ready_for_tiles(settings, own)?;
        self.uploaded.request_samples(own.counts, own.end)?;
        let took = self.trace_tiles(settings, own, watch)?;
        self.uploaded.add_tiles_to_half(half)?;
        self.film_state = FilmState::Empty(settings.clone(), kernel);
        Ok(took)
    }

    /// Measures the noise of the halves on the device: of each tile, and of each pixel
    /// `with_errors`.
    pub(crate) fn noise_of_halves(
        &mut self,
        from_halves: bool,
        with_errors: bool,
    ) -> Result<MeasuredNoise<'_>, Error> {
        Ok(self.uploaded.noise(from_halves, with_errors)?)
    }

    /// Returns the image of the halves on the device, the mean of both.
    pub(crate) fn image_of_halves(&mut self, tiles: &Tiles) -> Result<Image, Error> {
        let (width, height) = tiles.image();
        let mut pixels = vec![[0.0f32; 3]; width as usize * height as usize];
        self.uploaded.read_radiance_of_halves(
            &mut |band: Range<usize>, halves: [&[RadianceTotals]; 2]| {
                let Some(pixels) = pixels.get_mut(band) else { return };
                let both = pixels.par_iter_mut().zip(halves[0]).zip(halves[1]).with_min_len(TASK);
                both.for_each(|((pixel, a), b)| {
                    *pixel = mean_of_halves((a.mean(), a.samples), (b.mean(), b.samples)).map(|v| v as f32);
                });
            },
        )?;
        Ok(Image { width, height, pixels })
    }

    /// Adds the totals of the halves on the device to an empty film: `both` returns those of a
    /// pixel.
    pub(crate) fn film_of_halves(
        &mut self,
        film: &mut Film,
        both: fn(&PixelTotals, &PixelTotals) -> PixelTotals,
    ) -> Result<(), Error> {
        let pixels = film.pixels.exact_mut();
        self.uploaded.read_halves(&mut |band: Range<usize>, halves: [&[PixelTotals]; 2]| {
            let Some(pixels) = pixels.get_mut(band) else { return };
            let pairs = pixels.par_iter_mut().zip(halves[0]).zip(halves[1]).with_min_len(TASK);
            pairs.for_each(|((pixel, a), b)| *pixel = both(a, b));
        })?;
        Ok(())
    }
}

/// Returns the mean of two halves of a pixel, given by their means and numbers of samples; that of
/// one half if the other has no samples.
pub(crate) fn mean_of_halves(a: ([f64; 3], u64), b: ([f64; 3], u64)) -> [f64; 3] {
    match (a.1, b.1) {
        (_, 0) => a.0,
        (0, _) => b.0,
        _ => std::array::from_fn(|c| 0.5 * (a.0[c] + b.0[c])),
    }
}
