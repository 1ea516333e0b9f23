//! Callable that receives the progress of a render or a measurement.

use crate::words::wrong;
use pyo3::prelude::*;

/// Callable of the caller, or a bar of this module, which closes at the end.
pub struct ProgressCallback {
    callable: Py<PyAny>,
    is_bar: bool,
}

impl ProgressCallback {
    /// Reads the argument `progress`: a callable, or True for the bar that the function `bar` of
    /// `trisect._progress` makes.
    ///
    /// # Errors
    ///
    /// `SettingsError` for another value.
    pub fn read(value: &Bound<'_, PyAny>, bar: &str) -> PyResult<Option<Self>> {
        match value.extract::<bool>() {
            Ok(false) => Ok(None),
            Ok(true) => {
                let bar = value.py().import("trisect._progress")?.call_method0(bar)?;
                Ok(Some(Self { callable: bar.unbind(), is_bar: true }))
            }
            Err(_) if value.is_callable() => {
                Ok(Some(Self { callable: value.clone().unbind(), is_bar: false }))
            }
            Err(_) => Err(wrong("progress", value, "it must be True, False or a callable")),
        }
    }

    /// Returns the callable.
    pub fn callable(&self) -> &Py<PyAny> {
        &self.callable
    }

    /// Closes the bar, if it is one.
    ///
    /// # Errors
    ///
    /// Those of the bar and of signal handlers.
    pub fn close(mut self, py: Python<'_>) -> PyResult<()> {
        match std::mem::take(&mut self.is_bar) {
            true => self.callable.call_method0(py, "close").map(|_| ()),
            false => Ok(()),
        }
    }
}

/// Closes the bar of a call that ended with another error, which counts more than one of the bar.
impl Drop for ProgressCallback {
    fn drop(&mut self) {
        if self.is_bar {
            Python::try_attach(|py| {
                if let Err(error) = self.callable.call_method0(py, "close") {
                    error.write_unraisable(py, Some(self.callable.bind(py)));
                }
            });
        }
    }
}
