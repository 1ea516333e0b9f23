//! `trisect bench report`: measures this machine and writes charts and data.

use crate::cli::ReportArgs;
use std::process::ExitCode;
use trisect::device::cpu::Cpu;
use trisect::output::Outputs;
use trisect::scene::{LoadOptions, SceneDocument};
use trisect_lab::Error;
use trisect_lab::bench::BenchError;
use trisect_lab::bench::report::{Report, ReportPlan, is_output};

/// Measures this machine, writes charts and data, and prints a summary.
pub fn run(arguments: &ReportArgs) -> Result<ExitCode, Error> {
    super::refuse_ranks_that_measure()?;
    // Creates the folder first: if that fails, no measurement is lost.
    let out = &arguments.output;
    std::fs::create_dir_all(out).map_err(|source| BenchError::Io { path: out.clone(), source })?;
    let scenes: Vec<SceneDocument> = arguments
        .scenes
        .iter()
        .map(|path| {
            let includes = arguments.includes.includes();
            SceneDocument::load_with(path, &LoadOptions { includes, ..LoadOptions::default() })
        })
        .collect::<Result<_, _>>()?;
    let outputs = Outputs::default().folder("-o", Some(out), is_output);
    outputs.check_inputs("a scene", &arguments.scenes)?;
    outputs.check_inputs("a file of a scene", scenes.iter().flat_map(|scene| &scene.description.files))?;
    let selection = super::open(arguments.backend, arguments.device, arguments.threads)?;
    if !selection.why.is_empty() {
        super::eprint(&selection.why);
    }
    let mut plan = ReportPlan::new(selection.device.info().kind, arguments.quick).up_to(arguments.spheres);
    plan.math = arguments.math;
    if let Some(resolution) = arguments.resolution {
        (plan.width, plan.height) = resolution;
    }
    plan.limit = arguments.time_limit.unwrap_or(plan.limit);
    let one_thread = Box::new(Cpu::open(Some(1))?);
    let report =
        Report::measure(selection.device, one_thread, &plan, &scenes, &mut |line| super::eprint(line))?;
    for file in report.write(out)? {
        super::eprint(&format!("wrote {}", file.display()));
    }
    super::print(&report.summary())?;
    Ok(ExitCode::SUCCESS)
}
