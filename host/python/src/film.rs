//! Film: exact sums of samples.

use crate::array::{channels, plane};
use crate::error::{self, Facts};
use crate::header::LazyHeader;
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trisect::checkpoint::{self, Checkpoint, CheckpointError};
use trisect::error::Error;

/// Exact sums of samples. `a + b` adds films of one image with disjoint samples, in any order, to
/// the same bits.
#[pyclass(frozen, module = "trisect")]
pub struct Film {
    /// Film of the library.
    pub inner: Arc<trisect::film::Film>,
    /// Header of its checkpoint; `None` for a film of a render with a goal, which has none.
    pub header: Option<LazyHeader>,
}

impl Film {
    /// Returns the header.
    ///
    /// # Errors
    ///
    /// `CheckpointError` for a film that has none.
    fn header(&self) -> PyResult<&LazyHeader> {
        self.header.as_ref().ok_or_else(|| {
            let message = "a film of a render with budget or target_error has no checkpoint, because its samples depend \
                on all earlier ones; render with spp";
            error::raise("CheckpointError", message.to_owned(), Facts { kind: "Goal", ..Facts::default() })
        })
    }
}

impl From<Checkpoint> for Film {
    fn from(Checkpoint { header, film }: Checkpoint) -> Self {
        Self { inner: Arc::new(film), header: Some(header.into()) }
    }
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

    /// Write the film as a checkpoint, which render(checkpoint=..., resume=True), merge() and the
    /// program's ``trisect merge`` read. An earlier file is replaced once this one is complete.
    /// Raises CheckpointError.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let header = self.header()?;
        error::guarded(py, || Ok(checkpoint::write(&path, &header.get(), &self.inner)?))
    }

    /// Read the film of a checkpoint, of Python or of the program. Raises CheckpointError.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        error::guarded(py, || Ok(Checkpoint::read(&path)?)).map(Self::from)
    }

    fn __add__(&self, py: Python<'_>, other: &Self) -> PyResult<Self> {
        let headers = self.header.as_ref().zip(other.header.as_ref());
        let sum = error::guarded(py, || {
            let film = trisect::film::Film::clone(&self.inner);
            let Some((header, of_other)) = headers else {
                let mut film = film;
                film.add(&other.inner)?;
                return Ok(Ok((film, None)));
            };
            let mut sum = Checkpoint { header: header.get(), film };
            match sum.merge_film(Path::new(""), &of_other.get(), &other.inner) {
                Ok(()) => Ok(Ok((sum.film, Some(sum.header)))),
                Err(CheckpointError::Film { source, .. }) => Err(source.into()),
                Err(CheckpointError::Differs { difference, .. }) => Ok(Err(difference)),
                Err(error) => Err(error.into()),
            }
        })?;
        let (film, header) = sum.map_err(|of| {
            let message = format!(
                "{} is {} in one film, but {} in the other; only films of one image can be added",
                of.field, of.one, of.other
            );
            error::raise("FilmError", message, Facts { kind: "Differs", ..Facts::default() })
        })?;
        Ok(Self { inner: Arc::new(film), header: header.map(LazyHeader::from) })
    }

    fn __eq__(&self, py: Python<'_>, other: &Self) -> PyResult<bool> {
        error::attempted(py, || self.inner == other.inner)
    }

    fn __repr__(&self) -> String {
        format!("<Film: {}x{}>", self.inner.width, self.inner.height)
    }
}

/// A film among those that are merged.
enum Item {
    Film(Arc<trisect::film::Film>, LazyHeader),
    File(PathBuf),
}

/// Add films of one image with disjoint samples, each a Film or the path of a checkpoint, to the
/// film of all, in any order to the same bits.
///
/// Films of one image have the same scene and settings, the seed among them; parts are rendered by
/// sample_range. Raises CheckpointError, with the file, for another image or samples of two films.
#[pyfunction]
pub fn merge(py: Python<'_>, films: &Bound<'_, PyAny>) -> PyResult<Film> {
    let wrong = || PyTypeError::new_err("films must be a sequence of films and of paths of checkpoints");
    if films.is_instance_of::<PyString>() || films.hasattr("__fspath__")? {
        return Err(wrong());
    }
    let mut items = Vec::new();
    for item in films.try_iter().map_err(|_| wrong())? {
        let item = item?;
        items.push(match item.cast::<Film>() {
            Ok(film) => Item::Film(Arc::clone(&film.get().inner), film.get().header()?.clone()),
            Err(_) => Item::File(item.extract().map_err(|_| wrong())?),
        });
    }
    let Some((first, others)) = items.split_first() else {
        return Err(PyValueError::new_err("films is empty; merge at least one"));
    };
    error::guarded(py, || sum(first, others)).map(Film::from)
}

/// Returns the sum of a film and others, the first of which has the number 1 in errors.
fn sum(first: &Item, others: &[Item]) -> Result<Checkpoint, Error> {
    let mut sum = match first {
        Item::File(path) => Checkpoint::read(path)?,
        Item::Film(film, header) => {
            Checkpoint { header: header.get(), film: trisect::film::Film::clone(film) }
        }
    };
    for (index, item) in (1..).zip(others) {
        match item {
            Item::File(path) => sum.merge(path, &Checkpoint::read(path)?)?,
            Item::Film(film, header) => {
                sum.merge_film(Path::new(&format!("films[{index}]")), &header.get(), film)?;
            }
        }
    }
    Ok(sum)
}
