//! Time, noise and bias of each option.

use super::options::{LabOptions, levels};
use super::supervisor::Watch;
use super::{finished, in_words_of_python, loaded, of_measurement, rows};
use crate::error::{self, Facts};
use crate::lifecycle::Running;
use crate::nested::Nested;
use crate::scene::Scene;
use crate::words::{count, wrong};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::Arc;
use trisect_lab::Error;
use trisect_lab::evaluate::ImageFolder;
use trisect_lab::tradeoff::{Pictures, ReferenceSource, Tradeoff as Found, TradeoffPlan, configurations_of};

/// Measured options: time, noise and bias of each; notebooks show it as a table.
#[pyclass(frozen, module = "trisect")]
pub struct Tradeoff {
    found: Found,
    pictures: Pictures,
    report: Py<PyAny>,
}

#[pymethods]
impl Tradeoff {
    /// Report as a dict, as ``trisect tradeoff --json`` writes it.
    #[getter]
    fn report(&self, py: Python<'_>) -> Py<PyAny> {
        self.report.clone_ref(py)
    }

    /// List of dicts, one for each point, for pandas.DataFrame: the columns of tradeoff.csv, the
    /// relative error (a share, with its interval of 95 %), and the command. Times are in seconds.
    #[getter]
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(
            py,
            self.found.points.iter().map(|point| rows::of_point(py, point)).collect::<PyResult<Vec<_>>>()?,
        )
    }

    /// Reference that errors are measured against, as a dict; None if the measurement ended before
    /// there was one.
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.report.bind(py).get_item("reference")
    }

    /// Sentences that say what to use for the scene, and what it costs.
    #[getter]
    fn advice(&self) -> String {
        in_words_of_python(&self.found.advice())
    }

    /// False if the time limit or an interrupt ended the measurement; the report then has what was
    /// measured by then.
    #[getter]
    fn complete(&self) -> bool {
        self.found.ended.is_none()
    }

    /// Draw error over time with matplotlib, and return the axes: relative error in percent over
    /// seconds, both logarithmic, biased points hollow, and a line along the Pareto front.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(slf: &Bound<'py, Self>, ax: Option<&Bound<'py, PyAny>>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("trisect._lab")?.call_method1("plot_tradeoff", (slf, ax))
    }

    /// Write the report to a file: .json, or .html for the page that ``trisect tradeoff`` writes.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let Self { found, pictures, .. } = self;
        super::save(py, &path, ".json or .html", |extension| match extension {
            "json" => Some(found.json()),
            "html" => Some(found.page(pictures)),
            _ => None,
        })
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("trisect._lab")?.call_method1("tradeoff_html", (slf,))
    }

    fn __str__(&self) -> String {
        in_words_of_python(&self.found.summary())
    }

    fn __repr__(&self) -> String {
        let Found { scene, points, .. } = &self.found;
        let partial = if self.complete() { "" } else { ", partial" };
        format!("<Tradeoff of {scene:?}: {} points{partial}>", points.len())
    }
}

/// Measure what options cost and gain: time, noise and bias of the scene's settings, and of these
/// with one option at another value, as ``trisect tradeoff`` does.
///
/// knobs names the options to vary: a sequence, or text with commas; by default all that apply.
/// spp has the numbers of samples per pixel, one or several; by default three, up to max_spp or as
/// many as fit time_limit, which is in seconds or text such as "8m". Each point is rendered with
/// as many seeds as seeds says, at least 4. Images are smaller where the time is too short for the
/// scene's size, unless a size, spp, max_spp or against is given. against is a folder of images of
/// other renderers, as for ``trisect evaluate`` but without a reference: they are measured against
/// the same one, and are in the report as others. reference_spp is the maximum mean samples
/// per pixel of the reference, cache the folder that keeps references. backend, device and threads
/// are those of Renderer, the settings those of Renderer.render. progress is True for a bar, or a
/// callable that receives a LabProgress; an exception that it raises ends the measurement. The
/// interpreter's lock is released meanwhile; Ctrl-C raises MeasurementInterrupted, whose result
/// has the points so far.
#[pyfunction]
#[pyo3(
    signature = (scene, **options),
    text_signature = "(scene, *, knobs=None, spp=None, max_spp=None, against=None, seeds=8, time_limit='8m', reference_spp=None, cache=None, backend='auto', device=None, threads=None, width=None, height=None, depth=None, sampler=None, roulette=None, roulette_depth=None, light_sampling=True, clamp=None, progress=None)"
)]
pub fn tradeoff(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Tradeoff> {
    let _running = Running::begin()?;
    let _nested = Nested::begin()?;
    let (mut spp, mut max_spp, mut against) = (Vec::new(), None, None);
    let options = LabOptions::read(scene.get(), "tradeoff", options, |name, value| {
        match name {
            "spp" => spp = levels(name, value)?,
            "max_spp" => max_spp = Some(count(name, value)?),
            "against" => {
                let folder =
                    value.extract().map_err(|_| wrong(name, value, "it must be the path of a folder"));
                against = Some(folder?);
            }
            _ => return Ok(false),
        }
        Ok(true)
    })?;
    if !spp.is_empty() && max_spp.is_some() {
        let message = "spp and max_spp cannot be combined: each says which numbers of samples are measured";
        let facts = Facts { kind: "Goals", place: Some("max_spp".to_owned()), ..Facts::default() };
        return Err(error::raise("SettingsError", message.to_owned(), facts));
    }
    let LabOptions { base, device, knobs, seeds, limit, cache, reference_spp, has_size, progress, command } =
        options;
    let records = Arc::clone(&scene.get().inner);
    let mut watch = Watch::new(limit, progress);
    // The advice is of the points that one command renders.
    let (command, is_file) = (command.clone().unwrap_or_default(), command.is_some());
    let against: Option<PathBuf> = against;
    let result = error::attempted(py, || {
        let others = against.as_deref().map(ImageFolder::without_reference).transpose()?;
        let device = device.open()?.device;
        let plan = TradeoffPlan {
            configurations: configurations_of(&records, &base, &knobs, device.as_ref())?,
            seeds,
            levels: &spp,
            max_spp,
            may_reduce: !has_size && spp.is_empty() && max_spp.is_none(),
            reference: ReferenceSource { folder: &cache, max_spp: reference_spp },
            command,
            others: others.as_ref(),
        };
        let (mut found, pictures) = plan.run(&records, device, &mut watch)?;
        if found.ended.is_none() {
            watch.complete();
        }
        found.seconds = watch.seconds();
        if !is_file {
            found.points.iter_mut().for_each(|point| point.command = None);
        }
        Ok::<_, Error>((found, pictures))
    })?;
    finished(py, watch, result, |(found, pictures)| {
        let json = found.json().map_err(|error| of_measurement(&error))?;
        Ok(Tradeoff { found, pictures, report: loaded(py, &json)? })
    })
}
