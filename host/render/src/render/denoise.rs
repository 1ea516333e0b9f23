//! Denoising of a film, or of sums in the kernels' format.

use super::chunk_buffers::ChunkSums;
use super::{Renderer, Settings};
use crate::Error;
use crate::denoise::{self, DenoiseError, Denoiser, FrameView, TemporalInputs, oidn, passes};
use crate::film::Film;
use std::time::Duration;
use trisect_image::Image;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::FilteredPixel;
use trisect_shared::film::PixelSums;

impl Renderer {
    /// Denoises a film of this scene, with a filter on the device or by Open Image Denoise.
    /// `settings` are those that rendered it, with AOVs. Returns the image and the time of each
    /// pass.
    ///
    /// # Errors
    ///
    /// [`Error::Denoise`] for parameters out of range, a film without AOV totals or a missing
    /// library, and the errors of [`render`](Self::render).
    pub fn denoise(
        &mut self,
        film: &Film,
        settings: &Settings,
        denoise: impl Into<Denoiser>,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise::check_has_aovs(film)?;
        let settings = Settings { width: film.width, height: film.height, ..settings.clone() };
        self.denoise_sums(&|sums, guides| denoise::sums(film, sums, guides), &settings, &denoise.into())
    }

    /// Denoises sums and AOV sums of an image of the settings' size. `fill` writes a record of each
    /// for every pixel, in the kernels' format.
    ///
    /// # Errors
    ///
    /// The errors of [`denoise`](Self::denoise).
    pub fn denoise_sums(
        &mut self,
        fill: &dyn Fn(&mut [PixelSums], &mut [AovSums]),
        settings: &Settings,
        denoise: &Denoiser,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise.check()?;
        let settings = Settings { guides: true, ..settings.clone() };
        // The memory was checked before the film was rendered, and much of what is held now was
        // counted then.
        if let Denoiser::Filter(_) = denoise {
            self.make_film(&settings)?;
        }
        let count = settings.pixels() as usize;
        self.pipeline.current.resize(self.uploaded.device_mut(), count, true);
        let ChunkSums { pixels, aovs } = &mut self.pipeline.current;
        fill(pixels, aovs);
        let (width, height) = (settings.width, settings.height);
        let denoise = match denoise {
            Denoiser::Filter(denoise) => denoise,
            Denoiser::Oidn => {
                return Ok(oidn::denoise(pixels, aovs, (width, height)).map_err(DenoiseError::Oidn)?);
            }
        };
        self.uploaded.write_film(pixels, aovs)?;
        let image = FrameView::by(&self.camera(&settings), self.scene.middle(), width, height);
        let passes = passes(Some(denoise), &image, &TemporalInputs::none(&image), &(0..height));
        let times = self.uploaded.denoise(&passes)?;
        self.filtered.resize(count, FilteredPixel::UNKNOWN);
        self.uploaded.read_denoised(
            passes.last().map_or(0, |pass| pass.to),
            (width, height),
            &mut self.filtered,
        )?;
        Ok((denoise::image(width, height, &self.filtered), times))
    }
}
