//! Errors over a growing number of samples.

use super::options::LabOptions;
use super::supervisor::Watch;
use super::{finished, loaded, rows};
use crate::error::{self, Facts};
use crate::lifecycle::Running;
use crate::nested::Nested;
use crate::scene::Scene;
use crate::words::count;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::Arc;
use trisect_lab::Error;
use trisect_lab::tradeoff::{Convergence as Found, ConvergencePlan, ReferenceSource, configurations_of};

/// Options that are varied unless others are named, as in the program.
const KNOBS: [&str; 6] = ["sampler", "roulette", "lights", "denoiser", "depth", "clamp"];

/// First and maximum number of samples per pixel, as in the program.
const COUNTS: (u32, u32) = (16, 4096);

/// Error curves: error over the number of samples, by configuration; notebooks show it as a table.
#[pyclass(frozen, module = "trisect")]
pub struct Convergence {
    found: Found,
    /// Report as it is written to files.
    json: String,
    report: Py<PyAny>,
}

#[pymethods]
impl Convergence {
    /// Report as a dict, as ``trisect converge --json`` writes it.
    #[getter]
    fn report(&self, py: Python<'_>) -> Py<PyAny> {
        self.report.clone_ref(py)
    }

    /// List of dicts, one for each number of samples of each configuration, for pandas.DataFrame:
    /// the relative error (a share) and its parts with intervals of 95 %, and the curve's slope (of
    /// log error over log samples), plateau (a share) and verdict.
    #[getter]
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let captures =
            self.found.courses.iter().flat_map(|course| course.captures.iter().map(move |of| (course, of)));
        PyList::new(
            py,
            captures.map(|(course, of)| rows::of_capture(py, course, of)).collect::<PyResult<Vec<_>>>()?,
        )
    }

    /// Reference that errors are measured against, as a dict; None if the measurement ended before
    /// there was one.
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.report.bind(py).get_item("reference")
    }

    /// False if the time limit or an interrupt ended the measurement; the report then has what was
    /// measured by then.
    #[getter]
    fn complete(&self) -> bool {
        self.found.ended.is_none()
    }

    /// Draw the error curves with matplotlib, and return the axes: relative error in percent over
    /// samples per pixel, both logarithmic, with intervals of 95 %, and the slope of noise.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, ax: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("trisect._lab")?.call_method1("plot_convergence", (slf, ax))
    }

    /// Write the report to a .json file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let json = &self.json;
        super::save(py, &path, ".json", |extension| (extension == "json").then(|| Ok(json.clone())))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("trisect._lab")?.call_method1("convergence_html", (slf,))
    }

    fn __str__(&self) -> String {
        let lines: String = self.found.courses.iter().map(|course| course.line() + "\n").collect();
        lines + &self.found.summary()
    }

    fn __repr__(&self) -> String {
        let Found { scene, courses, .. } = &self.found;
        let partial = if self.complete() { "" } else { ", partial" };
        format!("<Convergence of {scene:?}: {} curves{partial}>", courses.len())
    }
}

/// Measure how errors fall with the number of samples, from first to last samples per pixel and
/// doubled each time, as ``trisect converge`` does: noise falls with the root, a bias stays.
///
/// knobs names the options to vary, each compared with the scene's settings: a sequence, or text
/// with commas; by default sampler, roulette, lights, denoiser, depth and clamp. Each number of
/// samples is measured with as many seeds as seeds says, at least 4. time_limit, in seconds or
/// text such as "8m", is shared by the configurations. reference_spp is the maximum mean samples
/// per pixel of the reference, by default eight times last; cache the folder that keeps
/// references. backend, device and threads are those of Renderer, the settings those of
/// Renderer.render. progress is True for a bar, or a callable that receives a LabProgress; an
/// exception that it raises ends the measurement. The interpreter's lock is released meanwhile;
/// Ctrl-C raises MeasurementInterrupted, whose result has the curves so far.
#[pyfunction]
#[pyo3(
    signature = (scene, **options),
    text_signature = "(scene, *, knobs=None, first=16, last=4096, seeds=8, time_limit='8m', reference_spp=None, cache=None, backend='auto', device=None, threads=None, width=None, height=None, depth=None, sampler=None, roulette=None, roulette_depth=None, light_sampling=True, clamp=None, progress=None)"
)]
pub fn converge(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Convergence> {
    let _running = Running::begin()?;
    let _nested = Nested::begin()?;
    let (mut first, mut last) = COUNTS;
    let options = LabOptions::read(scene.get(), "converge", options, |name, value| {
        match name {
            "first" => first = count(name, value)?,
            "last" => last = count(name, value)?,
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    let LabOptions { base, device, mut knobs, seeds, limit, cache, reference_spp, progress, .. } = options;
    if knobs.is_empty() {
        knobs = KNOBS.map(str::to_owned).into();
    }
    let records = Arc::clone(&scene.get().inner);
    let mut watch = Watch::new(limit, progress);
    let result = error::attempted(py, || {
        // Checked before the device is opened.
        ConvergencePlan { configurations: &[], first, last, seeds }.counts()?;
        let device = device.open()?.device;
        let configurations = &configurations_of(&records, &base, &knobs, device.as_ref())?[..];
        let source = ReferenceSource { folder: &cache, max_spp: reference_spp };
        let plan = ConvergencePlan { configurations, first, last, seeds };
        let found = plan.run(&records, device, source, &mut watch)?;
        if found.ended.is_none() {
            watch.complete();
        }
        Ok::<_, Error>(found)
    })?;
    finished(py, watch, result, |found| {
        let json = serde_json::to_string_pretty(&found).map(|text| text + "\n").map_err(|error| {
            let facts = Facts { kind: "Encode", ..Facts::default() };
            error::raise("LabError", error.to_string(), facts)
        })?;
        Ok(Convergence { report: loaded(py, &json)?, found, json })
    })
}
