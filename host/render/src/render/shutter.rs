//! Motion blur: a shutter that is open for a time, over whose moments the samples of each pixel are
//! divided.

use super::{FallbackFactory, FilmObserver, RenderObserver, Renderer, Settings};
use crate::Error;
use crate::error::MotionError;
use crate::film::Film;
use crate::stats::RenderStats;
use std::ops::Range;

/// Shutter that opens at the time of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter {
    /// Seconds for which it is open.
    seconds: f64,
    steps: u32,
}

/// Moment at which some samples of each pixel are rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Seconds since the shutter opened.
    pub after: f64,
    /// Samples of each pixel.
    pub samples: Range<u32>,
}

impl Shutter {
    /// Default number of moments, if a pixel has as many samples.
    pub const DEFAULT_STEPS: u32 = 16;

    /// Returns a shutter that is open for `seconds`, and divides the samples of each pixel over
    /// `steps` moments. `None` is the default number of steps, or one for each sample if there are
    /// fewer. A shutter that is open for 0 s has one moment.
    ///
    /// # Errors
    ///
    /// [`MotionError::Steps`] for no step, or more than a pixel has samples.
    pub fn new(seconds: f64, steps: Option<u32>, samples: u32) -> Result<Self, MotionError> {
        let steps = steps.unwrap_or(Self::DEFAULT_STEPS.min(samples));
        if steps == 0 || steps > samples {
            return Err(MotionError::Steps { steps, samples });
        }
        Ok(Self { seconds, steps: if seconds > 0.0 { steps } else { 1 } })
    }

    /// Returns the moments of an image of `samples` samples per pixel, as many as the shutter was
    /// made for. Moment i of n has the samples from ⌊i · samples / n⌋ on, and is in the middle of
    /// its share of the time: that of its samples among all.
    pub fn moments(&self, samples: u32) -> impl ExactSizeIterator<Item = Moment> + use<> {
        let Self { seconds, steps } = *self;
        let bound = move |step: u32| (u64::from(step) * u64::from(samples) / u64::from(steps)) as u32;
        (0..steps).map(move |step| {
            let samples_of = bound(step)..bound(step + 1);
            let middle = 0.5 * (f64::from(samples_of.start) + f64::from(samples_of.end));
            let share = if seconds > 0.0 { middle / f64::from(samples) } else { 0.0 };
            Moment { after: seconds * share, samples: samples_of }
        })
    }
}

impl Renderer {
    /// Renders the samples of a moment that `film` lacks, as
    /// [`render_missing_with_fallback`](Self::render_missing_with_fallback) does, and adds them.
    /// They may begin and end at any index. The films of all moments, added in any order, are the
    /// film of the image; its samples are summed in single precision over those chunks of 256 that
    /// a moment has a part of, and exactly over the parts.
    ///
    /// # Errors
    ///
    /// The errors of [`render_missing_with_fallback`](Self::render_missing_with_fallback), except
    /// that samples may split a chunk.
    pub fn render_moment(
        &mut self,
        film: &mut Film,
        settings: &mut Settings,
        samples: &Range<u32>,
        keeper: &dyn FilmObserver,
        observer: &mut dyn RenderObserver,
        elsewhere: &mut FallbackFactory<'_>,
    ) -> Result<RenderStats, Error> {
        let mut render = |renderer: &mut Self, film: &mut Film, settings: &Settings| {
            renderer.render_samples(film, settings, samples, keeper, observer)
        };
        self.render_or_fall_back(film, settings, &mut render, elsewhere)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_samples_and_the_time_are_divided() {
        let shutter = Shutter::new(0.5, Some(4), 8).unwrap();
        let moments: Vec<Moment> = shutter.moments(8).collect();
        let expected = [(0.0625, 0..2), (0.1875, 2..4), (0.3125, 4..6), (0.4375, 6..8)];
        assert_eq!(moments, expected.map(|(after, samples)| Moment { after, samples }));
        // The mean time is the middle of the interval, also if steps have different numbers of
        // samples.
        for (steps, samples) in [(3, 8), (7, 64), (1, 5), (5, 5), (16, 4_000_000_000)] {
            let moments: Vec<Moment> =
                Shutter::new(2.0, Some(steps), samples).unwrap().moments(samples).collect();
            assert!(moments.windows(2).all(|pair| pair[0].samples.end == pair[1].samples.start));
            assert_eq!((moments[0].samples.start, moments.last().unwrap().samples.end), (0, samples));
            let weight = |moment: &Moment| moment.samples.len() as f64 / f64::from(samples);
            let mean: f64 = moments.iter().map(|moment| weight(moment) * moment.after).sum();
            assert!((mean - 1.0).abs() < 1e-9, "{steps} {samples}: {mean}");
        }
    }

    #[test]
    fn steps_are_at_most_the_samples() {
        assert_eq!(Shutter::new(1.0, None, 64).unwrap().moments(64).len(), 16);
        assert_eq!(Shutter::new(1.0, None, 3).unwrap().moments(3).len(), 3);
        let refused = Shutter::new(1.0, Some(9), 8).unwrap_err();
        assert_eq!(refused, MotionError::Steps { steps: 9, samples: 8 });
        // Negative control: a shutter that does not stay open has one moment, at its start.
        let sharp: Vec<Moment> = Shutter::new(0.0, Some(8), 8).unwrap().moments(8).collect();
        assert_eq!(sharp, [Moment { after: 0.0, samples: 0..8 }]);
    }
}
