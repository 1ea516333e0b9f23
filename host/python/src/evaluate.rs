//! Evaluation of images of any renderer.

use crate::compare::ImageArgument;
use crate::error::{self, Facts};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;
use trisect::image::Image;
use trisect::output::Format;
use trisect_lab::evaluate::{
    EvaluateError, ImageSet, ReferenceImages, Times, evaluate as evaluated, evaluate_frames,
};

/// Measure noise and bias of images of any renderer apart, against a reference.
///
/// images are those of one configuration, at least two, each with a seed of its own; or a dict from
/// names of configurations to their images. reference is one image, whose noise counts as bias, or
/// several, whose own noise is estimated. Each image is a Frame, a float32 array of shape (height,
/// width, 3) with linear radiance, or the path of an .exr, .hdr or .pfm. seconds has the times of
/// the images, or a dict of them by configuration. With frames=True images and reference are frames
/// of an animation in their order, each compared with its own reference, and flicker is measured as
/// ``trisect evaluate --frames`` does. Returns a dict as ``trisect evaluate --json``
/// writes it: rows has, by configuration, errors with intervals of 95 %, and hdr_flip. Raises
/// LabError.
#[pyfunction]
#[pyo3(signature = (images, reference, *, seconds = None, frames = false))]
pub fn evaluate<'py>(
    py: Python<'py>,
    images: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    seconds: Option<&Bound<'py, PyAny>>,
    frames: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let mut sets = Vec::new();
    match images.cast::<PyDict>() {
        Ok(configurations) => {
            if let Some(seconds) = seconds {
                check_names(configurations, seconds.cast::<PyDict>()?)?;
            }
            for (name, images) in configurations {
                let times = match seconds {
                    Some(seconds) => seconds.cast::<PyDict>()?.get_item(&name)?,
                    None => None,
                };
                sets.push(set(&name.extract::<String>()?, &images, times.as_ref())?);
            }
        }
        Err(_) => sets.push(set("images", images, seconds)?),
    }
    let reference = match is_one(reference)? {
        true => vec![image("reference", reference)?],
        false => all("reference", reference)?,
    };
    let text = error::attempted(py, || {
        if frames {
            return evaluate_frames(&sets, &reference)?.json();
        }
        let reference = ReferenceImages::new(reference, &[])?;
        evaluated(&sets, &reference)?.json()
    })?;
    let text = text.map_err(|error| of_evaluation(&error))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Checks that times are those of configurations that have images.
fn check_names(configurations: &Bound<'_, PyDict>, seconds: &Bound<'_, PyDict>) -> PyResult<()> {
    for name in seconds.keys() {
        if !configurations.contains(&name)? {
            let message = format!("seconds has {}, and images has not", name.repr()?);
            return Err(pyo3::exceptions::PyValueError::new_err(message));
        }
    }
    Ok(())
}

/// Returns the exception of an evaluation.
fn of_evaluation(error: &EvaluateError) -> PyErr {
    error::raise("LabError", error.to_string(), Facts { kind: "Evaluate", ..Facts::default() })
}

fn is_path(argument: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(argument.is_instance_of::<PyString>() || argument.hasattr("__fspath__")?)
}

/// Returns whether an argument is one image, not a sequence of them. An array of four dimensions is
/// a sequence.
fn is_one(argument: &Bound<'_, PyAny>) -> PyResult<bool> {
    if argument.hasattr("__array_interface__")? {
        return Ok(argument.getattr("ndim")?.extract::<usize>()? != 4);
    }
    Ok(is_path(argument)? || argument.is_instance_of::<crate::frame::Frame>())
}

/// Reads one image of a sequence.
fn image(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Image> {
    let path = argument.extract::<PathBuf>().ok().filter(|_| is_path(argument).unwrap_or(false));
    if let Some(path) = path.filter(|path| Format::of(path).is_ok_and(Format::is_display)) {
        return Err(of_evaluation(&EvaluateError::ForDisplay { path }));
    }
    Ok(match ImageArgument::read(name, argument)? {
        ImageArgument::Image(image) => image,
        array @ ImageArgument::Array(_) => {
            let view = array.view()?;
            Image { width: view.width as u32, height: view.height as u32, pixels: view.pixels.to_vec() }
        }
    })
}

/// Reads a sequence of images.
fn all(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Vec<Image>> {
    if is_one(argument)? {
        return Err(PyTypeError::new_err(format!("{name} must be a sequence of images, not one")));
    }
    let each = argument.try_iter()?.enumerate();
    each.map(|(index, one)| image(&format!("{name}[{index}]"), &one?)).collect()
}

/// Reads the images of a configuration, with their times.
fn set(name: &str, images: &Bound<'_, PyAny>, seconds: Option<&Bound<'_, PyAny>>) -> PyResult<ImageSet> {
    let seconds = match seconds {
        None => Vec::new(),
        Some(seconds) => match seconds.extract::<f64>() {
            Ok(of_each) => vec![of_each],
            Err(_) => seconds.extract::<Vec<f64>>()?,
        },
    };
    let times = Times { seconds, ..Times::default() };
    Ok(ImageSet::new(name, all(name, images)?, times))
}
