//! `trisect bench`: measures the frame times of one scene, prints a table and writes JSON.

use super::{Session, data};
use crate::cli::BenchArgs;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trisect::denoise::Denoiser;
use trisect::device::DeviceKind;
use trisect::output::Outputs;
use trisect_lab::Error;
use trisect_lab::bench::{
    BenchError, Benchmark, FirstSubmission, Once, WarmUp, measure, measure_live, measure_oidn,
};

/// Minimum number of warm-up frames.
const WARM_UP: u32 = 2;

/// Minimum time of the warm-up on a GPU, after its first frame. A GPU that idled while its driver
/// compiled is slow for a while: see docs/notebook/vulkan.md.
const SETTLE: Duration = Duration::from_millis(500);

/// Renders a scene several times and prints the times of a frame. The program started at `start`.
pub fn run(arguments: &BenchArgs, start: Instant) -> Result<ExitCode, Error> {
    super::refuse_ranks_that_measure()?;
    if let Some(path) = &arguments.json {
        data::probe(path)?;
    }
    let denoise = arguments.denoise.denoise()?;
    denoise.as_ref().map_or(Ok(()), Denoiser::check)?;
    let outputs = Outputs::default().file("--json", arguments.json.as_deref());
    let mut session = Session::open(&arguments.job, &outputs)?;
    let mut first = FirstSubmission::default();
    let gpu = session.renderer.device().info().kind == DeviceKind::Gpu;
    let warm_up = WarmUp { frames: WARM_UP, time: if gpu { SETTLE } else { Duration::ZERO } };
    session.settings.guides = denoise.is_some();
    if let Some(Denoiser::Filter(_)) = denoise {
        session.settings.check_live()?;
    }
    let mut frames =
        measure(&mut session.renderer, &session.settings, warm_up, arguments.frames, &mut first)?;
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
    let Some(mut benchmark) = Benchmark::new(&frames.counted, once, frames.warm_up) else {
        return Ok(ExitCode::SUCCESS);
    };
    if let Some(denoise) = &denoise {
        let Session { renderer, settings, .. } = &mut session;
        benchmark.rows.extend(match denoise {
            Denoiser::Filter(filter) => measure_live(renderer, settings, filter, warm_up, arguments.frames)?,
            Denoiser::Oidn => measure_oidn(renderer, settings, warm_up, arguments.frames)?,
        });
    }
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&benchmark)
            .map_err(|error| BenchError::Encode { path: path.clone(), message: error.to_string() })?;
        data::write(path, &text)?;
    }
    if !arguments.json.as_deref().is_some_and(data::is_stdout) {
        super::print(&benchmark.table())?;
    }
    for warning in frames.first.warnings() {
        super::eprint(&format!("warning: {warning}"));
    }
    Ok(ExitCode::SUCCESS)
}
