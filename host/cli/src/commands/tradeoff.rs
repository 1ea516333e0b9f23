//! `trisect tradeoff` measures what options cost and gain; `trisect converge` measures how errors
//! fall with the number of samples.

use super::data::{print_result, probe};
use super::lab::{LabSupervisor, exit_code};
use super::{Loaded, eprint, given_options, open};
use crate::cli::{ConvergeArgs, JobArgs, TradeoffArgs};
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use trisect::image::ImageError;
use trisect::output;
use trisect::output::Outputs;
use trisect::scene::Scene;
use trisect_lab::Error;
use trisect_lab::evaluate::ImageFolder;
use trisect_lab::tradeoff::{
    Configuration, Convergence, ConvergencePlan, ReferenceSource, RenderCommand, Supervisor, TradeoffError,
    TradeoffPlan, cache_folder, check_seeds, configurations_of, is_output,
};

/// Scene, base configuration and backend of a measurement.
struct LabSetup {
    scene: Scene,
    base: Configuration,
    backend: Box<dyn trisect::device::Device>,
}

impl LabSetup {
    fn new(job: &JobArgs, outputs: &Outputs) -> Result<Self, Error> {
        let loaded = Loaded::read(job, outputs)?;
        loaded.warn(job)?;
        let selection = open(job.backend, job.device, job.threads)?;
        let base = Configuration::base(&loaded.settings, job.bvh_quality);
        Ok(Self { scene: loaded.scene, base, backend: selection.device })
    }

    fn configurations(&self, knobs: &[String]) -> Result<Vec<Configuration>, TradeoffError> {
        configurations_of(&self.scene, &self.base, knobs, self.backend.as_ref())
    }
}

/// Measures the base settings and each configuration of the chosen options (knobs), and writes a
/// report of what was measured within the time limit.
pub fn run(arguments: &TradeoffArgs) -> Result<ExitCode, Error> {
    super::refuse_ranks_that_measure()?;
    check_seeds(arguments.seeds)?;
    let folder = cache_folder(arguments.reference.cache.as_deref())?;
    let outputs = Outputs::default()
        .folder("-o", Some(&arguments.output), is_output)
        .file("--json", arguments.json.json.as_deref());
    outputs.check()?;
    let others = arguments.against.as_deref().map(ImageFolder::without_reference).transpose()?;
    if let Some(others) = &others {
        outputs.check_inputs("an image", others.files())?;
    }
    arguments.json.json.as_deref().map_or(Ok(()), probe)?;
    let mut supervisor = LabSupervisor::new(arguments.time_limit, arguments.quiet);
    let ready = LabSetup::new(&arguments.job, &outputs)?;
    let configurations = ready.configurations(&arguments.knobs)?;
    fs::create_dir_all(&arguments.output).map_err(TradeoffError::io(&arguments.output))?;
    let plan = TradeoffPlan {
        configurations,
        seeds: arguments.seeds,
        levels: &arguments.levels,
        max_spp: arguments.job.spp,
        may_reduce: may_reduce(arguments),
        reference: ReferenceSource { folder: &folder, max_spp: arguments.reference.reference_spp },
        command: base_command(&arguments.job),
        others: others.as_ref(),
    };
    let (mut found, pictures) = plan.run(&ready.scene, ready.backend, &mut supervisor)?;
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
    let folder = cache_folder(arguments.reference.cache.as_deref())?;
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
    let LabSetup { scene, backend, .. } = ready;
    let source = ReferenceSource { folder: &folder, max_spp: arguments.reference.reference_spp };
    let found: Convergence = courses.run(&scene, backend, source, &mut supervisor)?;
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

/// Returns whether an earlier report exists, and prints that an empty one does not replace it.
fn keeps_earlier_report(earlier: &Path) -> bool {
    let is_there = earlier.exists();
    if is_there {
        eprint(&format!("nothing was measured: {} is unchanged", earlier.display()));
    }
    is_there
}
