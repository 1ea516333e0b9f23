//! Denoising: of a film, and of frames that stay on the device.

use super::schedule::Submissions;
use super::{Renderer, Settings};
use crate::Error;
use crate::denoise::{self, Denoise, Kernel};
use crate::film::Film;
use crate::image::Image;
use std::time::Duration;
use trisect_shared::denoise::Lit;

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
    image: usize,
    /// Pixels across and down.
    size: (u32, u32),
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
        // The memory was checked before the film was rendered, and much of what is held now was asked for then.
        self.make_film(&settings)?;
        self.backend.write_film(&sums, &guides)?;
        let passes = denoise.passes(&self.camera(&settings), film.width, film.height);
        let times = self.backend.denoise(&passes)?;
        let mut pixels = vec![Lit::UNKNOWN; sums.len()];
        self.backend.read_denoised(passes.last().map_or(0, |pass| pass.to), &mut pixels)?;
        Ok((denoise::image(film.width, film.height, &pixels), times))
    }

    /// Renders a frame and denoises it where it is: nothing is read back, so that frames follow each other as fast as the device has them.
    /// At most one chunk of samples a pixel.
    ///
    /// # Errors
    ///
    /// As [`denoise`](Self::denoise); [`SettingsError::TooManyLive`](super::SettingsError::TooManyLive) for more samples.
    pub fn live(&mut self, settings: &Settings, denoise: &Denoise) -> Result<Live, Error> {
        denoise.check()?;
        settings.check_live()?;
        let settings = Settings { guides: true, ..settings.clone() };
        let variant = match self.live.take().filter(|(before, _)| *before == settings) {
            Some((_, variant)) => variant,
            None => self.prepare(&settings)?,
        };
        let camera = self.camera(&settings);
        self.sight.look(self.backend.as_mut(), &camera, &settings, variant)?;
        let mut submissions = Submissions::new(settings.width, 0..settings.height, settings.samples);
        let mut trace = Duration::ZERO;
        while let Some(submission) = submissions.next(&self.pace) {
            trace += self.submit(&settings, submission, 0, settings.samples)?;
        }
        let passes = denoise.passes(&camera, settings.width, settings.height);
        let times = self.backend.denoise(&passes)?;
        let live = Live {
            kernel: variant.name,
            trace,
            passes: passes.iter().map(|pass| pass.kernel).zip(times).collect(),
            image: passes.last().map_or(0, |pass| pass.to),
            size: (settings.width, settings.height),
        };
        self.live = Some((settings, variant));
        Ok(live)
    }

    /// The pixels of the live frame that was rendered last.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] when the device fails, or has another image by now.
    pub fn read_live(&mut self, live: &Live) -> Result<Image, Error> {
        let (width, height) = live.size;
        let mut pixels = vec![Lit::UNKNOWN; width as usize * height as usize];
        self.backend.read_denoised(live.image, &mut pixels)?;
        Ok(denoise::image(width, height, &pixels))
    }
}
