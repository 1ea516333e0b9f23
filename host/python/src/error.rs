//! Errors of the library as the exceptions of `trisect.errors`.

use crate::lifecycle::Running;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use trisect::device::BackendError;
use trisect::error::{CheckpointError, Error};
use trisect::image::ImageError;
use trisect::scene::SceneError;
use trisect::settings::SettingsError;

/// Facts about an error that its exception has as attributes.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Name of the variant of the library's error.
    pub kind: &'static str,
    /// File that the error is about.
    pub file: Option<String>,
    /// Line and column in the file, from 1 on.
    pub at: Option<(usize, usize)>,
    /// Part of the file or of the arguments, in the format's words.
    pub place: Option<String>,
    /// Remedy.
    pub remedy: Option<String>,
}

/// Python module with the exceptions.
static ERRORS: PyOnceLock<Py<PyModule>> = PyOnceLock::new();

/// Words of the library's messages that have another form in Python.
const WORDS: [(&str, &str); 5] = [
    ("`device::list`", "trisect.devices()"),
    ("`precision::write`", "`trisect check --write`"),
    ("`resume`", "resume=True"),
    ("`checkpoint`", "checkpoint"),
    ("pass `allow_outside`", "pass allow_outside=True"),
];

/// Makes the exception `class` of `trisect.errors`.
pub fn raise(class: &str, message: String, facts: Facts) -> PyErr {
    let message = WORDS.iter().fold(message, |text, (from, to)| text.replace(from, to));
    Python::attach(|py| exception(py, class, &message, facts).unwrap_or_else(|error| error))
}

fn exception(py: Python<'_>, class: &str, message: &str, facts: Facts) -> PyResult<PyErr> {
    let module = ERRORS.get_or_try_init(py, || py.import("trisect.errors").map(Bound::unbind))?;
    let Facts { kind, file, at, place, remedy } = facts;
    let keywords = PyDict::new(py);
    keywords.set_item("kind", kind)?;
    keywords.set_item("file", file)?;
    keywords.set_item("line", at.map(|at| at.0))?;
    keywords.set_item("column", at.map(|at| at.1))?;
    keywords.set_item("place", place)?;
    keywords.set_item("remedy", remedy)?;
    let error = module.bind(py).getattr(class)?.call((message,), Some(&keywords))?;
    Ok(PyErr::from_value(error))
}

/// Calls `call` without the interpreter's lock, and makes an exception of its error or panic.
pub fn guarded<T: Send>(py: Python<'_>, call: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    attempted(py, call)?.map_err(of_library)
}

/// Calls `call` without the interpreter's lock, and makes an exception of its panic. A forked child
/// raises `ForkError` instead.
pub fn attempted<T: Send>(py: Python<'_>, call: impl FnOnce() -> T + Send) -> PyResult<T> {
    let _running = Running::begin()?;
    py.detach(|| catch_unwind(AssertUnwindSafe(call))).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        fault(text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic"))
    })
}

/// Returns the exception of a fault of the library.
fn fault(message: &str) -> PyErr {
    let message = format!("fault of Trisect: {message}; please report it with the call");
    raise("TrisectError", message, Facts { kind: "Fault", ..Facts::default() })
}

/// Returns the exception of an error of the library.
pub fn of_library(error: Error) -> PyErr {
    let message = error.to_string();
    let (class, facts) = match error {
        Error::Scene(error) => ("SceneError", of_scene(error)),
        Error::Write(_) => ("SceneError", Facts { kind: "Write", ..Facts::default() }),
        Error::Settings(error) => ("SettingsError", of_settings(&error)),
        Error::Sampling(_) => ("SettingsError", Facts { kind: "Sampling", ..Facts::default() }),
        Error::Motion(_) => ("SettingsError", Facts { kind: "Motion", ..Facts::default() }),
        Error::Backend(error) => of_backend(error),
        Error::Threads(_) => ("BackendError", Facts { kind: "Threads", ..Facts::default() }),
        Error::Denoise(error) => {
            let class = if error.exit_code() == 3 { "UnavailableError" } else { "DenoiseError" };
            (class, Facts { kind: "Denoise", ..Facts::default() })
        }
        Error::Image(error) => ("ImageError", of_image(error)),
        Error::Conflict(_) => ("ImageError", Facts { kind: "Conflict", ..Facts::default() }),
        Error::Metrics(_) => ("MetricsError", Facts { kind: "Metrics", ..Facts::default() }),
        Error::Film(_) => ("FilmError", Facts { kind: "Film", ..Facts::default() }),
        Error::Checkpoint(error) => ("CheckpointError", of_checkpoint(&error)),
        Error::Cancelled => ("CancelledError", Facts { kind: "Cancelled", ..Facts::default() }),
    };
    raise(class, message, facts)
}

fn text(path: &Path) -> Option<String> {
    Some(path.display().to_string())
}

fn of_scene(error: SceneError) -> Facts {
    let none = Facts::default();
    match error {
        SceneError::Read { path, .. } => Facts { kind: "Read", file: text(&path), ..none },
        SceneError::Invalid { file, line, column, .. } => {
            Facts { kind: "Invalid", file: Some(file), at: Some((line, column)), ..none }
        }
        SceneError::Inconsistent { file, .. } => Facts { kind: "Inconsistent", file: Some(file), ..none },
        SceneError::UnknownFormat { path } => Facts { kind: "UnknownFormat", file: text(&path), ..none },
        SceneError::Denied { file, .. } => Facts { kind: "Denied", file: Some(file), ..none },
        SceneError::Malformed { file, place, remedy, .. } => {
            let (file, place, remedy) = (Some(file), Some(place), Some(remedy));
            Facts { kind: "Malformed", file, place, remedy, ..none }
        }
        SceneError::Unsupported { file, place, remedy, .. } => {
            let (file, place, remedy) = (Some(file), Some(place), Some(remedy));
            Facts { kind: "Unsupported", file, place, remedy, ..none }
        }
        SceneError::TooLarge { file, place, .. } => {
            Facts { kind: "TooLarge", file: Some(file), place: Some(place), ..none }
        }
        SceneError::Outside { file, place, .. } => {
            let remedy = Some("pass allow_outside=True".to_owned());
            Facts { kind: "Outside", file: Some(file), place: Some(place), remedy, ..none }
        }
        SceneError::Resource { file, place, .. } => {
            Facts { kind: "Resource", file: Some(file), place: Some(place), ..none }
        }
    }
}

fn of_settings(error: &SettingsError) -> Facts {
    // The message names the setting in backquotes.
    let message = error.to_string();
    let place = message.split('`').nth(1).map(str::to_owned);
    Facts { kind: "Settings", place, ..Facts::default() }
}

fn of_backend(error: BackendError) -> (&'static str, Facts) {
    let class = if error.is_unavailable() { "UnavailableError" } else { "BackendError" };
    let facts = match error {
        BackendError::Unavailable { backend, remedy, .. } => Facts {
            kind: "Unavailable",
            place: Some(backend.to_owned()),
            remedy: Some(remedy),
            ..Facts::default()
        },
        _ => Facts { kind: "Backend", ..Facts::default() },
    };
    (class, facts)
}

fn of_image(error: ImageError) -> Facts {
    let (kind, path) = match error {
        ImageError::Codec { path, .. } => ("Codec", Some(path)),
        ImageError::UnknownExtension { path } => ("UnknownExtension", Some(path)),
        ImageError::NoLayers { path } => ("NoLayers", Some(path)),
        ImageError::NoAlpha { path, .. } => ("NoAlpha", Some(path)),
        _ => ("Image", None),
    };
    Facts { kind, file: path.as_deref().and_then(text), ..Facts::default() }
}

fn of_checkpoint(error: &CheckpointError) -> Facts {
    let kind = match error {
        CheckpointError::Io { .. } => "Io",
        CheckpointError::NotACheckpoint { .. } => "NotACheckpoint",
        CheckpointError::Format { .. } => "Format",
        CheckpointError::Differs { .. } => "Differs",
        CheckpointError::Film { .. } => "Film",
        CheckpointError::Taken { .. } => "Taken",
        CheckpointError::Exists { .. } => "Exists",
        _ => "Checkpoint",
    };
    let place = match error {
        CheckpointError::Differs { difference, .. } => Some(difference.field.clone()),
        _ => None,
    };
    Facts { kind, file: error.path().and_then(text), place, ..Facts::default() }
}
