//! Keyword arguments of checkpoints and of parts of a render.

use crate::words::{number, time, wrong};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::ops::Range;
use std::path::PathBuf;
use trisect::checkpoint::SaveInterval;

/// File that keeps the film of a render.
pub struct CheckpointOptions {
    /// Path of the file.
    pub path: PathBuf,
    /// Interval between checkpoints.
    pub every: SaveInterval,
    /// True if the render continues a file that exists.
    pub resumes: bool,
}

/// Returns the path of a file.
pub fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    value.extract().map_err(|_| PyTypeError::new_err(format!("{name} must be the path of a file")))
}

/// Returns an interval between checkpoints: a time or a number of samples.
pub fn interval(name: &str, value: &Bound<'_, PyAny>) -> PyResult<SaveInterval> {
    match value.extract::<String>() {
        Ok(text) => {
            text.parse().map_err(|_| wrong(name, value, "write it as \"30s\", \"5m\" or \"1024spp\""))
        }
        Err(_) => Ok(SaveInterval::Time(time(name, value)?)),
    }
}

/// Returns the indices of samples, of which the end is excluded.
pub fn samples(value: &Bound<'_, PyAny>) -> PyResult<Range<u32>> {
    let ends: Option<[Bound<'_, PyAny>; 2]> = value.extract().ok();
    let ends = ends.and_then(|[first, end]| Some(number(&first)?..number(&end)?));
    let remedy = "it must be (first, end): multiples of 256, or the number of samples as the end";
    ends.filter(|samples| !samples.is_empty()).ok_or_else(|| wrong("sample_range", value, remedy))
}
