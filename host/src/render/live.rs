//! Denoising: of a film, and of frames that stay on the device.

use super::{Renderer, Settings, SettingsError};
use crate::Error;
use crate::backend::{Job, Launch};
use crate::denoise::{self, Denoise, Kernel};
use crate::film::Film;
use crate::image::Image;
use std::time::Duration;
use trisect_shared::denoise::Lit;
use trisect_shared::film::CHUNK_SAMPLES;
use trisect_shared::params::FLAG_FINISH;

/// A frame that stayed on the device, and what it took there.
#[derive(Clone, Debug)]
pub struct Live {
    /// That traced it.
    pub kernel: &'static str,
    /// Tracing it.
    pub trace: Duration,
    /// Each pass over it.
    pub passes: Vec<(Kernel, Duration)>,
    /// Which of the denoiser's two images it is.
    pub image: usize,
}

impl Renderer {
    /// Denoises a film of this scene on the backend, which `settings` render with guides. Returns the image and what each pass took.
    ///
    /// # Errors
    ///
    /// [`Error::Denoise`] for parameters that are none or a film without guides, and as [`render`](Self::render).
    pub fn denoise(
        &mut self,
        film: &Film,
        settings: &Settings,
        denoise: &Denoise,
    ) -> Result<(Image, Vec<Duration>), Error> {
        denoise.check()?;
        let (sums, guides) = denoise::sums(film)?;
        let settings = Settings { width: film.width, height: film.height, guides: true, ..settings.clone() };
        self.prepare(&settings)?;
        self.backend.write_film(&sums, &guides)?;
        let passes = denoise.passes(&self.camera(&settings), film.width, film.height);
        let times = self.backend.denoise(&passes)?;
        let mut pixels = vec![Lit::UNKNOWN; sums.len()];
        self.backend.read_denoised(passes.last().map_or(0, |pass| pass.to), &mut pixels)?;
        Ok((denoise::image(film.width, film.height, &pixels), times))
    }

    /// Renders a frame and denoises it where it is: nothing is read back, so that frames follow each other as fast as the device has them.
    /// At most [`CHUNK_SAMPLES`] samples a pixel.
    ///
    /// # Errors
    ///
    /// As [`denoise`](Self::denoise); [`SettingsError::TooManyLive`] for more samples.
    pub fn live(&mut self, settings: &Settings, denoise: &Denoise) -> Result<Live, Error> {
        denoise.check()?;
        if settings.samples > CHUNK_SAMPLES {
            return Err(SettingsError::TooManyLive { samples: settings.samples }.into());
        }
        let settings = Settings { guides: true, ..settings.clone() };
        let variant = self.choose(&settings)?;
        let job = Job { width: settings.width, height: settings.height, variant, math: settings.math };
        if self.live != Some(job) {
            self.prepare(&settings)?;
            self.live = Some(job);
        }
        let camera = self.camera(&settings);
        self.sight.look(self.backend.as_mut(), &camera, &settings, variant)?;
        let mut params = self.launch(&settings);
        self.sight.describe(&mut params);
        params.rows = settings.height;
        params.end_sample = settings.samples;
        params.flags |= FLAG_FINISH;
        let trace = self.backend.render(&Launch::new(params))?;
        let passes = denoise.passes(&camera, settings.width, settings.height);
        let times = self.backend.denoise(&passes)?;
        let image = passes.last().map_or(0, |pass| pass.to);
        Ok(Live {
            kernel: variant.name,
            trace,
            passes: passes.iter().map(|pass| pass.kernel).zip(times).collect(),
            image,
        })
    }
}
