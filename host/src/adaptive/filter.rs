//! Whether a denoiser makes an image better, by two halves of it.

use super::renderer::AdaptiveRenderer;
use super::{DualBuffers, FilterTrial};
use crate::Error;
use crate::denoise::DenoiseSettings;
use crate::film::TASK;
use crate::image::Image;
use crate::metrics::REL_MSE_EPSILON as EPSILON;
use crate::render::{Renderer, Settings};
use rayon::prelude::*;
use std::time::Instant;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;

/// What of the time trials of the filter may take: of both halves, and of one.
const TRIALS: (f64, f64) = (0.12, 0.15);

/// The error above which a filter is worth more of the time.
const NOISY: f64 = 0.04;

/// What of the time the filter may cost an image that is less noisy, with what samples take longer that find the edges for it, until it is decided.
const SHARE: f64 = 0.06;

/// What the filtered image's squared error must be at most, of the plain one's: an estimate is worth less than a film.
const BETTER: f64 = 0.8;

/// A filter on this device.
pub(super) struct Filter<'a> {
    denoise: &'a DenoiseSettings,
    /// For an image of the settings' size.
    seconds: f64,
    trials: u32,
}

/// How an image was filtered.
pub struct Filtered {
    pub denoise: DenoiseSettings,
    /// The root of the relMSE that its halves let expect.
    pub expected: f64,
    /// By the device's timer.
    pub seconds: f64,
}

/// Whether an image gets filtered.
pub(super) struct Choice {
    /// Whatever it brings.
    always: bool,
    taken: bool,
    decided: bool,
    /// Squared, at the end: filtered, and as it is.
    expected: f64,
    plain: f64,
}

impl Choice {
    pub fn trial(&self) -> Option<FilterTrial> {
        let trial = FilterTrial { filtered: self.expected.sqrt(), plain: self.plain.sqrt() };
        self.expected.is_finite().then_some(trial)
    }

    pub fn is_open(&self) -> bool {
        !self.decided
    }

    pub fn may_be(&self) -> bool {
        self.taken || !self.decided
    }

    /// Tries the filter on one half, or on both, and compares with the other. With `more` times the samples, what is noise becomes so many times less.
    ///
    /// The squared difference of a filtered half from the other half is that half's noise and the error of the filter: the two are independent
    /// (Rousselle et al. 2011, section 4, choose filters by the same).
    pub fn decide(&mut self, filter: &Filter, taker: &mut AdaptiveRenderer, more: f64) -> Result<(), Error> {
        if filter.trials == 0 {
            (self.decided, self.taken) = (true, self.always);
            return Ok(());
        }
        let mut images = Vec::new();
        for half in 0..filter.trials as usize {
            let halves = &taker.halves;
            let fill = |sums: &mut [_], guides: &mut [_]| halves.sums(half, sums, guides);
            images.push(taker.renderer.denoise_sums(&fill, &taker.settings, filter.denoise)?.0);
        }
        // Weights by the filtered images, whose noise is small, and by the samples, without which what only one half saw would count too much.
        let smooth = between(&images, &taker.halves.image());
        let apart = taker.apart();
        let halves = &taker.halves;
        let mean = |half: usize, pixel: usize| halves.pixels(half)[pixel].mean();
        let variance_of = |half: usize, pixel: usize, c: usize| {
            let totals = &halves.pixels(half)[pixel];
            match apart || totals.samples < 2 {
                true => 0.5 * (mean(0, pixel)[c] - mean(1, pixel)[c]).powi(2),
                false => totals.variance_of_mean()[c],
            }
        };
        let noise = [0, 1].map(|half| relative(&smooth, |pixel, c| variance_of(half, pixel, c).sqrt()));
        let difference = |image: &Image, half: usize| {
            relative(&smooth, |pixel, c| f64::from(image.pixels[pixel][c]) - mean(half, pixel)[c])
        };
        // Half of the samples each: twice the error of both.
        let raw = 0.25 * (noise[0] + noise[1]) / more;
        let errors: Vec<f64> = images
            .iter()
            .enumerate()
            .map(|(half, image)| (difference(image, 1 - half) - noise[1 - half]).max(0.0))
            .collect();
        let error = errors.iter().sum::<f64>() / errors.len() as f64;
        let variance = match &images[..] {
            [a, b] => 0.5 * relative(&smooth, |p, c| f64::from(a.pixels[p][c]) - f64::from(b.pixels[p][c])),
            _ => 0.0, // of one half, what is noise is not known: the error is taken for what it is now
        };
        self.expected = (error - variance).max(0.0) + variance / (2.0 * more);
        self.plain = raw;
        self.taken = self.always || self.expected < BETTER * raw;
        self.decided = true;
        Ok(())
    }
}

/// Halfway from the mean of some images to another.
fn between(images: &[Image], plain: &Image) -> Image {
    let share = 0.5 / images.len().max(1) as f32;
    let pixel = |pixel: usize| {
        std::array::from_fn(|c| {
            0.5 * plain.pixels[pixel][c]
                + share * images.iter().map(|image| image.pixels[pixel][c]).sum::<f32>()
        })
    };
    let pixels = (0..plain.pixels.len()).into_par_iter().map(pixel).collect();
    Image { width: plain.width, height: plain.height, pixels }
}

/// Mean over pixels and channels of the square over mean² + 0.01; what is no number is left out.
fn relative(weights: &Image, value: impl Fn(usize, usize) -> f64 + Sync) -> f64 {
    let of = |pixel: usize| {
        (0..3)
            .map(|c| value(pixel, c).powi(2) / (f64::from(weights.pixels[pixel][c]).powi(2) + EPSILON))
            .filter(|square| square.is_finite())
            .sum::<f64>()
    };
    let count = weights.pixels.len();
    let parts = (0..count.div_ceil(TASK)).into_par_iter();
    // In order: a sum of floating-point numbers depends on it.
    let sums: Vec<f64> = parts.map(|i| (i * TASK..((i + 1) * TASK).min(count)).map(of).sum()).collect();
    sums.iter().sum::<f64>() / (3 * count).max(1) as f64
}

impl<'a> Filter<'a> {
    /// Compiles the filter and measures it on halves of nothing that have guides.
    pub fn try_out(
        renderer: &mut Renderer,
        settings: &Settings,
        denoise: &'a DenoiseSettings,
        halves: &DualBuffers,
    ) -> Result<Self, Error> {
        let fill = |sums: &mut [PixelSums], guides: &mut [AovSums]| {
            halves.all_sums(sums, guides);
            sums.par_iter_mut().with_min_len(TASK).for_each(|sums| sums.samples = 2);
            guides.par_iter_mut().with_min_len(TASK).for_each(|guides| guides.misses = 2);
        };
        renderer.pin_chunks(settings.pixels() as usize, true);
        renderer.denoise_sums(&fill, settings, denoise)?;
        let start = Instant::now();
        renderer.denoise_sums(&fill, settings, denoise)?;
        Ok(Self { denoise, seconds: start.elapsed().as_secs_f64(), trials: 0 })
    }

    /// Whether there could be time for it, however noisy the image.
    pub fn may_fit(&self, whole: f64, free: bool) -> bool {
        !free || self.seconds <= TRIALS.1 * whole
    }

    /// Whether there is time for it; one that must be is never left out.
    pub fn fits(&self, whole: f64, free: bool, expected: f64, slower: f64) -> bool {
        let share = self.seconds / whole;
        let fits = if expected > NOISY { share <= TRIALS.1 } else { share + 0.5 * slower <= SHARE };
        !free || fits
    }

    /// What it will take, with trials if there will be any.
    pub fn reserve(&self, choice: &Choice) -> f64 {
        let trials = if choice.decided { 0 } else { self.trials };
        if choice.may_be() { self.seconds * f64::from(1 + trials) } else { 0.0 }
    }

    /// What is to be decided.
    pub fn choice(free: bool) -> Choice {
        Choice { always: !free, taken: !free, decided: false, expected: f64::NAN, plain: f64::NAN }
    }

    /// As many halves as there is time for.
    pub fn with_trials(mut self, whole: f64) -> Self {
        self.trials = match () {
            () if 2.0 * self.seconds <= TRIALS.0 * whole => 2,
            () if self.seconds <= TRIALS.1 * whole => 1,
            () => 0,
        };
        self
    }

    /// Filters the image, if that was chosen.
    pub fn finish(
        self,
        taker: &mut AdaptiveRenderer,
        choice: &Choice,
    ) -> Result<Option<(Image, Filtered)>, Error> {
        if !choice.taken {
            return Ok(None);
        }
        let halves = &taker.halves;
        let fill = |sums: &mut [_], guides: &mut [_]| halves.all_sums(sums, guides);
        let (image, passes) = taker.renderer.denoise_sums(&fill, &taker.settings, self.denoise)?;
        let seconds = passes.iter().map(std::time::Duration::as_secs_f64).sum();
        let filtered = Filtered { denoise: *self.denoise, expected: choice.expected.sqrt(), seconds };
        Ok(Some((image, filtered)))
    }
}
