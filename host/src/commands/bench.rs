//! `trisect bench`.

use super::Session;
use crate::cli::BenchArgs;
use std::fmt::Write;
use std::process::ExitCode;
use trisect::Error;
use trisect::stats::RenderStats;

/// Frames that let the device's clock settle and the scheduler learn its pace.
const WARM_UP: u32 = 2;

/// Renders a scene several times and prints what a frame takes.
pub fn run(arguments: &BenchArgs) -> Result<ExitCode, Error> {
    let mut session = Session::open(&arguments.job)?;
    let mut frames = Vec::new();
    for frame in 0..WARM_UP + arguments.frames {
        let stats = session.renderer.render(&session.settings, &mut ())?.stats;
        if frame >= WARM_UP {
            frames.push(stats);
        }
    }
    let Some(stats) = frames.first() else { return Ok(ExitCode::SUCCESS) };
    let settings = &stats.settings;
    let mut text = String::new();
    let _ = writeln!(text, "scene     {}", session.name);
    let _ = writeln!(
        text,
        "device    {}: {} ({})",
        stats.device.backend, stats.device.name, stats.device.details
    );
    let _ = writeln!(
        text,
        "frame     {}x{}, {} spp, depth {}, roulette {}, math {:?}, kernel {}, {} submissions",
        settings.width,
        settings.height,
        settings.samples,
        settings.depth,
        if settings.roulette { "on" } else { "off" },
        settings.math,
        stats.kernel,
        stats.submissions,
    );
    let _ = writeln!(text, "segments  {:.3} a sample", stats.segments as f64 / stats.samples.max(1) as f64);
    let _ = writeln!(
        text,
        "{:<24} {:>10} {:>10} {:>10}",
        format!("{} frames", frames.len()),
        "median",
        "least",
        "greatest"
    );
    let mut row = |name: &str, digits: usize, value: &dyn Fn(&RenderStats) -> f64| {
        let mut values: Vec<f64> = frames.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        let (least, greatest) = (values[0], values[values.len() - 1]);
        let median = 0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]);
        let _ = writeln!(text, "{name:<24} {median:>10.digits$} {least:>10.digits$} {greatest:>10.digits$}");
    };
    row("device time, ms", 3, &|stats| stats.device_seconds * 1e3);
    row("frame on the host, ms", 3, &|stats| stats.phases.render_seconds * 1e3);
    row("Msamples/s", 2, &|stats| stats.msamples_per_second);
    row("Msegments/s", 2, &|stats| stats.msegments_per_second);
    super::print(&text)?;
    for warning in stats.warnings() {
        eprintln!("warning: {warning}");
    }
    Ok(ExitCode::SUCCESS)
}
