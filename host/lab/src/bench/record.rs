//! Result of a benchmark, as versioned JSON and as a table.

use super::Summary;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt::Write;
use trisect::stats::RenderStats;

/// Version of the JSON that `trisect bench --json` writes. It is raised when a field changes its
/// meaning or is removed.
pub const FORMAT: u32 = 1;

/// Program, scene, device, kernel and settings of a benchmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Subject {
    /// Version of the program.
    pub version: String,
    /// Name of the scene.
    pub scene: String,
    /// `cpu`, `wgpu` or `cuda`.
    pub backend: String,
    /// Name that the driver gives the device.
    pub device: String,
    /// Driver, threads and memory of the device.
    pub details: String,
    /// Timer that measured device times.
    pub timer: String,
    /// Name of the kernel.
    pub kernel: String,
    /// Method of finding the closest hit.
    pub traversal: Value,
    /// Assignment of work to lanes.
    pub schedule: Value,
    /// Requested settings, as in `--stats`.
    pub settings: Value,
}

/// Wall-clock seconds of the steps that are done once, before the first frame is complete.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Once {
    /// Reading and validating the scene file.
    pub load_seconds: f64,
    /// Opening the backend's device.
    pub open_seconds: f64,
    /// Building the BVH.
    pub bvh_seconds: f64,
    /// Copying the scene to the device.
    pub upload_seconds: f64,
    /// Compiling the kernel and allocating the film.
    pub prepare_seconds: f64,
    /// Building the tile entries: pruning the BVH for the camera.
    pub view_seconds: f64,
    /// From the start of `main` to the end of the first submission. Includes all of the above.
    pub start_to_first_kernel_seconds: f64,
}

/// One measured quantity, summarised over the frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Row {
    /// Name of the quantity.
    pub name: String,
    /// Unit of the quantity.
    pub unit: String,
    /// Summary over the frames that count.
    pub summary: Summary,
}

/// Result of a benchmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Benchmark {
    /// Version of the JSON, [`FORMAT`].
    pub format: u32,
    /// Program, scene, device, kernel and settings.
    pub subject: Subject,
    /// Seconds of the steps that are done once.
    pub once: Once,
    /// Number of warm-up frames, which do not count.
    pub warm_up: u32,
    /// Kernel launches of the last frame.
    pub submissions: u64,
    /// Mean number of path segments (rays) of a sample.
    pub segments_per_sample: f64,
    /// Quantities measured in each frame.
    pub rows: Vec<Row>,
}

/// Row of the table: name, unit, and function that returns the value of one frame.
type Quantity = (&'static str, &'static str, fn(&RenderStats) -> f64);

const QUANTITIES: [Quantity; 6] = [
    ("device time", "ms", |stats| stats.device_seconds * 1e3),
    ("read-back", "ms", |stats| stats.phases.read_seconds * 1e3),
    ("merge", "ms", |stats| (stats.phases.merge_seconds - stats.phases.read_seconds) * 1e3),
    ("frame on the host", "ms", |stats| stats.phases.render_seconds * 1e3),
    ("rate of samples", "Msamples/s", |stats| stats.msamples_per_second),
    ("rate of segments", "Msegments/s", |stats| stats.msegments_per_second),
];

impl Benchmark {
    /// Summarises the frames that count; `None` if there are none.
    pub fn new(frames: &[RenderStats], once: Once, warm_up: u32) -> Option<Self> {
        let last = frames.last()?;
        let row = |(name, unit, quantity): Quantity| {
            let values: Vec<f64> = frames.iter().map(quantity).collect();
            let summary = Summary::of(&values)?;
            Some(Row { name: name.to_owned(), unit: unit.to_owned(), summary })
        };
        let value = |value: Result<Value, _>| value.unwrap_or(Value::Null);
        Some(Self {
            format: FORMAT,
            subject: Subject {
                version: last.version.to_owned(),
                scene: last.scene.clone(),
                backend: last.device.backend.to_owned(),
                device: last.device.name.clone(),
                details: last.device.details.clone(),
                timer: last.device.timer.to_owned(),
                kernel: last.kernel.to_owned(),
                traversal: value(serde_json::to_value(last.traversal)),
                schedule: value(serde_json::to_value(last.schedule)),
                settings: value(serde_json::to_value(&last.settings)),
            },
            once,
            warm_up,
            submissions: last.submissions,
            segments_per_sample: last.segments as f64 / last.samples.max(1) as f64,
            rows: QUANTITIES.into_iter().map(row).collect::<Option<_>>()?,
        })
    }

    /// Returns a table for people.
    pub fn table(&self) -> String {
        let Self { subject, once, .. } = self;
        let setting = |name: &str| match &subject.settings[name] {
            Value::String(text) => text.clone(),
            Value::Bool(on) => if *on { "on" } else { "off" }.to_owned(),
            other => other.to_string(),
        };
        let word = |value: &Value| value.as_str().unwrap_or("?").to_owned();
        let mut text = String::new();
        let _ = writeln!(text, "scene     {}", subject.scene);
        let _ = writeln!(text, "device    {}: {} ({})", subject.backend, subject.device, subject.details);
        let _ = writeln!(
            text,
            "frame     {}x{}, {} spp, depth {}, roulette {}, math {}, {} submissions",
            setting("width"),
            setting("height"),
            setting("samples"),
            setting("depth"),
            setting("roulette"),
            setting("math"),
            self.submissions,
        );
        let _ = writeln!(
            text,
            "kernel    {}: traversal {}, schedule {}",
            subject.kernel,
            word(&subject.traversal),
            word(&subject.schedule)
        );
        let _ = writeln!(text, "segments  {:.3} a sample", self.segments_per_sample);
        let _ = writeln!(text, "\n{:<34} {:>10}", "once, ms", "");
        for (name, seconds) in [
            ("load the scene", once.load_seconds),
            ("open the device", once.open_seconds),
            ("build the BVH", once.bvh_seconds),
            ("upload", once.upload_seconds),
            ("prepare (compile the kernel)", once.prepare_seconds),
            ("prune the BVH for the camera", once.view_seconds),
            ("start to the first kernel's end", once.start_to_first_kernel_seconds),
        ] {
            let _ = writeln!(text, "{name:<34} {:>10.3}", seconds * 1e3);
        }
        let frames = self.rows.first().map_or(0, |row| row.summary.count);
        let _ = write!(text, "\n{}", table(&format!("{frames} frames after {}", self.warm_up), &self.rows));
        text
    }
}

/// Returns a table of rows below a title, for people.
pub fn table(title: &str, rows: &[Row]) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{title:<34} {:>10} {:>10} {:>10} {:>10}", "median", "least", "greatest", "IQR");
    for Row { name, unit, summary } in rows {
        // A rate is identified by its unit, which scripts look for; a time by its name.
        let name = if unit == "ms" { format!("{name}, ms") } else { unit.clone() };
        let _ = writeln!(
            text,
            "{name:<34} {:>10.3} {:>10.3} {:>10.3} {:>10.3}",
            summary.median,
            summary.least,
            summary.greatest,
            summary.spread()
        );
    }
    text
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::bench::{WarmUp, measure};
    use trisect::device::cpu::Cpu;
    use trisect::render::{Renderer, Settings};
    use trisect::scene::Scene;

    fn benchmark() -> Benchmark {
        let scene = Scene::hello_world().unwrap();
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let settings = Settings { width: 8, height: 4, samples: 2, ..Settings::of(&scene) };
        let mut frames = measure(&mut renderer, &settings, WarmUp::of(0), 3, &mut ()).unwrap().counted;
        for (frame, milliseconds) in frames.iter_mut().zip([5.0, 1.0, 3.0]) {
            frame.device_seconds = milliseconds * 1e-3;
            frame.phases.merge_seconds = 0.75;
            frame.phases.read_seconds = 0.5;
        }
        let once = Once { load_seconds: 0.125, start_to_first_kernel_seconds: 0.25, ..Once::default() };
        Benchmark::new(&frames, once, 2).unwrap()
    }

    #[test]
    fn json_round_trip() {
        let benchmark = benchmark();
        let text = serde_json::to_string_pretty(&benchmark).unwrap();
        assert_eq!(serde_json::from_str::<Benchmark>(&text).unwrap(), benchmark);
        assert!(text.contains("\"format\": 1"), "{text}");
        // Negative control: a lost digit in the file changes the result, and a renamed field is an
        // error.
        let cut = serde_json::from_str::<Benchmark>(&text.replace("0.125", "0.12")).unwrap();
        assert_ne!(cut, benchmark);
        assert!(serde_json::from_str::<Benchmark>(&text.replace("\"once\"", "\"twice\"")).is_err());
    }

    #[test]
    fn rows_and_table() {
        let benchmark = benchmark();
        let row = |name: &str| benchmark.rows.iter().find(|row| row.name == name).unwrap().summary;
        let kernels = row("device time");
        assert_eq!((kernels.median, kernels.least, kernels.greatest, kernels.count), (3.0, 1.0, 5.0, 3));
        // The merge time is the rest of reading and merging.
        assert_eq!((row("read-back").median, row("merge").median), (500.0, 250.0));
        let table = benchmark.table();
        for words in ["8x4, 2 spp", "roulette off", "3 frames after 2", "125.000", "250.000", "segments  "] {
            assert!(table.contains(words), "{words:?} in {table}");
        }
        // Scripts read the second word of these lines.
        for unit in ["Msamples/s", "Msegments/s"] {
            assert_eq!(table.lines().filter(|line| line.starts_with(unit)).count(), 1, "{table}");
        }
        assert_eq!(Benchmark::new(&[], Once::default(), 0), None);
    }
}
