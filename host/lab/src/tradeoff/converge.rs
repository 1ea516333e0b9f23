//! Measures errors over a growing number of samples: noise falls with the root of the samples, a
//! bias stays. Used by `trisect converge`.

use super::error_curve::{Capture, Convergence, ErrorCurve, MIN_CAPTURES, Pair};
use super::flips::flips;
use super::measure::is_missing;
use super::point::Missing;
use super::supervisor::{Cancelling, Share, Supervisor, check, was_stopped};
use super::{Configuration, Lab, Reference, Stop, TradeoffError, check_seeds};
use crate::Error;
use crate::accuracy::{Errors, Means, SIGNIFICANCE, Truth, difference};
use std::time::Duration;
use trisect::film::{Film, SampleBlock};
use trisect::render::{Settings, chunks};

/// Version of the JSON format. It is raised when a field changes its meaning or is removed.
const FORMAT: u32 = 1;

/// Repetitions for which FLIP is computed.
const FLIPS: usize = 2;

/// First seed; the others follow it.
const FIRST_SEED: u32 = 2000;

/// Configurations, numbers of samples and repetitions to measure.
#[derive(Clone, Debug)]
pub struct ConvergencePlan<'a> {
    /// Configurations to measure, the base first.
    pub configurations: &'a [Configuration],
    /// First number of samples per pixel.
    pub first: u32,
    /// Maximum number of samples per pixel.
    pub last: u32,
    /// Repetitions (seeds) of each configuration.
    pub seeds: usize,
}

impl ConvergencePlan<'_> {
    /// Returns the numbers of samples per pixel at which errors are measured.
    ///
    /// # Errors
    ///
    /// [`TradeoffError::TooFew`] for too few seeds, or too few numbers of samples for a slope.
    pub fn counts(&self) -> Result<Vec<u32>, TradeoffError> {
        check_seeds(self.seeds)?;
        let doubled = std::iter::successors(Some(self.first), |count| count.checked_mul(2));
        let counts: Vec<u32> = doubled.take_while(|&count| count <= self.last).collect();
        if counts.len() < MIN_CAPTURES {
            let (what, given) =
                ("the number of doublings from `first` to `last`", counts.len().saturating_sub(1));
            return Err(TradeoffError::TooFew { what, given, least: MIN_CAPTURES - 1 });
        }
        Ok(counts)
    }
}

impl Lab<'_> {
    /// Measures the errors of each configuration from the first number of samples per pixel to the
    /// last, doubling each time. Each configuration gets an equal share of the time that is left,
    /// and ends where the next doubling would exceed it. What the supervisor left no time for is
    /// listed in [`Convergence::missing`]; without a reference, that is everything. Configurations
    /// that scale the image, or distribute samples by noise, have no error curve.
    ///
    /// # Errors
    ///
    /// Errors of rendering, and of [`ConvergencePlan::counts`].
    pub fn converge(
        &mut self,
        all: &ConvergencePlan,
        reference: Option<&Reference>,
        supervisor: &mut dyn Supervisor,
    ) -> Result<Convergence, Error> {
        let counts = all.counts()?;
        let mut found = Convergence {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: self.scene.name.clone(),
            reference: reference.map(|reference| reference.facts.clone()),
            seeds: all.seeds,
            courses: Vec::new(),
            pairs: Vec::new(),
            missing: Vec::new(),
            ended: None,
        };
        let mut ends: Vec<Means> = Vec::new();
        let image = reference.filter(|_| supervisor.stop().is_none()).map(Reference::image);
        let truth = reference.zip(image.as_ref()).map(|(of, image)| of.truth(image)).transpose()?;
        let (modes, others): (Vec<&Configuration>, Vec<&Configuration>) =
            all.configurations.iter().partition(|mode| mode.divisor == 1 && !mode.adaptive);
        let no_course = || "it has no error curve: its image does not grow sample by sample".to_owned();
        found.missing.extend(others.into_iter().map(|mode| Missing::new(mode, no_course())));
        for (index, &mode) in modes.iter().enumerate() {
            let mut run = Run { captures: Vec::new(), means: None, cut: None };
            if let Some(truth) = &truth {
                let place = (index, modes.len());
                let followed = self.follow(mode, (&counts, all.seeds), place, truth, &mut run, supervisor);
                match followed {
                    Err(error) if is_missing(&error) && index > 0 => {
                        supervisor.report(&format!("{}: not available here: {error}", mode.name()));
                        found.missing.push(Missing::new(mode, error.to_string()));
                        continue;
                    }
                    followed => was_stopped(followed, supervisor)?,
                };
            }
            let Run { captures, means, cut } = run;
            let left: Vec<String> = counts[captures.len()..].iter().map(u32::to_string).collect();
            if !left.is_empty() {
                let stop = cut.or_else(|| supervisor.stop());
                found.ended = supervisor.stop().or(found.ended).or(stop);
                let cause = stop.map_or("there is no reference".to_owned(), Stop::reason);
                let reason = format!("{} samples a pixel; {cause}", left.join(", "));
                found.missing.push(Missing::new(mode, reason));
            }
            if let Some(means) = means {
                let course = ErrorCurve::of(mode.name(), captures);
                supervisor.report(&course.line());
                found.courses.push(course);
                ends.push(means);
            }
        }
        for a in 0..ends.len() {
            for b in a + 1..ends.len() {
                let (brightness, p) = difference(&ends[a], &ends[b]);
                let differ = p < SIGNIFICANCE;
                let modes = [found.courses[a].mode.clone(), found.courses[b].mode.clone()];
                found.pairs.push(Pair { modes, brightness, p, differ });
            }
        }
        Ok(found)
    }

    /// Renders further samples into the film of each seed, and measures the errors at each count.
    /// Returns [`Error::Cancelled`] if the supervisor ends it.
    fn follow(
        &mut self,
        mode: &Configuration,
        (counts, seeds): (&[u32], usize),
        (index, modes): (usize, usize),
        truth: &Truth,
        run: &mut Run,
        supervisor: &mut dyn Supervisor,
    ) -> Result<(), Error> {
        check(supervisor)?;
        let share = Share::new(supervisor, modes - index);
        let of_seed = |index: usize| Settings {
            samples: counts.last().copied().unwrap_or(1),
            seed: FIRST_SEED + index as u32,
            guides: mode.denoise.is_some(),
            ..mode.settings.clone()
        };
        let (width, height) = (mode.settings.width, mode.settings.height);
        let new = if mode.denoise.is_some() { Film::with_aovs } else { Film::new };
        let mut films: Vec<Film> = (0..seeds).map(|_| new(width, height)).collect();
        let mut before = 0;
        // Time per sample of each pixel, in the doubling before.
        let mut pace = None;
        for &count in counts {
            let next = pace.map_or(Duration::ZERO, |pace: Duration| pace.saturating_mul(count - before));
            if !share.has_room_for(next, supervisor) {
                run.cut = Some(Stop::OutOfTime);
                return Ok(());
            }
            let spent = share.spent(supervisor);
            let stage = format!("{}, {count} samples a pixel", mode.name());
            supervisor.begin(index, modes, &stage);
            let mut images = Vec::new();
            for (index, film) in films.iter_mut().enumerate() {
                let settings = of_seed(index);
                let renderer = self.renderer(mode)?;
                for samples in chunks(before..count) {
                    check(supervisor)?;
                    let part = SampleBlock { rows: 0..height, samples: samples.clone() };
                    let rows = (0..height).into();
                    let mut observer = Cancelling(&mut *supervisor);
                    let sums = renderer.render_chunk(&settings, &rows, samples, &mut observer)?;
                    film.merge(&part, sums.pixels)?;
                    if settings.guides {
                        film.merge_aovs(&part, sums.aovs)?;
                    }
                }
                check(supervisor)?;
                images.push(match &mode.denoise {
                    Some(denoise) => renderer.denoise(film, &settings, denoise)?.0,
                    None => film.image(),
                });
            }
            let (flips, _) = flips(&images, truth, FLIPS, supervisor)?;
            run.captures.push(Capture { spp: count, errors: Errors::of(&images, truth, &flips)? });
            run.means = Some(Means::of(&images));
            pace = Some(share.spent(supervisor).saturating_sub(spent) / (count - before).max(1));
            before = count;
        }
        Ok(())
    }
}

/// Measurements of one configuration so far.
struct Run {
    captures: Vec<Capture>,
    /// Means of the images of the last capture.
    means: Option<Means>,
    /// Reason why the configuration ended before the last count although the supervisor did not
    /// stop it.
    cut: Option<Stop>,
}

#[cfg(test)]
mod tests;
