//! Measures each configuration with each number of samples and several seeds.

use super::command::RenderCommand;
use super::configuration::Configuration;
use super::flips::flips;
use super::front;
use super::lab::{FIRST_SEED, ImageTiming, Lab};
use super::picture::Pictures;
use super::point::{FORMAT, Missing, Point, Seconds, Tradeoff, VsBase};
use super::recommend::recommend;
use super::reference::Reference;
use super::supervisor::{Reserving, Supervisor, check, was_stopped};
use super::{Stop, TradeoffError, check_seeds};
use crate::Error;
use crate::accuracy::{Errors, Truth};
use crate::bench::Summary;
use crate::statistics;
use std::time::Instant;
use trisect::image::Image;
use trisect::render::SettingsError;

/// Minimum samples per pixel for adaptive sampling: with fewer, none are distributed by noise.
const MIN_ADAPTIVE: u32 = 8;

/// Configurations measured between two measurements of the base's time.
const CONFIGURATIONS_PER_EPOCH: usize = 3;

/// Configurations, numbers of samples and repetitions to measure.
#[derive(Clone, Debug)]
pub struct Sweep<'a> {
    /// Configurations to measure, the base first.
    pub configurations: &'a [Configuration],
    /// Numbers of samples per pixel, ascending.
    pub levels: &'a [u32],
    /// Repetitions (seeds) of each point.
    pub seeds: usize,
    /// Repetitions for which FLIP is computed.
    pub flips: usize,
    /// Command that renders the base.
    pub command: &'a RenderCommand,
    /// Edges of the image of that command over those of the configurations' images.
    pub reduction: u32,
}

/// Measured point with what its picture is made of.
struct MeasuredPoint {
    point: Point,
    /// Image of the first seed.
    image: Image,
    /// FLIP errors of that image, by pixel.
    flip: Vec<f32>,
}

/// Results of a sweep so far.
struct SweepResult {
    /// Points, each with the index of its configuration.
    points: Vec<(usize, Point)>,
    /// Reason why each configuration cannot be rendered here; `None` if it can.
    absent: Vec<Option<String>>,
    /// Logarithms of the base's median time at several moments, by level.
    epochs: Vec<Vec<f64>>,
    pictures: Pictures,
}

impl Lab<'_> {
    /// Measures every configuration at the first level, then at the next, until all are measured or
    /// the supervisor ends it. What was not measured by then is listed in [`Tradeoff::missing`];
    /// without a reference, that is everything. Reports each point to the supervisor.
    ///
    /// # Errors
    ///
    /// Errors of rendering, and [`TradeoffError`].
    pub fn measure(
        &mut self,
        sweep: &Sweep,
        reference: Option<&Reference>,
        supervisor: &mut dyn Supervisor,
    ) -> Result<(Tradeoff, Pictures), Error> {
        check_seeds(sweep.seeds)?;
        let [base, ..] = sweep.configurations else {
            return Err(
                TradeoffError::TooFew { what: "the number of configurations", given: 0, least: 1 }.into()
            );
        };
        let start = Instant::now();
        let supervisor = &mut Reserving::new(supervisor);
        let device = self.renderer(base)?.device().info().clone();
        let mut found = SweepResult {
            points: Vec::new(),
            absent: vec![None; sweep.configurations.len()],
            epochs: Vec::new(),
            pictures: Pictures::default(),
        };
        let ended = match reference {
            Some(reference) => {
                let swept = self.sweep(sweep, reference, &mut found, supervisor);
                was_stopped(swept, supervisor)?.is_none()
            }
            None => true,
        };
        let SweepResult { mut points, absent, epochs, pictures } = found;
        let lacks = |index: usize| absent[index].is_none() && !lacking(sweep, &points, index).is_empty();
        let ended = supervisor.stop().filter(|_| ended && (0..sweep.configurations.len()).any(lacks));
        let missing = missing(sweep, &points, &absent, ended);
        points.sort_by_key(|(mode, point)| (*mode, point.spp));
        let mut points: Vec<Point> = points.into_iter().map(|(_, point)| point).collect();
        let drift = epochs.iter().rev().find(|epochs| epochs.len() > 1);
        let drift = drift.map_or(0.0, |epochs| epochs_deviation(epochs));
        let of_base: Vec<Point> = points.iter().filter(|point| point.knob == "base").cloned().collect();
        for point in points.iter_mut().filter(|point| point.knob != "base") {
            let base = of_base.iter().find(|base| base.spp == point.spp);
            point.against = base.map(|base| VsBase::of(point, base, drift));
        }
        front::mark(&mut points);
        let found = Tradeoff {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: self.scene.name.clone(),
            device: format!("{}: {} ({})", device.backend, device.name, device.details),
            width: base.settings.width,
            height: base.settings.height,
            reduction: sweep.reduction,
            depth: base.settings.depth,
            reference: reference.map(|reference| reference.facts.clone()),
            seeds: sweep.seeds,
            drift,
            slopes: front::slopes(&points),
            recommended: recommend(&points),
            points,
            others: Vec::new(),
            missing,
            ended,
            seconds: start.elapsed().as_secs_f64(),
        };
        Ok((found, pictures))
    }

    /// Measures all points. Returns [`Error::Cancelled`] if the supervisor ends it.
    fn sweep(
        &mut self,
        sweep: &Sweep,
        reference: &Reference,
        found: &mut SweepResult,
        supervisor: &mut Reserving,
    ) -> Result<(), Error> {
        check(supervisor)?;
        let image = reference.image();
        let start = Instant::now();
        let truth = reference.truth(&image)?;
        // FLIP prepares one of two images here.
        supervisor.note(2 * start.elapsed());
        found.pictures = Pictures::new(&truth);
        let base = &sweep.configurations[0];
        let all = sweep.configurations.len() * sweep.levels.len();
        for (level, &spp) in sweep.levels.iter().enumerate() {
            found.epochs.push(Vec::new());
            for (index, mode) in sweep.configurations.iter().enumerate() {
                if found.absent[index].is_some() || is_too_few(mode, spp) {
                    continue;
                }
                check(supervisor)?;
                let stage = format!("{}, {spp} samples a pixel", mode.name());
                supervisor.begin(level * sweep.configurations.len() + index, all, &stage);
                // Compiles what this configuration needs, so that compiling is not measured.
                match self.image(mode, 1, FIRST_SEED - 1, supervisor) {
                    Ok((_, took)) => supervisor.note(took.after_rendering()),
                    Err(error) if is_missing(&error) => {
                        supervisor.report(&format!("{}: not available here: {error}", mode.name()));
                        found.absent[index] = Some(error.to_string());
                        continue;
                    }
                    Err(error) => return Err(error),
                }
                let measured = self.point(mode, spp, sweep, &truth, supervisor)?;
                let MeasuredPoint { mut point, image, flip } = measured;
                point.exact = mode.is_exact(base, !self.scene.lights.is_empty());
                point.command = sweep.command.line(base, mode, spp);
                supervisor.report(&point.line());
                found.pictures.add(&point, &image, &flip, &truth);
                found.points.push((index, point));
                let as_built = (mode.quality, mode.nearest) == (base.quality, base.nearest);
                if as_built && index % CONFIGURATIONS_PER_EPOCH == 0 {
                    let epoch = self.base_again(base, spp, supervisor)?;
                    found.epochs[level].push(epoch);
                }
            }
        }
        Ok(())
    }

    /// Returns the logarithm of the base's median time at this moment.
    fn base_again(
        &mut self,
        base: &Configuration,
        spp: u32,
        supervisor: &mut dyn Supervisor,
    ) -> Result<f64, Error> {
        let mut times = Vec::new();
        for _ in 0..3 {
            times.push(self.image(base, spp, FIRST_SEED, supervisor)?.1.all());
        }
        Ok(Summary::of(&times).map_or(f64::NAN, |summary| summary.median.ln()))
    }

    /// Measures a configuration with a number of samples.
    fn point(
        &mut self,
        mode: &Configuration,
        spp: u32,
        sweep: &Sweep,
        truth: &Truth,
        supervisor: &mut Reserving,
    ) -> Result<MeasuredPoint, Error> {
        let (mut images, mut took) = (Vec::new(), Vec::new());
        for index in 0..sweep.seeds as u32 {
            let (image, times) = self.image(mode, spp, FIRST_SEED + index, supervisor)?;
            supervisor.note(times.after_rendering());
            images.push(image);
            took.push(times);
        }
        let start = Instant::now();
        let (flips, flip) = flips(&images, truth, sweep.flips, supervisor)?;
        supervisor.note(start.elapsed() / flips.len().max(1) as u32);
        check(supervisor)?;
        let start = Instant::now();
        let errors = Errors::of(&images, truth, &flips)?;
        supervisor.note(start.elapsed());
        let each: Vec<f64> = took.iter().map(ImageTiming::all).collect();
        let all = Summary::of(&each).unwrap_or(Summary::NOTHING);
        let median = |of: fn(&ImageTiming) -> f64| {
            Summary::of(&took.iter().map(of).collect::<Vec<_>>()).map_or(f64::NAN, |summary| summary.median)
        };
        let seconds = Seconds {
            render: median(|took| took.render),
            denoise: median(|took| took.denoise),
            scale: median(|took| took.scale),
            all,
            each,
        };
        let efficiency = errors.efficiency(seconds.all.median);
        let (knob, level) = (mode.knob.to_owned(), mode.level.clone());
        let (exact, against, on_front, command) = (false, None, false, None);
        let point =
            Point { knob, level, exact, spp, seconds, errors, efficiency, against, on_front, command };
        Ok(MeasuredPoint { point, image: images.swap_remove(0), flip })
    }
}

/// Returns what was not measured, and why, in the order of the configurations.
fn missing(
    sweep: &Sweep,
    points: &[(usize, Point)],
    absent: &[Option<String>],
    ended: Option<Stop>,
) -> Vec<Missing> {
    let mut all = Vec::new();
    for (index, mode) in sweep.configurations.iter().enumerate() {
        let mut add = |reason| all.push(Missing::new(mode, reason));
        if let Some(reason) = &absent[index] {
            add(reason.clone());
            continue;
        }
        // The two halves need two samples each to tell where noise is; adaptive sampling
        // distributes the samples after those.
        for &spp in sweep.levels.iter().filter(|&&spp| is_too_few(mode, spp)) {
            let needs = format!("adaptive sampling needs at least {MIN_ADAPTIVE}");
            add(format!("{spp} samples a pixel; {needs}"));
        }
        let levels: Vec<String> = lacking(sweep, points, index).iter().map(u32::to_string).collect();
        if !levels.is_empty() {
            let cause = ended.map_or("there is no reference".to_owned(), Stop::reason);
            add(format!("{} samples a pixel; {cause}", levels.join(", ")));
        }
    }
    all
}

/// Returns the numbers of samples that a configuration should have been measured with but was not.
fn lacking(sweep: &Sweep, points: &[(usize, Point)], index: usize) -> Vec<u32> {
    let is_there = |spp| points.iter().any(|(of, point)| *of == index && point.spp == spp);
    let levels = sweep.levels.iter().copied();
    levels.filter(|&spp| !is_too_few(&sweep.configurations[index], spp) && !is_there(spp)).collect()
}

/// Returns whether a configuration has no meaning with so few samples.
fn is_too_few(mode: &Configuration, spp: u32) -> bool {
    mode.adaptive && spp < MIN_ADAPTIVE
}

/// Returns the standard deviation of values measured at several moments; 0 for fewer than two.
fn epochs_deviation(logs: &[f64]) -> f64 {
    match statistics::mean_and_error(logs) {
        (_, error) if error.is_finite() => error * (logs.len() as f64).sqrt(),
        _ => 0.0,
    }
}

/// Returns whether the error means that this configuration is not available here, while others may
/// be.
pub(super) fn is_missing(error: &Error) -> bool {
    match error {
        Error::Render(trisect::Error::Settings(error)) => {
            matches!(error, SettingsError::NoWideTree | SettingsError::FeaturesLack { .. })
        }
        Error::Render(trisect::Error::Backend(error)) => error.is_unsupported(),
        _ => false,
    }
}

#[cfg(test)]
mod tests;
