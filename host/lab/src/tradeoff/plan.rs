//! Plans of a whole measurement: chooses numbers of samples, repetitions of FLIP and the time of
//! the reference, and measures. The program and other users of the library call the same plans.

use super::configuration::{Configuration, KNOBS, configurations};
use super::converge::ConvergencePlan;
use super::error_curve::Convergence;
use super::fit::{Cost, Fit, REFERENCE_SHARE, fit};
use super::measure::Sweep;
use super::others::OtherRenderer;
use super::picture::Pictures;
use super::point::{Missing, Tradeoff};
use super::reference::{Reference, ReferenceInfo};
use super::supervisor::Supervisor;
use super::{Lab, RenderCommand, Stop, TradeoffError, check_seeds};
use crate::Error;
use crate::accuracy::flips_of;
use crate::error::EvaluateError;
use crate::evaluate::ImageFolder;
use std::path::Path;
use trisect::adaptive::Goal;
use trisect::device::Device;
use trisect::scene::Scene;

/// Error target that no reference reaches, so that all its samples are rendered.
const UNREACHABLE_ERROR: f64 = 1e-9;

/// Number of samples of the reference of a convergence measurement, as a multiple of its last
/// number of samples.
const CONVERGENCE_REFERENCE: u32 = 8;

/// Share of the time that the reference of a convergence measurement gets. It has few samples
/// compared with those of all error curves together.
const CONVERGENCE_REFERENCE_SHARE: f64 = 0.2;

/// Nanoseconds per pixel of an image on one thread: of the statistics, and of FLIP.
const NANOSECONDS: (f64, f64) = (300.0, 2000.0);

/// Source of the reference that errors are measured against.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceSource<'a> {
    /// Folder that keeps references; see [`cache_folder`](super::cache_folder).
    pub folder: &'a Path,
    /// Maximum mean samples per pixel; `None` for as many as the measurement chooses.
    pub max_spp: Option<u32>,
}

/// Plan of a trade-off measurement.
#[derive(Clone, Debug)]
pub struct TradeoffPlan<'a> {
    /// Configurations to measure, the base first; see [`configurations_of`].
    pub configurations: Vec<Configuration>,
    /// Repetitions (seeds) of each point.
    pub seeds: usize,
    /// Numbers of samples per pixel; empty for three levels up to
    /// `max_spp`, or as many as fit the supervisor's time.
    pub levels: &'a [u32],
    /// Maximum of three levels; `None` for as many as fit the time. Ignored if there are
    /// `levels`.
    pub max_spp: Option<u32>,
    /// True if images may be smaller than the configurations' size where the time is too short.
    pub may_reduce: bool,
    /// Reference that errors are measured against.
    pub reference: ReferenceSource<'a>,
    /// Command that renders the base, without its number of samples.
    pub command: RenderCommand,
    /// Images of other renderers that are measured against the same reference, in the size of the
    /// configurations.
    pub others: Option<&'a ImageFolder>,
}

/// Returns the base and its variations by the named knobs, or by all [`KNOBS`] without a name. Fast
/// math is among them if `device` has it.
///
/// # Errors
///
/// [`TradeoffError::NoKnob`] for an unknown name.
pub fn configurations_of(
    scene: &Scene,
    base: &Configuration,
    knobs: &[String],
    device: &dyn Device,
) -> Result<Vec<Configuration>, TradeoffError> {
    let all: Vec<String> = KNOBS.iter().map(|&knob| knob.to_owned()).collect();
    let is_fast = device.info().backend != "cpu";
    configurations(scene, base, if knobs.is_empty() { &all } else { knobs }, is_fast)
}

impl TradeoffPlan<'_> {
    /// Measures the scene on a device within the supervisor's time.
    ///
    /// # Errors
    ///
    /// Errors of rendering, [`TradeoffError`], and [`EvaluateError`] for the
    /// images of other renderers.
    pub fn run(
        mut self,
        scene: &Scene,
        device: Box<dyn Device>,
        supervisor: &mut dyn Supervisor,
    ) -> Result<(Tradeoff, Pictures), Error> {
        check_seeds(self.seeds)?;
        let [base, ..] = &self.configurations[..] else { return Err(no_configuration().into()) };
        if let Some(others) = self.others {
            others.check(base.settings.width, base.settings.height)?;
        }
        let mut lab = Lab::new(scene, device);
        let (each, fixed) = lab.pace(base, supervisor)?;
        let Fit { levels, seeds, reference, reduction } = self.fit(base, (each, fixed), supervisor);
        if reduction > 1 {
            self.reduce(reduction, supervisor);
        }
        let levels = self.levels(levels);
        let goal = match self.reference.max_spp {
            Some(max_samples) => Goal::Error { target: UNREACHABLE_ERROR, max_samples },
            None => Goal::Time(reference),
        };
        let configurations = &self.configurations;
        supervisor.report(&format!(
            "{} configurations, {levels:?} samples per pixel, {seeds} seeds",
            configurations.len()
        ));
        let base = &configurations[0];
        let flips = flips_of(base.settings.pixels(), seeds);
        let goal = (goal, REFERENCE_SHARE);
        let reference = lab.reference(base, goal, self.reference.folder, supervisor)?;
        report_reference(reference.as_ref(), supervisor);
        let command = &self.command;
        let sweep = Sweep { configurations, levels: &levels, seeds, flips, command, reduction };
        let (mut found, pictures) = lab.measure(&sweep, reference.as_ref(), supervisor)?;
        if let (Some(others), Some(reference)) = (self.others, &reference) {
            measure_others(others, reference, &mut found, supervisor)?;
        }
        Ok((found, pictures))
    }

    /// Chooses what fits the supervisor's time, given the base's seconds per sample of each pixel
    /// and the fixed seconds of an image.
    fn fit(&self, base: &Configuration, (each, fixed): (f64, f64), supervisor: &dyn Supervisor) -> Fit {
        let left = supervisor.time_left().unwrap_or_default();
        let pixels = base.settings.pixels();
        let (configurations, seeds) = (self.configurations.len(), self.seeds);
        let analysis = pixels as f64 * analysis_seconds(flips_of(pixels, seeds), seeds);
        let may_reduce = self.may_reduce && self.others.is_none();
        let edge = may_reduce.then_some(base.settings.width.min(base.settings.height));
        fit(left, Cost { configurations, seeds, each, fixed, analysis }, edge)
    }

    /// Reduces the images of all configurations.
    fn reduce(&mut self, reduction: u32, supervisor: &mut dyn Supervisor) {
        let base = &self.configurations[0].settings;
        let (width, height) = (base.width.div_ceil(reduction), base.height.div_ceil(reduction));
        for configuration in &mut self.configurations {
            (configuration.settings.width, configuration.settings.height) = (width, height);
        }
        supervisor.report(&format!(
            "measuring at {width}x{height}, 1/{reduction} of the size, to fit the time; `resolution` names another"
        ));
    }

    /// Returns the numbers of samples per pixel, ascending; `fitting` are those that fit the time.
    fn levels(&self, fitting: Vec<u32>) -> Vec<u32> {
        let mut levels = match (self.levels, self.max_spp) {
            ([], None) => fitting,
            ([], Some(most)) => vec![most.div_ceil(16), most.div_ceil(4), most],
            (given, _) => given.to_vec(),
        };
        levels.sort_unstable();
        levels.dedup();
        levels
    }
}

impl ConvergencePlan<'_> {
    /// Measures the scene on a device within the supervisor's time. The reference has as many
    /// samples as `source` allows, by default eight times those of the last point.
    ///
    /// # Errors
    ///
    /// Errors of rendering, and of [`counts`](Self::counts).
    pub fn run(
        &self,
        scene: &Scene,
        device: Box<dyn Device>,
        source: ReferenceSource,
        supervisor: &mut dyn Supervisor,
    ) -> Result<Convergence, Error> {
        self.counts()?;
        let [base, ..] = self.configurations else { return Err(no_configuration().into()) };
        let mut lab = Lab::new(scene, device);
        let max_samples = source.max_spp.unwrap_or(self.last.saturating_mul(CONVERGENCE_REFERENCE));
        let goal = Goal::Error { target: UNREACHABLE_ERROR, max_samples };
        let goal = (goal, CONVERGENCE_REFERENCE_SHARE);
        let reference = lab.reference(base, goal, source.folder, supervisor)?;
        report_reference(reference.as_ref(), supervisor);
        lab.converge(self, reference.as_ref(), supervisor)
    }
}

fn no_configuration() -> TradeoffError {
    TradeoffError::TooFew { what: "the number of configurations", given: 0, least: 1 }
}

/// Measures images of other renderers, and reports each to the supervisor. Images that cannot be
/// read any more, and all after an interrupt, are listed as missing.
fn measure_others(
    others: &ImageFolder,
    reference: &Reference,
    found: &mut Tradeoff,
    supervisor: &mut dyn Supervisor,
) -> Result<(), Error> {
    let of_base = found.points.iter().filter(|point| point.knob == "base").max_by_key(|point| point.spp);
    let of_base = of_base.map(|base| (base.errors.variance, base.seconds.all.median));
    let image = reference.image();
    let truth = reference.truth(&image).map_err(EvaluateError::from)?;
    let missing = |name: &str, reason| Missing { knob: "against".to_owned(), level: name.to_owned(), reason };
    if let Some(stop) = found.ended.filter(|stop| *stop == Stop::Interrupted) {
        found.missing.push(missing("images", stop.reason()));
        return Ok(());
    }
    for (name, row) in others.rows(&truth) {
        match row {
            Err(error) => found.missing.push(missing(name, error.to_string())),
            Ok(row) => {
                let other = OtherRenderer::of(row, of_base);
                supervisor.report(&other.line());
                found.others.push(other);
            }
        }
    }
    Ok(())
}

/// Returns the seconds per pixel that an image takes besides rendering, on all threads.
fn analysis_seconds(flips: usize, seeds: usize) -> f64 {
    let threads = std::thread::available_parallelism().map_or(1.0, |threads| threads.get() as f64);
    let share = flips as f64 / seeds.max(1) as f64;
    (NANOSECONDS.0 + NANOSECONDS.1 * share) * 1e-9 / threads
}

/// Reports the reference's number of samples and its own error.
fn report_reference(reference: Option<&Reference>, supervisor: &mut dyn Supervisor) {
    if let Some(ReferenceInfo { samples, error, .. }) = reference.map(|reference| &reference.facts) {
        let error = 100.0 * error;
        supervisor.report(&format!("reference: {samples:.0} samples a pixel, own error {error:.3} %"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect::render::Settings;

    #[test]
    fn levels_are_given_or_chosen() {
        let settings = Settings::of(&Scene::hello_world().unwrap());
        let plan = |levels, max_spp| TradeoffPlan {
            configurations: vec![Configuration::base(&settings, None)],
            seeds: 4,
            levels,
            max_spp,
            may_reduce: false,
            reference: ReferenceSource { folder: Path::new("unused"), max_spp: None },
            command: RenderCommand::default(),
            others: None,
        };
        let fitting = vec![4, 16, 64];
        assert_eq!(plan(&[], None).levels(fitting.clone()), [4, 16, 64]);
        assert_eq!(plan(&[], Some(100)).levels(fitting.clone()), [7, 25, 100]);
        assert_eq!(plan(&[], Some(1)).levels(fitting.clone()), [1]);
        assert_eq!(plan(&[8, 2, 8], Some(100)).levels(fitting), [2, 8]);
    }
}
