//! Where a device fails, another goes on.

use super::{FilmObserver, RenderObserver, Renderer, Settings};
use crate::Error;
use crate::backend::BackendError;
use crate::film::Film;
use crate::stats::RenderStats;
use std::ops::Range;

/// Makes a renderer of the same scene elsewhere, and fits the settings to it; none to give up. Told why, and what there is so far.
pub type FallbackFactory<'a> =
    dyn FnMut(&BackendError, &Film, &mut Settings) -> Option<Result<Renderer, Error>> + 'a;

impl Renderer {
    /// As [`render_missing`](Self::render_missing), and where the device fails, `elsewhere` says who goes on: this renderer becomes that one. Parts that were not
    /// complete are rendered anew; the film is that of one device, bit for bit, if both round alike. What is returned is of the last device alone.
    ///
    /// # Errors
    ///
    /// As there, of who gave up.
    pub fn render_missing_with_fallback(
        &mut self,
        film: &mut Film,
        settings: &mut Settings,
        samples: &Range<u32>,
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
        elsewhere: &mut FallbackFactory<'_>,
    ) -> Result<RenderStats, Error> {
        loop {
            let error = match self.render_missing(film, settings, samples, keeper, observer) {
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
