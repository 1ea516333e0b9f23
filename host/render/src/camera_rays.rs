//! Camera rays of an image, sample by sample, for layers that the film has no sums of.

use crate::Error;
use crate::film::Film;
use crate::render::{RenderObserver, Renderer, Settings};
use std::ops::ControlFlow;

/// Maximum number of samples per pixel from which layers are computed that the film has no sums of.
pub const MAX_SAMPLES: u32 = 64;

/// Traces the camera rays of the first samples of an image, at most [`MAX_SAMPLES`] per pixel, and
/// passes on a film of each sample, with AOVs. Returns the number of samples.
///
/// # Errors
///
/// Those of a render; [`Error::Cancelled`] if `observer` cancels it.
pub(crate) fn for_each_sample(
    renderer: &mut Renderer,
    settings: &Settings,
    observer: &mut dyn RenderObserver,
    mut see: impl FnMut(&Renderer, &Film),
) -> Result<u32, Error> {
    let samples = settings.samples.clamp(1, MAX_SAMPLES);
    let settings = Settings { depth: 1, guides: true, samples, denoise: None, ..settings.clone() };
    for sample in 0..samples {
        let mut film = Film::with_aovs(settings.width, settings.height);
        renderer.render_samples(&mut film, &settings, &(sample..sample + 1), &(), &mut ())?;
        see(renderer, &film);
        renderer.recycle(film);
        let done = u64::from(sample + 1);
        if let ControlFlow::Break(()) = observer.progress(done, u64::from(samples)) {
            return Err(Error::Cancelled);
        }
    }
    Ok(samples)
}
