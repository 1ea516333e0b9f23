//! Images of files, and differences of two images.

use crate::array::{channels, contiguous, plane, wrong_type};
use crate::error;
use crate::frame::Frame;
use numpy::{PyArray3, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use trisect::image::Image;
use trisect::metrics::{ImageView, compare_with_map};

/// Image that an argument names or holds.
pub enum ImageArgument<'py> {
    /// Array of the caller, in whose memory it is read.
    Array(PyReadonlyArray3<'py, f32>),
    /// Image of a frame or a file.
    Image(Image),
}

impl<'py> ImageArgument<'py> {
    /// Reads an argument: a frame, an array of shape (height, width, 3), or the path of a file.
    ///
    /// # Errors
    ///
    /// `TypeError` or `ValueError` with the argument's name; `ImageError` for a file.
    pub fn read(name: &str, argument: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(frame) = argument.cast::<Frame>() {
            let frame = frame.get();
            return error::attempted(argument.py(), || frame.shown()).map(Self::Image);
        }
        if argument.hasattr("__array_interface__")? {
            let array: PyReadonlyArray3<'py, f32> = argument
                .extract()
                .map_err(|_| wrong_type(name, "float32 array of shape (height, width, 3)", argument))?;
            if array.shape()[2] != 3 {
                let message = format!("{name} has shape {:?}; it must be (height, width, 3)", array.shape());
                return Err(PyValueError::new_err(message));
            }
            contiguous(name, array.is_c_contiguous() && array.as_slice().is_ok())?;
            return Ok(Self::Array(array));
        }
        let Ok(path) = argument.extract::<PathBuf>() else {
            return Err(wrong_type(
                name,
                "frame, float32 array of shape (height, width, 3) or path",
                argument,
            ));
        };
        error::guarded(argument.py(), || Ok(Image::read(&path)?)).map(Self::Image)
    }

    /// Returns the image for a comparison.
    ///
    /// # Errors
    ///
    /// `MetricsError` for an image without pixels.
    pub fn view(&self) -> PyResult<ImageView<'_>> {
        let view = match self {
            Self::Image(image) => ImageView::new(image.width as usize, image.height as usize, &image.pixels),
            Self::Array(array) => {
                let pixels = array.as_slice().map_err(|e| PyValueError::new_err(e.to_string()))?;
                ImageView::new(array.shape()[1], array.shape()[0], bytemuck::cast_slice(pixels))
            }
        };
        view.map_err(|error| error::of_library(error.into()))
    }
}

/// Read an image file as linear radiance: float32, shape (height, width, 3), top row first.
///
/// Formats: .png .jpg .tif (decoded from sRGB), .exr .hdr .pfm. Raises ImageError.
#[pyfunction]
pub fn read_image(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let image = error::guarded(py, || Ok(Image::read(&path)?))?;
    channels(py, (image.height, image.width, 3), image.pixels.into_flattened())
}

/// Measure the difference of an image from a reference.
///
/// Each is a Frame, a float32 array of shape (height, width, 3) with linear radiance, or the path
/// of an image. Returns a dict with rmse, rel_mse, psnr_db, flip_mean, max_difference, max_pixel,
/// mean_a, mean_b and non_finite; with flip_map=True also flip_map, float32 of shape (height,
/// width). Raises MetricsError if the sizes differ.
#[pyfunction]
#[pyo3(signature = (image, reference, *, flip_map = false))]
pub fn compare<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    flip_map: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let image = ImageArgument::read("image", image)?;
    let reference = ImageArgument::read("reference", reference)?;
    let (a, b) = (image.view()?, reference.view()?);
    let (comparison, map) = error::guarded(py, || Ok(compare_with_map(&a, &b)?))?;
    let dict = PyDict::new(py);
    dict.set_item("rmse", comparison.rmse)?;
    dict.set_item("rel_mse", comparison.rel_mse)?;
    dict.set_item("psnr_db", comparison.psnr_db)?;
    dict.set_item("flip_mean", comparison.flip_mean)?;
    dict.set_item("max_difference", comparison.max_difference)?;
    dict.set_item("max_pixel", comparison.max_pixel)?;
    dict.set_item("mean_a", comparison.mean_a)?;
    dict.set_item("mean_b", comparison.mean_b)?;
    dict.set_item("non_finite", comparison.non_finite)?;
    if flip_map {
        dict.set_item("flip_map", plane(py, (map.height as u32, map.width as u32), map.errors)?)?;
    }
    Ok(dict)
}
