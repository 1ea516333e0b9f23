//! Evaluation of images of any renderer.

use crate::compare::ImageArgument;
use crate::error::{self, Facts};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use trisect::image::Image;
use trisect_lab::evaluate::{EvaluateError, ImageSet, ReferenceImages, Times, evaluate as evaluated};

/// Measure noise and bias of images of any renderer apart, against a reference.
///
/// images are those of one configuration, at least two, each with a seed of its own; or a dict from
/// names of configurations to their images. reference is one image, whose noise counts as bias, or
/// several, whose own noise is estimated. Each image is a Frame, a float32 array of shape (height,
/// width, 3) with linear radiance, or the path of an .exr, .hdr or .pfm. seconds has the times of
/// the images, or a dict of them by configuration. Returns a dict as ``trisect evaluate --json``
/// writes it: rows has, by configuration, errors with intervals of 95 %, and hdr_flip. Raises
/// LabError.
#[pyfunction]
#[pyo3(signature = (images, reference, *, seconds = None))]
pub fn evaluate<'py>(
    py: Python<'py>,
    images: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    seconds: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut sets = Vec::new();
    match images.cast::<PyDict>() {
        Ok(configurations) => {
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
    let text = py.detach(|| {
        let reference = ReferenceImages::new(reference, &[])?;
        evaluated(&sets, &reference)?.json()
    });
    let text = text.map_err(|error| of_evaluation(&error))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Returns the exception of an evaluation.
fn of_evaluation(error: &EvaluateError) -> PyErr {
    error::raise("LabError", error.to_string(), Facts { kind: "Evaluate", ..Facts::default() })
}

/// Returns whether an argument is one image, not a sequence of them.
fn is_one(argument: &Bound<'_, PyAny>) -> PyResult<bool> {
    let is_path = argument.is_instance_of::<PyString>() || argument.hasattr("__fspath__")?;
    let is_frame = argument.is_instance_of::<crate::frame::Frame>();
    Ok(is_path || is_frame || argument.hasattr("__array_interface__")?)
}

/// Reads one image of a sequence.
fn image(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Image> {
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
    let seconds = seconds.map_or(Ok(Vec::new()), |seconds| seconds.extract::<Vec<f64>>())?;
    let times = Times { seconds, ..Times::default() };
    Ok(ImageSet::new(name, all(name, images)?, times))
}
