//! Measures live frames, which are traced, denoised and kept on the device.

use super::{Row, Summary, WarmUp};
use crate::Error;
use serde::Serialize;
use std::time::{Duration, Instant};
use trisect::denoise::{DenoiseSettings, Kernel};
use trisect::render::{LiveFrame, Renderer, Settings};
use trisect::view::FrameTiming;

/// Report of `trisect view --headless`, as its JSON holds it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ViewReport {
    /// Version of the JSON format, [`FORMAT`](Self::FORMAT).
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// `cpu`, `wgpu` or `cuda`.
    pub backend: String,
    /// Name that the driver gives the device.
    pub device: String,
    /// Name of the kernel.
    pub kernel: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Number of measured frames.
    pub frames: usize,
    /// Measured quantities.
    pub rows: Vec<Row>,
}

impl ViewReport {
    /// Version of the JSON format. It is raised when a field changes its meaning or is removed.
    pub const FORMAT: u32 = 1;
}

/// Names, units and values of one frame's rows.
pub(super) type Values = Vec<(String, &'static str, f64)>;

/// Measures tracing, each pass of the denoiser, both together, and the frame as seen by the host.
/// Returns one row per quantity, in milliseconds, and the frame rate. The time of `warm_up` begins
/// before the first frame.
///
/// # Errors
///
/// Errors of [`Renderer::live`].
pub fn measure_live(
    renderer: &mut Renderer,
    settings: &Settings,
    denoise: &DenoiseSettings,
    warm_up: WarmUp,
    frames: u32,
) -> Result<Vec<Row>, Error> {
    let mut frame = || {
        let start = Instant::now();
        let live = renderer.live(settings, Some(denoise), None)?;
        Ok::<_, Error>(values(&live, start.elapsed().as_secs_f64()))
    };
    let start = Instant::now();
    let mut done = 0;
    while done < warm_up.frames || start.elapsed() < warm_up.time {
        frame()?;
        done += 1;
    }
    let counted: Vec<Values> = (0..frames).map(|_| frame()).collect::<Result<_, _>>()?;
    Ok(rows(&counted))
}

/// Returns the rows for frames of the viewer: those of [`measure_live`], and the time to convert a
/// frame for display and to copy it to the host.
pub fn rows_of_timings(shots: &[FrameTiming]) -> Vec<Row> {
    let frame = |shot: &FrameTiming| {
        let mut values = values(&shot.live, shot.whole.as_secs_f64());
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        values.insert(values.len() - 2, ("display".to_owned(), "ms", milliseconds(shot.display)));
        values.insert(values.len() - 2, ("display and copy".to_owned(), "ms", milliseconds(shot.present)));
        values
    };
    rows(&shots.iter().map(frame).collect::<Vec<_>>())
}

/// Summarises each value of the first frame over all frames that have it.
pub(super) fn rows(frames: &[Values]) -> Vec<Row> {
    let Some(first) = frames.first() else { return Vec::new() };
    let row = |(name, unit, _): &(String, &'static str, f64)| {
        let of = |frame: &Values| frame.iter().find(|value| value.0 == *name).map(|value| value.2);
        let column: Vec<f64> = frames.iter().map(of).collect::<Option<_>>()?;
        Some(Row { name: name.clone(), unit: (*unit).to_owned(), summary: Summary::of(&column)? })
    };
    first.iter().filter_map(row).collect()
}

fn values(live: &LiveFrame, wall: f64) -> Values {
    let mut level = 0;
    let name = |kernel: Kernel| {
        if !kernel.is_level() {
            return kernel.title().to_owned();
        }
        level += 1;
        format!("level {level}")
    };
    let trace = live.trace.as_secs_f64();
    let names: Vec<String> = live.passes.iter().map(|pass| pass.0).map(name).collect();
    let times = || live.passes.iter().map(|pass| pass.1.as_secs_f64());
    let levels: f64 =
        live.passes.iter().filter(|pass| pass.0.is_level()).map(|pass| pass.1.as_secs_f64()).sum();
    let denoise: f64 = times().sum();
    let mut values: Values = vec![("trace".to_owned(), "ms", trace * 1e3)];
    values.extend(names.into_iter().zip(times()).map(|(name, seconds)| (name, "ms", seconds * 1e3)));
    values.extend([
        ("all levels".to_owned(), "ms", levels * 1e3),
        ("denoise".to_owned(), "ms", denoise * 1e3),
        ("trace and denoise".to_owned(), "ms", (trace + denoise) * 1e3),
        ("live frame on the host".to_owned(), "ms", wall * 1e3),
        ("rate of frames".to_owned(), "frames/s", 1.0 / wall.max(1e-9)),
    ]);
    values
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use trisect::denoise::Filter;
    use trisect::device::cpu::Cpu;
    use trisect::scene::Scene;

    #[test]
    fn rows_of_a_live_frame() {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let settings = Settings { width: 16, height: 9, samples: 1, ..Settings::of(&scene) };
        let denoise = DenoiseSettings { levels: 2, ..DenoiseSettings::new(Filter::Svgf) };
        let rows = measure_live(&mut renderer, &settings, &denoise, WarmUp::of(1), 3).unwrap();
        let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        let want = [
            "trace",
            "gather",
            "estimate the variance",
            "level 1",
            "level 2",
            "finish",
            "all levels",
            "denoise",
            "trace and denoise",
            "live frame on the host",
            "rate of frames",
        ];
        assert_eq!(names, want);
        assert!(rows.iter().all(|row| row.summary.count == 3));
    }
}
