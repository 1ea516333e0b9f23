//! Words, numbers, times and shares among the arguments of Python.

use crate::error::{self, Facts};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyBool;
use std::time::Duration;
use trisect::time::parse_time;

/// Returns the error for the value of an argument.
pub fn wrong(name: &str, given: &Bound<'_, PyAny>, remedy: &str) -> PyErr {
    let given = given.repr().map_or_else(|_| "the value".to_owned(), |text| text.to_string());
    let message = format!("{name} is {given}; {remedy}");
    let (place, remedy) = (Some(name.to_owned()), Some(remedy.to_owned()));
    error::raise("SettingsError", message, Facts { kind: "Value", place, remedy, ..Facts::default() })
}

/// Returns the meaning of a word.
///
/// # Errors
///
/// `SettingsError`, which lists the words, for any other; `TypeError` for what is no text.
pub fn word<T: Copy>(name: &str, given: &Bound<'_, PyAny>, words: &[(&str, T)]) -> PyResult<T> {
    let names: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
    let text: String = given
        .extract()
        .map_err(|_| PyTypeError::new_err(format!("{name} must be one of {}", names.join(", "))))?;
    let found = words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning);
    found.ok_or_else(|| wrong(name, given, &format!("it must be one of {}", names.join(", "))))
}

/// Returns a number, and an error for a bool.
fn real(given: &Bound<'_, PyAny>) -> PyResult<f64> {
    match given.is_instance_of::<PyBool>() {
        true => Err(PyTypeError::new_err("a bool")),
        false => given.extract(),
    }
}

/// Returns a time: seconds as a number, or text such as "2s" and "5m".
pub fn time(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Duration> {
    let parsed = match real(given) {
        Ok(seconds) => Duration::try_from_secs_f64(seconds).ok(),
        Err(_) => given.extract::<String>().ok().and_then(|text| parse_time(&text).ok()),
    };
    let remedy = "write it as seconds, or as \"500ms\", \"10s\", \"1.5m\" or \"2h\"";
    parsed.filter(|time| *time > Duration::ZERO).ok_or_else(|| wrong(name, given, remedy))
}

/// Returns a share: a fraction such as 0.01, or text such as "1%".
pub fn share(name: &str, given: &Bound<'_, PyAny>) -> PyResult<f64> {
    let parsed = match real(given) {
        Ok(share) => Some(share),
        Err(_) => given.extract::<String>().ok().and_then(|text| {
            text.strip_suffix('%').and_then(|percent| Some(percent.trim().parse::<f64>().ok()? / 100.0))
        }),
    };
    let remedy = "write it as a fraction such as 0.01, or as \"1%\", above 0 and below 1";
    parsed.filter(|share| *share > 0.0 && *share < 1.0).ok_or_else(|| wrong(name, given, remedy))
}

/// Returns a whole number, and `None` for a bool.
pub fn number(value: &Bound<'_, PyAny>) -> Option<u32> {
    if value.is_instance_of::<PyBool>() { None } else { value.extract().ok() }
}

/// Returns a whole number of at least 1.
pub fn count(name: &str, value: &Bound<'_, PyAny>) -> PyResult<u32> {
    let number: Option<u32> = number(value).filter(|number| *number > 0);
    number.ok_or_else(|| wrong(name, value, "it must be a whole number from 1 to 4294967295"))
}

/// Returns a bool.
pub fn flag(name: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    value.extract().map_err(|_| wrong(name, value, "it must be True or False"))
}
