//! NumPy arrays: results without a copy, and arguments that are checked by name.

use numpy::ndarray::{Array2, Array3};
use numpy::{
    Element, IntoPyArray, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Returns an array of shape (height, width, channels), which owns the values.
pub fn channels<'py>(
    py: Python<'py>,
    (height, width, channels): (u32, u32, usize),
    values: Vec<f32>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let shape = (height as usize, width as usize, channels);
    let array = Array3::from_shape_vec(shape, values).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// Returns an array of shape (height, width), which owns the values.
pub fn plane<T: Element>(
    py: Python<'_>,
    (height, width): (u32, u32),
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = (height as usize, width as usize);
    let array = Array2::from_shape_vec(shape, values).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// Returns the rows of an argument: an array of shape (n, `N`) of the type `T`.
///
/// # Errors
///
/// `TypeError` or `ValueError` with the argument's name.
pub fn rows<'py, T: Element + bytemuck::Pod, const N: usize>(
    name: &str,
    argument: &Bound<'py, PyAny>,
) -> PyResult<Vec<[T; N]>> {
    let kind = if T::IS_COPY && std::any::type_name::<T>() == "u32" { "uint32" } else { "float32" };
    let array: PyReadonlyArray2<'py, T> = argument
        .extract()
        .map_err(|_| wrong_type(name, &format!("{kind} array of shape (n, {N})"), argument))?;
    if array.shape()[1] != N {
        let message = format!("{name} has shape {:?}; it must be (n, {N})", array.shape());
        return Err(PyValueError::new_err(message));
    }
    contiguous(name, array.is_c_contiguous() && array.as_slice().is_ok())?;
    let values = array.as_slice().map_err(|e| PyValueError::new_err(e.to_string()))?;
    // The scene owns its meshes: this is the one copy.
    Ok(bytemuck::cast_slice::<T, [T; N]>(values).to_vec())
}

/// Returns the values of an argument: a float32 array of shape (n,).
///
/// # Errors
///
/// `TypeError` or `ValueError` with the argument's name.
pub fn values(name: &str, argument: &Bound<'_, PyAny>) -> PyResult<Vec<f32>> {
    let array: PyReadonlyArray1<'_, f32> =
        argument.extract().map_err(|_| wrong_type(name, "float32 array of shape (n,)", argument))?;
    contiguous(name, array.as_slice().is_ok())?;
    Ok(array.as_slice().map_err(|e| PyValueError::new_err(e.to_string()))?.to_vec())
}

/// Refuses values that are NaN or infinite.
pub fn all_finite(name: &str, values: &[f32]) -> PyResult<()> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => {
            let message = format!("{name} has {} as its value {at}; all must be finite", values[at]);
            Err(PyValueError::new_err(message))
        }
    }
}

/// Refuses an array with gaps between its elements.
pub fn contiguous(name: &str, is_contiguous: bool) -> PyResult<()> {
    let message = format!(
        "{name} is not contiguous in memory, row by row; pass numpy.require({name}, requirements=\"CA\")"
    );
    if is_contiguous { Ok(()) } else { Err(PyValueError::new_err(message)) }
}

/// Returns the error for an argument of another type.
pub fn wrong_type(name: &str, wanted: &str, given: &Bound<'_, PyAny>) -> PyErr {
    let described = || -> PyResult<String> {
        let kind = given.get_type().name()?.to_string();
        if !given.hasattr("dtype")? {
            return Ok(kind);
        }
        Ok(format!("an array of {} with shape {}", given.getattr("dtype")?, given.getattr("shape")?))
    };
    let given = described().unwrap_or_else(|_| "another object".to_owned());
    PyTypeError::new_err(format!("{name} must be a {wanted}, not {given}"))
}
