//! Measures and draws the charts of the report "Parallelizing Ray Tracing" on this machine. Used by
//! `trisect bench report`.
//!
//! Each experiment is a module: it measures, and turns the measurements into a chart. The data are
//! written beside the chart, complete as JSON and as CSV.

mod complexity;
mod method;
mod page;
mod plan;
mod spp;
mod vs_cpu;

pub use complexity::{Complexity, Cost, LeftOut, MethodPoint};
pub use method::{METHODS, Method};
pub use plan::ReportPlan;
pub use spp::{Spp, SppPoint};
pub use vs_cpu::{VsCpu, VsCpuPoint};

use super::BenchError;
use crate::Error;
use crate::plot::{self, Chart};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use trisect::device::{Device, DeviceInfo};
use trisect::render::{Renderer, Settings};
use trisect::scene::{Rebase, Scene, SceneDocument};

/// Version of the JSON of the data. It is raised when a field changes its meaning or is removed.
pub const FORMAT: u32 = 1;

/// Program, device and settings of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Conditions {
    /// Version of the JSON, [`FORMAT`].
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// `cpu`, `wgpu` or `cuda`.
    pub backend: String,
    /// Name that the driver gives the device.
    pub device: String,
    /// Driver, threads and memory of the device.
    pub details: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Maximum number of segments of a path.
    pub depth: u32,
    /// Build of the kernels: `precise` or `fast`.
    pub math: String,
    /// Warm-up frames of each point, which do not count.
    pub warm_up: u32,
    /// Frames of each point that count.
    pub frames: u32,
}

impl Conditions {
    fn new(device: &DeviceInfo, settings: &Settings, plan: &ReportPlan) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            backend: device.backend.to_owned(),
            device: device.name.clone(),
            details: device.details.clone(),
            width: settings.width,
            height: settings.height,
            depth: settings.depth,
            math: format!("{:?}", settings.math).to_lowercase(),
            warm_up: plan.warm_up,
            frames: plan.frames,
        }
    }

    fn device(&self) -> String {
        format!("{}: {} ({})", self.backend, self.device, self.details)
    }

    fn image(&self) -> String {
        format!("{}×{}, depth {}, {} math", self.width, self.height, self.depth, self.math)
    }
}

/// Results of all experiments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Report {
    /// Time against samples per pixel.
    pub spp: Spp,
    /// Time of each method against the number of spheres.
    pub complexity: Complexity,
    /// Speed of the device against one thread of the CPU.
    pub against: VsCpu,
}

impl Report {
    /// Measures everything. `one_thread` is a CPU backend of one thread; `scenes` are rendered on
    /// both devices, besides the built-in ones; `say` is called with a line for each point.
    ///
    /// # Errors
    ///
    /// Errors of rendering, and [`BenchError`].
    pub fn measure(
        backend: Box<dyn Device>,
        one_thread: Box<dyn Device>,
        plan: &ReportPlan,
        scenes: &[SceneDocument],
        say: &mut dyn FnMut(&str),
    ) -> Result<Self, Error> {
        if plan.counts.is_empty() {
            return Err(BenchError::NothingToMeasure.into());
        }
        let mut bench = Bench { backend: Some(backend), plan, say };
        let spp = Spp::measure(&mut bench)?;
        let complexity = Complexity::measure(&mut bench)?;
        let against = VsCpu::measure(&mut bench, one_thread, scenes)?;
        Ok(Self { spp, complexity, against })
    }

    /// Returns a summary for people.
    pub fn summary(&self) -> String {
        [self.spp.summary(), self.complexity.summary(), self.against.summary()].concat()
    }

    /// Writes charts, data and the page `report.html` into a folder, which is created if necessary.
    /// Returns the paths of the files.
    ///
    /// # Errors
    ///
    /// [`BenchError`] if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, BenchError> {
        fs::create_dir_all(folder).map_err(BenchError::io(folder))?;
        let mut files = Vec::new();
        let mut chart = |stem: &str, chart: Chart| {
            files.extend(["svg", "png"].map(|kind| folder.join(format!("{stem}.{kind}"))));
            plot::write(&chart, folder, stem)
        };
        chart("time_against_spp", self.spp.chart())?;
        chart("speed_up_against_spheres", self.complexity.speed_up_chart())?;
        chart("cost_against_spheres", self.complexity.cost_chart())?;
        chart("device_against_one_thread", self.against.chart())?;
        data(folder, "time_against_spp", &self.spp, self.spp.csv(), &mut files)?;
        data(folder, "methods_against_spheres", &self.complexity, self.complexity.csv(), &mut files)?;
        data(folder, "device_against_one_thread", &self.against, self.against.csv(), &mut files)?;
        let path = folder.join(PAGE);
        fs::write(&path, self.page()).map_err(BenchError::io(&path))?;
        files.push(path);
        Ok(files)
    }
}

fn data(
    folder: &Path,
    stem: &str,
    data: &impl Serialize,
    csv: String,
    files: &mut Vec<PathBuf>,
) -> Result<(), BenchError> {
    let path = folder.join(format!("{stem}.json"));
    let json = serde_json::to_string_pretty(data).map_err(|error| BenchError::encode(&path, error))?;
    fs::write(&path, json + "\n").map_err(BenchError::io(&path))?;
    files.push(path);
    let path = folder.join(format!("{stem}.csv"));
    fs::write(&path, csv).map_err(BenchError::io(&path))?;
    files.push(path);
    Ok(())
}

/// Name of the page.
const PAGE: &str = "report.html";

/// Returns whether [`Report::write`] writes a file of this name.
pub fn is_output(name: &Path) -> bool {
    const STEMS: [&str; 5] = [
        "time_against_spp",
        "speed_up_against_spheres",
        "cost_against_spheres",
        "device_against_one_thread",
        "methods_against_spheres",
    ];
    let is_kind = ["svg", "png", "json", "csv"].iter().any(|kind| name.extension() == Some(kind.as_ref()));
    name == Path::new(PAGE) || is_kind && STEMS.iter().any(|stem| name.file_stem() == Some(stem.as_ref()))
}

/// Returns CSV text. Cells with a comma, quote or line break are quoted.
fn csv<const N: usize>(header: [&str; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let quote = |cell: String| {
        if cell.contains([',', '"', '\n']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell }
    };
    let mut text = header.join(",") + "\n";
    for row in rows {
        text += &(row.map(quote).join(",") + "\n");
    }
    text
}

/// The device under test. It is kept from scene to scene, with the kernels that it compiled.
struct Bench<'a> {
    backend: Option<Box<dyn Device>>,
    plan: &'a ReportPlan,
    say: &'a mut dyn FnMut(&str),
}

impl Bench<'_> {
    /// Runs `work` with a renderer for the scene, and takes the device back.
    fn with<T>(
        &mut self,
        scene: &Scene,
        work: impl FnOnce(&mut Self, &mut Renderer) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Some(backend) = self.backend.take() else {
            return Err(trisect::device::BackendError::Device {
                backend: "any",
                action: "measuring",
                message: "the device was lost in an earlier experiment".to_owned(),
            }
            .into());
        };
        let mut renderer = Renderer::new(backend, scene)?;
        let result = work(self, &mut renderer);
        self.backend = Some(renderer.into_device());
        result
    }

    fn say(&mut self, line: &str) {
        (self.say)(line);
    }
}

/// Returns the scene with `count` spheres, lowered to device records.
fn spheres(count: u32) -> Result<Scene, Error> {
    Ok(super::sphere_scene(count)?.lower(Rebase::IDENTITY)?)
}

#[cfg(test)]
mod tests;
