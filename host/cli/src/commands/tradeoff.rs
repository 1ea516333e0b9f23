//! `trisect tradeoff` measures what options cost and gain; `trisect converge` measures how errors
//! fall with the number of samples.

use super::data::{print_result, probe};
use super::lab::{LabSupervisor, exit_code};
use super::{Loaded, eprint, given_options, open};
use crate::cli::{ConvergeArgs, JobArgs, ReferenceArgs, TradeoffArgs};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trisect::adaptive::Goal;
use trisect::image::ImageError;
use trisect::output;
use trisect::output::Outputs;
use trisect::scene::Scene;
use trisect_lab::Error;
use trisect_lab::tradeoff::{
    Configuration, Convergence, ConvergencePlan, Cost, Fit, KNOBS, Lab, REFERENCE_SHARE, Reference,
    ReferenceInfo, RenderCommand, Supervisor, Sweep, TradeoffError, check_seeds, configurations, fit,
    is_output,
};

/// Error target that no reference reaches, so that all its samples are rendered.
const UNREACHABLE_ERROR: f64 = 1e-9;

/// Number of samples of the reference of `converge`, as a multiple of `--last`.
const REFERENCE_OF_COURSE: u32 = 8;

/// Share of the time that the reference of `converge` gets. It has few samples compared with those
/// of all error curves together.
const REFERENCE_SHARE_OF_COURSE: f64 = 0.2;

/// Number of pixels above which FLIP is computed for fewer repetitions.
const LARGE: u64 = 200_000;

/// Nanoseconds per pixel of an image on one thread: of the statistics, and of FLIP.
const NANOSECONDS: (f64, f64) = (300.0, 2000.0);

/// Scene, base configuration and backend of a measurement.
struct LabSetup {
    scene: Scene,
    base: Configuration,
    fast: bool,
    backend: Box<dyn trisect::device::Device>,
}

impl LabSetup {
    fn new(job: &JobArgs, outputs: &Outputs) -> Result<Self, Error> {
        let loaded = Loaded::read(job, outputs)?;
        loaded.warn(job)?;
        let selection = open(job.backend, job.device, job.threads)?;
        let fast = selection.device.info().backend != "cpu";
        let base = Configuration::base(&loaded.settings, job.bvh_quality);
        Ok(Self { scene: loaded.scene, base, fast, backend: selection.device })
    }

    fn configurations(&self, knobs: &[String]) -> Result<Vec<Configuration>, TradeoffError> {
        let all: Vec<String> = KNOBS.iter().map(|&knob| knob.to_owned()).collect();
        configurations(&self.scene, &self.base, if knobs.is_empty() { &all } else { knobs }, self.fast)
    }
}

/// Returns the user's cache folder by the XDG base directory specification; `None` without `HOME`.
pub fn user_cache() -> Option<PathBuf> {
    let home = || std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache"));
    std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).or_else(home)
}

/// Returns the folder of references. There is no default that other users could write to, because
/// their references would be trusted.
fn cache(arguments: &ReferenceArgs) -> Result<PathBuf, TradeoffError> {
    let user = || user_cache().map(|cache| cache.join("trisect/references"));
    arguments.cache.clone().or_else(user).ok_or(TradeoffError::NoCache)
}

/// Measures the base settings and each configuration of the chosen options (knobs), and writes a
/// report of what was measured within the time limit.
pub fn run(arguments: &TradeoffArgs) -> Result<ExitCode, Error> {
    super::refuse_ranks_that_measure()?;
    check_seeds(arguments.seeds)?;
    let cache = cache(&arguments.reference)?;
    let outputs = Outputs::default()
        .folder("-o", Some(&arguments.output), is_output)
        .file("--json", arguments.json.json.as_deref());
    outputs.check()?;
    arguments.json.json.as_deref().map_or(Ok(()), probe)?;
    let mut supervisor = LabSupervisor::new(arguments.time_limit, arguments.quiet);
    let ready = LabSetup::new(&arguments.job, &outputs)?;
    let mut modes = ready.configurations(&arguments.knobs)?;
    fs::create_dir_all(&arguments.output).map_err(TradeoffError::io(&arguments.output))?;
    let mut lab = Lab::new(&ready.scene, ready.backend);
    let (each, fixed) = lab.pace(&ready.base, &mut supervisor)?;
    let left = supervisor.time_left().unwrap_or_default();
    let (width, height) = (ready.base.settings.width, ready.base.settings.height);
    let pixels = ready.base.settings.pixels();
    let (configurations, seeds) = (modes.len(), arguments.seeds);
    let analysis = pixels as f64 * analysis_seconds(flips_of(pixels, seeds), seeds);
    let edge = may_reduce(arguments).then_some(width.min(height));
    let cost = Cost { configurations, seeds, each, fixed, analysis };
    let Fit { mut levels, seeds, reference, reduction } = fit(left, cost, edge);
    if reduction > 1 {
        let (width, height) = (width.div_ceil(reduction), height.div_ceil(reduction));
        for mode in &mut modes {
            (mode.settings.width, mode.settings.height) = (width, height);
        }
        supervisor.report(&format!(
            "measuring at {width}x{height}, 1/{reduction} of the size, to fit the time; --resolution names another"
        ));
    }
    let base = &modes[0];
    let flips = flips_of(base.settings.pixels(), seeds);
    match (&arguments.levels[..], arguments.job.spp) {
        ([], None) => {}
        ([], Some(most)) => levels = vec![most.div_ceil(16), most.div_ceil(4), most],
        (given, _) => levels = given.to_vec(),
    }
    levels.sort_unstable();
    levels.dedup();
    let goal = match arguments.reference.reference_spp {
        Some(most) => Goal::Error { target: UNREACHABLE_ERROR, max_samples: most },
        None => Goal::Time(reference),
    };
    supervisor
        .report(&format!("{} configurations, {levels:?} samples per pixel, {seeds} seeds", modes.len()));
    let goal = (goal, REFERENCE_SHARE);
    let reference = lab.reference(base, goal, &cache, &mut supervisor)?;
    tell(reference.as_ref(), &mut supervisor);
    let command = base_command(&arguments.job);
    let sweep = Sweep { configurations: &modes, levels: &levels, seeds, flips, command: &command, reduction };
    let (mut found, pictures) = lab.measure(&sweep, reference.as_ref(), &mut supervisor)?;
    supervisor.finish();
    found.seconds = supervisor.elapsed().as_secs_f64();
    let earlier = arguments.output.join("tradeoff.json");
    let files = match found.points.is_empty() && keeps_earlier_report(&earlier) {
        true => Vec::new(),
        false => found.write(&pictures, &arguments.output)?,
    };
    let json = || Ok(found.json()?);
    print_result(arguments.json.json.as_deref(), json, || found.summary())?;
    files.iter().for_each(|file| supervisor.report(&format!("wrote {}", file.display())));
    Ok(exit_code(found.ended))
}

/// Measures the error curve of each configuration, and compares each pair of them.
pub fn follow(arguments: &ConvergeArgs) -> Result<ExitCode, Error> {
    super::refuse_ranks_that_measure()?;
    check_seeds(arguments.seeds)?;
    let cache = cache(&arguments.reference)?;
    let outputs = Outputs::default()
        .file("-o", arguments.output.as_deref())
        .file("--json", arguments.json.json.as_deref());
    outputs.check()?;
    arguments.json.json.as_deref().map_or(Ok(()), probe)?;
    let mut supervisor = LabSupervisor::new(arguments.time_limit, false);
    let ready = LabSetup::new(&arguments.job, &outputs)?;
    let modes = ready.configurations(&arguments.knobs)?;
    let ConvergeArgs { first, last, seeds, .. } = *arguments;
    let courses = ConvergencePlan { configurations: &modes, first, last, seeds };
    courses.counts()?;
    if let Some(path) = &arguments.output {
        output::probe(path)?;
    }
    let LabSetup { scene, base, backend, .. } = ready;
    let mut lab = Lab::new(&scene, backend);
    let most = arguments.reference.reference_spp.unwrap_or(last.saturating_mul(REFERENCE_OF_COURSE));
    let goal = (Goal::Error { target: UNREACHABLE_ERROR, max_samples: most }, REFERENCE_SHARE_OF_COURSE);
    let reference = lab.reference(&base, goal, &cache, &mut supervisor)?;
    tell(reference.as_ref(), &mut supervisor);
    let found: Convergence = lab.converge(&courses, reference.as_ref(), &mut supervisor)?;
    supervisor.finish();
    let json = || {
        serde_json::to_string_pretty(&found).map(|text| text + "\n").map_err(|error| ImageError::Codec {
            path: arguments.output.clone().unwrap_or_else(|| "standard output".into()),
            message: error.to_string(),
        })
    };
    if let Some(path) = &arguments.output
        && !(found.courses.is_empty() && keeps_earlier_report(path))
    {
        output::write_file(path, json()?.as_bytes())?;
    }
    print_result(arguments.json.json.as_deref(), || Ok(json()?), || found.summary())?;
    Ok(exit_code(found.ended))
}

/// Returns the number of repetitions for which FLIP is computed.
fn flips_of(pixels: u64, seeds: usize) -> usize {
    if pixels > LARGE { 2 } else { 4.min(seeds) }
}

/// Returns the seconds per pixel that an image takes besides rendering, on all threads.
fn analysis_seconds(flips: usize, seeds: usize) -> f64 {
    let threads = std::thread::available_parallelism().map_or(1.0, |threads| threads.get() as f64);
    let share = flips as f64 / seeds.max(1) as f64;
    (NANOSECONDS.0 + NANOSECONDS.1 * share) * 1e-9 / threads
}

/// Returns whether images may be smaller than the scene's: neither a size nor numbers of samples
/// are given.
fn may_reduce(arguments: &TradeoffArgs) -> bool {
    let JobArgs { resolution, width, height, spp, .. } = &arguments.job;
    resolution.is_none()
        && width.is_none()
        && height.is_none()
        && spp.is_none()
        && arguments.levels.is_empty()
}

/// Returns the command that renders the base, without its number of samples.
fn base_command(job: &JobArgs) -> RenderCommand {
    RenderCommand {
        scene: job.scene.as_ref().map(|scene| scene.display().to_string()),
        options: given_options::of_job("tradeoff", &["spp"]),
    }
}

/// Reports the reference's number of samples and its own error.
fn tell(reference: Option<&Reference>, supervisor: &mut LabSupervisor) {
    if let Some(ReferenceInfo { samples, error, .. }) = reference.map(|reference| &reference.facts) {
        let error = 100.0 * error;
        supervisor.report(&format!("reference: {samples:.0} samples a pixel, own error {error:.3} %"));
    }
}

/// Returns whether an earlier report exists, and prints that an empty one does not replace it.
fn keeps_earlier_report(earlier: &Path) -> bool {
    let is_there = earlier.exists();
    if is_there {
        eprint(&format!("nothing was measured: {} is unchanged", earlier.display()));
    }
    is_there
}
