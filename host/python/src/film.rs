//! Film: exact sums of samples.

use crate::array::{channels, plane};
use crate::error;
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use std::sync::Arc;

/// Exact sums of samples. `a + b` adds films of disjoint samples, in any order, to the same bits.
#[pyclass(frozen, module = "trisect")]
pub struct Film {
    /// Film of the library.
    pub inner: Arc<trisect::film::Film>,
}

#[pymethods]
impl Film {
    /// Mean radiance by pixel: float32, shape (height, width, 3), linear Rec. 709, top row first;
    /// NaN without samples.
    #[getter]
    fn mean<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let film = &self.inner;
        let image = error::attempted(py, || film.image())?;
        channels(py, (film.height, film.width, 3), image.pixels.into_flattened())
    }

    /// Estimated variance of the mean: float32, shape (height, width, 3); infinite with one sample,
    /// NaN without.
    #[getter]
    fn variance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let film = &self.inner;
        let variance = |pixel: trisect::film::PixelTotals| match pixel.samples {
            0 => [f32::NAN; 3],
            1 => [f32::INFINITY; 3],
            _ => pixel.variance_of_mean().map(|value| value as f32),
        };
        let values = error::attempted(py, || film.pixels.map(variance).into_flattened())?;
        channels(py, (film.height, film.width, 3), values)
    }

    /// Number of samples by pixel: uint32, shape (height, width).
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let film = &self.inner;
        let count = |pixel: trisect::film::PixelTotals| u32::try_from(pixel.samples).unwrap_or(u32::MAX);
        let values = error::attempted(py, || film.pixels.map(count))?;
        plane(py, (film.height, film.width), values)
    }

    /// Number of NaN and infinite samples, which are left out of the sums.
    #[getter]
    fn rejected(&self, py: Python<'_>) -> PyResult<u64> {
        error::attempted(py, || self.inner.counts().rejected)
    }

    /// Columns of the image.
    #[getter]
    fn width(&self) -> u32 {
        self.inner.width
    }

    /// Rows of the image.
    #[getter]
    fn height(&self) -> u32 {
        self.inner.height
    }

    fn __add__(&self, py: Python<'_>, other: &Self) -> PyResult<Self> {
        let (first, second) = (&self.inner, &other.inner);
        let sum = error::guarded(py, || {
            let mut sum = trisect::film::Film::clone(first);
            sum.add(second)?;
            Ok(sum)
        })?;
        Ok(Self { inner: Arc::new(sum) })
    }

    fn __eq__(&self, py: Python<'_>, other: &Self) -> PyResult<bool> {
        error::attempted(py, || self.inner == other.inner)
    }

    fn __repr__(&self) -> String {
        format!("<Film: {}x{}>", self.inner.width, self.inner.height)
    }
}
