//! Fallback to another device, which continues a render after a device failed.

use super::{FilmObserver, PreparedScene, RenderObserver, Renderer, Settings};
use crate::Error;
use crate::film::Film;
use crate::stats::RenderStats;
use std::ops::Range;
use trisect_device::{BackendError, Device};

/// Function that creates a renderer of the same scene on another device, and adapts the settings to
/// it. Its arguments are the error of the failed device, the film so far and the settings. `None`
/// ends the render with that error.
pub type FallbackFactory<'a> =
    dyn FnMut(&BackendError, &Film, &mut Settings) -> Option<Result<Renderer, Error>> + 'a;

/// Function that opens another device, which replaces one that failed with this error. `None` keeps
/// the error.
pub type DeviceFallback<'a> = dyn FnMut(&BackendError) -> Option<Result<Box<dyn Device>, Error>> + 'a;

/// Function that adds samples to a film.
pub(super) type RenderFilm<'a> =
    dyn FnMut(&mut Renderer, &mut Film, &Settings) -> Result<RenderStats, Error> + 'a;

impl Renderer {
    /// Renders as [`render_missing`](Self::render_missing) does. If the device fails, `elsewhere`
    /// creates the renderer that continues, and this renderer becomes that one. Parts that were not
    /// complete are rendered again; if both devices round alike, the film has the same bits as with
    /// one device. The statistics are those of the last device alone.
    ///
    /// # Errors
    ///
    /// The errors of [`render_missing`](Self::render_missing) if `elsewhere` gives up, or of
    /// creating another renderer.
    pub fn render_missing_with_fallback(
        &mut self,
        film: &mut Film,
        settings: &mut Settings,
        samples: &Range<u32>,
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
        elsewhere: &mut FallbackFactory<'_>,
    ) -> Result<RenderStats, Error> {
        let mut render = |renderer: &mut Self, film: &mut Film, settings: &Settings| {
            renderer.render_missing(film, settings, samples, keeper, observer)
        };
        self.render_or_fall_back(film, settings, &mut render, elsewhere)
    }

    /// Replaces the scene as [`set_scene`](Self::set_scene) does. If the device fails, or has too
    /// little memory for the scene at its new time, `elsewhere` opens the one that continues, and
    /// this renderer becomes one on that device.
    ///
    /// # Errors
    ///
    /// The errors of [`set_scene`](Self::set_scene) if `elsewhere` gives up, or of opening another
    /// device.
    pub fn set_scene_with_fallback(
        &mut self,
        scene: &mut PreparedScene<'_>,
        elsewhere: &mut DeviceFallback<'_>,
    ) -> Result<(), Error> {
        let mut set = self.set_scene(scene);
        loop {
            let error = match set {
                Err(Error::Backend(error)) if error.is_of_device() => error,
                other => return other,
            };
            let Some(device) = elsewhere(&error) else { return Err(error.into()) };
            set = Self::upload(device?, scene).map(|renderer| *self = renderer);
        }
    }

    /// Calls `render` until it succeeds, or no renderer is left.
    pub(super) fn render_or_fall_back(
        &mut self,
        film: &mut Film,
        settings: &mut Settings,
        render: &mut RenderFilm<'_>,
        elsewhere: &mut FallbackFactory<'_>,
    ) -> Result<RenderStats, Error> {
        loop {
            let error = match render(self, film, settings) {
                Err(Error::Backend(error)) if error.is_of_device() => error,
                other => return other,
            };
            match elsewhere(&error, film, settings) {
                Some(renderer) => *self = renderer?,
                None => return Err(error.into()),
            }
        }
    }
}
