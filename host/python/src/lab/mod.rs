//! Measurements of the trade-off lab: what options cost and gain, and how errors fall.

pub mod converge;
mod options;
mod rows;
mod supervisor;
pub mod tradeoff;

pub use supervisor::LabProgress;

use crate::error::{self, Facts};
use crate::words::wrong;
use pyo3::PyClass;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::path::Path;
use supervisor::Watch;
use trisect::output::{is_stdout, write_file};
use trisect_lab::Error;
use trisect_lab::tradeoff::TradeoffError;

/// Words of the lab's texts that have another form in Python.
const WORDS: [(&str, &str); 5] = [
    ("(--levels)", "(spp)"),
    ("(--time-limit)", "(time_limit)"),
    ("a smaller --resolution", "a smaller size (width, height)"),
    ("name a --resolution", "name width and height"),
    ("`resolution` names another", "width and height name another"),
];

/// Returns a text of the lab in the words of Python.
fn in_words_of_python(text: &str) -> String {
    WORDS.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

/// Returns the exception of an error of the lab.
fn of_lab(error: Error) -> PyErr {
    match error {
        Error::Render(error) => error::of_library(error),
        Error::Tradeoff(error) => of_measurement(&error),
        other => error::raise("LabError", other.to_string(), Facts { kind: "Lab", ..Facts::default() }),
    }
}

fn of_measurement(error: &TradeoffError) -> PyErr {
    let file = |path: &Path| Some(path.display().to_string());
    let none = Facts::default();
    let of = |name: &str| Some(name.to_owned());
    let (class, facts) = match error {
        TradeoffError::NoKnob { known, .. } => {
            let remedy = Some(format!("available: {known}"));
            ("SettingsError", Facts { kind: "NoKnob", place: of("knobs"), remedy, ..none })
        }
        TradeoffError::TooFew { what, least, .. } => {
            let remedy = Some(format!("it must be at least {least}"));
            let place = what.strip_prefix('`').and_then(|what| what.strip_suffix('`')).and_then(of);
            ("SettingsError", Facts { kind: "TooFew", place, remedy, ..none })
        }
        TradeoffError::NoCache => {
            let remedy = of("name a folder with cache, or set XDG_CACHE_HOME");
            ("SettingsError", Facts { kind: "NoCache", place: of("cache"), remedy, ..none })
        }
        TradeoffError::Cache { path, .. } => {
            let remedy = of("name another folder by cache");
            ("LabError", Facts { kind: "Cache", file: file(path), place: of("cache"), remedy, ..none })
        }
        TradeoffError::Reference { path, .. } => {
            let remedy = of("remove the file, and the reference is rendered again");
            ("LabError", Facts { kind: "Reference", file: file(path), remedy, ..none })
        }
        TradeoffError::Io { path, .. } => ("LabError", Facts { kind: "Io", file: file(path), ..none }),
        TradeoffError::Encode { path, .. } => {
            ("LabError", Facts { kind: "Encode", file: file(path), ..none })
        }
    };
    error::raise(class, error.to_string(), facts)
}

/// Returns the result of a measurement, or the exception that ended it: that of a callback or
/// signal handler, else `CancelledError`. One of Ctrl-C has the result so far.
fn finished<T, R>(
    py: Python<'_>,
    watch: Watch,
    result: Result<T, Error>,
    wrap: impl FnOnce(T) -> PyResult<R>,
) -> PyResult<R>
where
    R: PyClass + Into<PyClassInitializer<R>>,
{
    let Some(raised) = watch.end() else { return result.map_err(of_lab).and_then(wrap) };
    let class = match &raised {
        Some(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) => "MeasurementInterrupted",
        None => "CancelledError",
        Some(_) => return Err(raised.unwrap_or_else(|| PyErr::fetch(py))),
    };
    let partial = result.ok().map(wrap).transpose()?.map(|partial| Py::new(py, partial)).transpose()?;
    let error = py.import("trisect.errors")?.getattr(class)?.call1(("the measurement was ended",))?;
    error.setattr("result", partial)?;
    Err(PyErr::from_value(error))
}

/// Returns the value of a JSON text.
fn loaded(py: Python<'_>, text: &str) -> PyResult<Py<PyAny>> {
    Ok(py.import("json")?.call_method1("loads", (text,))?.unbind())
}

/// Writes a report to a file. `text` makes its content by the extension of the file's name, and
/// returns `None` for an unknown one.
fn save(
    py: Python<'_>,
    path: &Path,
    extensions: &str,
    text: impl FnOnce(&str) -> Option<Result<String, TradeoffError>> + Send,
) -> PyResult<()> {
    let name = pyo3::types::PyString::new(py, &path.to_string_lossy());
    if is_stdout(path) {
        return Err(wrong("path", name.as_any(), "name a file"));
    }
    let extension = path.extension().map(|of| of.to_string_lossy().to_lowercase()).unwrap_or_default();
    let Some(text) = error::attempted(py, || text(&extension))? else {
        return Err(wrong("path", name.as_any(), &format!("its name must end in {extensions}")));
    };
    let text = text.map_err(|error| of_measurement(&error))?;
    error::guarded(py, || Ok(write_file(path, text.as_bytes())?))
}
