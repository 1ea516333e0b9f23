//! `trisect bench`.

use super::Session;
use crate::cli::{BenchArgs, BenchCommand};
use std::process::ExitCode;
use std::time::Instant;
use trisect::bench::{BenchError, Benchmark, FirstSubmission, Once, measure};
use trisect::{Error, output};

/// Frames that let the device's clock settle and the scheduler learn its pace.
const WARM_UP: u32 = 2;

/// Renders a scene several times and prints what a frame takes. `start` is when the program began.
pub fn run(arguments: &BenchArgs, start: Instant) -> Result<ExitCode, Error> {
    if let Some(BenchCommand::Report(arguments)) = &arguments.command {
        return super::report::run(arguments);
    }
    if let Some(path) = &arguments.json {
        output::probe(path)?;
    }
    let mut session = Session::open(&arguments.job)?;
    let mut first = FirstSubmission::default();
    let mut frames =
        measure(&mut session.renderer, &session.settings, WARM_UP, arguments.frames, &mut first)?;
    for stats in &mut frames.counted {
        stats.scene.clone_from(&session.name);
    }
    let phases = &frames.first.phases;
    let once = Once {
        load_seconds: session.load_seconds,
        open_seconds: session.open_seconds,
        bvh_seconds: phases.bvh_seconds,
        upload_seconds: phases.upload_seconds,
        prepare_seconds: phases.prepare_seconds,
        view_seconds: phases.view_seconds,
        start_to_first_kernel_seconds: first.ended.map_or(0.0, |end| (end - start).as_secs_f64()),
    };
    let Some(benchmark) = Benchmark::new(&frames.counted, once, WARM_UP) else {
        return Ok(ExitCode::SUCCESS);
    };
    super::print(&benchmark.table())?;
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&benchmark)
            .map_err(|error| BenchError::Encode { path: path.clone(), message: error.to_string() })?;
        std::fs::write(path, text + "\n").map_err(|source| BenchError::Io { path: path.clone(), source })?;
    }
    for warning in frames.first.warnings() {
        eprintln!("warning: {warning}");
    }
    Ok(ExitCode::SUCCESS)
}
