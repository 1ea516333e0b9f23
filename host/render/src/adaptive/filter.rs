//! Decides whether denoising improves an image, by trials on its two independent halves, and
//! denoises it. "Filter" is the denoiser here. Rendering within a time budget (`budget`) calls it.

use super::renderer::AdaptiveRenderer;
use super::{DualBuffers, FilterTrial};
use crate::Error;
use crate::denoise::Denoiser;
use crate::film::TASK;
use crate::render::{Renderer, Settings};
use rayon::prelude::*;
use trisect_image::Image;
use trisect_image::metrics::REL_MSE_EPSILON as EPSILON;
use trisect_shared::aovs::AovSums;
use trisect_shared::film::PixelSums;
use web_time::Instant;

/// Maximum shares of the time budget: for trials on both halves, and for a trial on one half. The
/// second is also the maximum for the filter itself if the image is noisier than [`NOISY`].
const TRIALS: (f64, f64) = (0.12, 0.15);

/// Expected error above which the filter may take a share of `TRIALS.1` instead of
/// [`MAX_SHARE_IF_QUIET`].
const NOISY: f64 = 0.04;

/// Maximum share of the time that the filter may cost a less noisy image, including the cost of AOV
/// sums until the decision.
const MAX_SHARE_IF_QUIET: f64 = 0.06;

/// Maximum squared error of the filtered image relative to the unfiltered one, for the filter to be
/// taken: the error is only an estimate.
const BETTER: f64 = 0.8;

/// Edges in pixels of the small images by which the time of a library is estimated.
const PROBES: [u32; 2] = [128, 256];

/// Number of pixels up to which a library is timed without an estimate.
const SMALL: u64 = 4 * 256 * 256;

/// Factor of an estimated time above a budget's share from which on a library is not timed.
const TOO_SLOW: f64 = 2.0;

/// Denoiser with its time on this device.
pub(super) struct Filter<'a> {
    denoise: &'a Denoiser,
    /// Time for an image of the settings' size, in seconds.
    seconds: f64,
    /// Number of halves on which the filter is tried: 0, 1 or 2.
    trials: u32,
}

/// Result of filtering an image.
pub struct Filtered {
    pub denoise: Denoiser,
    /// Expected root of the relMSE, from the trial; NaN without a trial.
    pub expected: f64,
    /// Device time, in seconds.
    pub seconds: f64,
}

/// Decision whether an image is filtered.
pub(super) struct Choice {
    /// True if the image is filtered in any case.
    always: bool,
    taken: bool,
    decided: bool,
    /// Expected relMSE at the end of the render, filtered; NaN before the trial.
    filtered: f64,
    /// Expected relMSE at the end of the render, unfiltered; NaN before the trial.
    plain: f64,
}

impl Choice {
    /// Returns the expected errors, or `None` if there was no trial.
    pub fn trial(&self) -> Option<FilterTrial> {
        let trial = FilterTrial { filtered: self.filtered.sqrt(), plain: self.plain.sqrt() };
        self.filtered.is_finite().then_some(trial)
    }

    /// Returns whether the decision is still open.
    pub fn is_open(&self) -> bool {
        !self.decided
    }

    /// Returns whether the image is to be filtered, or may be while the decision is open.
    pub fn may_filter(&self) -> bool {
        self.taken || !self.decided
    }

    /// Filters one half or both, and compares each result with the other, unfiltered half. `more`
    /// is the factor by which the samples still grow until the end; the variance falls by it.
    ///
    /// The two halves are independent. So the mean squared difference of a filtered half from the
    /// other half is the filtered half's squared error plus the other half's variance.
    pub fn decide(
        &mut self,
        filter: &Filter,
        renderer: &mut AdaptiveRenderer,
        more: f64,
    ) -> Result<(), Error> {
        if filter.trials == 0 {
            (self.decided, self.taken) = (true, self.always);
            return Ok(());
        }
        let mut images = Vec::new();
        for half in 0..filter.trials as usize {
            let halves = &renderer.halves;
            let fill = |sums: &mut [_], guides: &mut [_]| halves.sums(half, sums, guides);
            images.push(renderer.inner.denoise_sums(&fill, &renderer.settings, filter.denoise)?.0);
        }
        // `smooth` is the reference level of all relative errors: half from the filtered images,
        // which have little noise, and half from the samples. Without the samples, light that a
        // filtered half did not find would be divided by too small a level.
        let smooth = between(&images, &renderer.halves.image());
        let from_halves = renderer.variance_from_halves();
        let halves = &renderer.halves;
        let mean = |half: usize, pixel: usize| halves.pixels(half)[pixel].mean();
        let variance_of = |half: usize, pixel: usize, c: usize| {
            let totals = &halves.pixels(half)[pixel];
            match from_halves || totals.samples < 2 {
                true => 0.5 * (mean(0, pixel)[c] - mean(1, pixel)[c]).powi(2),
                false => totals.variance_of_mean()[c],
            }
        };
        let noise = [0, 1].map(|half| relative(&smooth, |pixel, c| variance_of(half, pixel, c).sqrt()));
        let difference = |image: &Image, half: usize| {
            relative(&smooth, |pixel, c| f64::from(image.pixels[pixel][c]) - mean(half, pixel)[c])
        };
        // The variance of the mean of both halves is a quarter of the sum of their variances.
        let raw = 0.25 * (noise[0] + noise[1]) / more;
        let errors: Vec<f64> = images
            .iter()
            .enumerate()
            .map(|(half, image)| (difference(image, 1 - half) - noise[1 - half]).max(0.0))
            .collect();
        let error = errors.iter().sum::<f64>() / errors.len() as f64;
        let variance = match &images[..] {
            [a, b] => 0.5 * relative(&smooth, |p, c| f64::from(a.pixels[p][c]) - f64::from(b.pixels[p][c])),
            _ => 0.0, // unknown from one half: the whole error counts as bias
        };
        // The bias of the filter stays. The variance of a filtered half (`variance`) halves in the
        // mean of both halves, and falls by `more` with further samples.
        self.filtered = (error - variance).max(0.0) + variance / (2.0 * more);
        self.plain = raw;
        self.taken = self.always || self.filtered < BETTER * raw;
        self.decided = true;
        Ok(())
    }
}

/// Returns the image halfway between the mean of `images` and `plain`.
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

/// Returns the mean over pixels and channels of value² / (weight² + 0.01); terms that are not
/// finite count as 0.
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
    /// Returns whether it is worth the time to measure a denoiser that is only an option: not if
    /// small images say that it takes far more than its share of a budget of `whole` seconds. So a
    /// library that is slow for a large image does not delay it.
    pub fn is_worth_a_trial(
        renderer: &mut Renderer,
        settings: &Settings,
        denoise: &Denoiser,
        whole: f64,
    ) -> Result<bool, Error> {
        if !matches!(denoise, Denoiser::Oidn) || settings.pixels() <= SMALL {
            return Ok(true);
        }
        let fill = |sums: &mut [PixelSums], guides: &mut [AovSums]| {
            sums.fill(PixelSums { samples: 2, ..PixelSums::ZERO });
            guides.fill(AovSums { misses: 2, ..AovSums::ZERO });
        };
        let mut seconds = |edge: u32| {
            let small = Settings { width: edge, height: edge, crop: None, ..settings.clone() };
            let start = Instant::now();
            renderer.denoise_sums(&fill, &small, denoise).map(|_| start.elapsed().as_secs_f64())
        };
        let [small, large] = PROBES;
        seconds(small)?; // loads the network
        let times = [seconds(small)?, seconds(large)?];
        let [small, large] = PROBES.map(|edge| f64::from(edge).powi(2));
        let of_pixel = (times[1] - times[0]).max(0.0) / (large - small);
        let expected = times[1] + of_pixel * (settings.pixels() as f64 - large);
        Ok(expected <= TOO_SLOW * TRIALS.1 * whole)
    }

    /// Compiles the filter, and measures it on empty halves with AOV sums.
    pub fn try_out(
        renderer: &mut Renderer,
        settings: &Settings,
        denoise: &'a Denoiser,
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

    /// Returns whether the filter may fit a budget of `whole` seconds, before the noise is known. A
    /// filter that was requested (not `free`) always fits.
    pub fn may_fit(&self, whole: f64, free: bool) -> bool {
        !free || self.seconds <= TRIALS.1 * whole
    }

    /// Returns whether the filter fits a budget of `whole` seconds. A filter that was requested
    /// (not `free`) always fits. `expected` is the expected error without it, `slower` the share of
    /// AOV sums in the time of a sample.
    pub fn fits(&self, whole: f64, free: bool, expected: f64, slower: f64) -> bool {
        let share = self.seconds / whole;
        // AOV sums are needed until the decision, after about half of the time.
        let fits =
            if expected > NOISY { share <= TRIALS.1 } else { share + 0.5 * slower <= MAX_SHARE_IF_QUIET };
        !free || fits
    }

    /// Returns the seconds to reserve for the filter, including its trials if they are still to
    /// come.
    pub fn reserve(&self, choice: &Choice) -> f64 {
        let trials = if choice.decided { 0 } else { self.trials };
        if choice.may_filter() { self.seconds * f64::from(1 + trials) } else { 0.0 }
    }

    /// Returns an open decision.
    pub fn choice(free: bool) -> Choice {
        Choice { always: !free, taken: !free, decided: false, filtered: f64::NAN, plain: f64::NAN }
    }

    /// Sets on how many halves the filter is tried, as the time allows.
    pub fn with_trials(mut self, whole: f64) -> Self {
        self.trials = match () {
            () if 2.0 * self.seconds <= TRIALS.0 * whole => 2,
            () if self.seconds <= TRIALS.1 * whole => 1,
            () => 0,
        };
        self
    }

    /// Filters the image, if that was decided.
    pub fn finish(
        self,
        renderer: &mut AdaptiveRenderer,
        choice: &Choice,
    ) -> Result<Option<(Image, Filtered)>, Error> {
        if !choice.taken {
            return Ok(None);
        }
        let halves = &renderer.halves;
        let fill = |sums: &mut [_], guides: &mut [_]| halves.all_sums(sums, guides);
        let (image, passes) = renderer.inner.denoise_sums(&fill, &renderer.settings, self.denoise)?;
        let seconds = passes.iter().map(std::time::Duration::as_secs_f64).sum();
        let filtered = Filtered { denoise: *self.denoise, expected: choice.filtered.sqrt(), seconds };
        Ok(Some((image, filtered)))
    }
}
