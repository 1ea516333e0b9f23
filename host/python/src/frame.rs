//! Frame: a finished render.

use crate::array::channels;
use crate::error;
use crate::film::Film;
use crate::header::LazyHeader;
use crate::layers::FrameLayers;
use crate::words::{word, wrong};
use numpy::PyArray3;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trisect::image::Image;
use trisect::metadata;
use trisect::output::exposure::{Exposure, LightLevel};
use trisect::output::{BitDepth, Encoding, GAMMA_RANGE, Picture, ToneMap, Transfer, Window, is_stdout};
use trisect::render::{Fingerprint, Settings};
use trisect::scene::Scene;
use trisect::stats::RenderStats;

/// A finished render; notebooks show it as a picture.
#[pyclass(frozen, module = "trisect")]
pub struct Frame {
    scene: Arc<Scene>,
    film: Arc<trisect::film::Film>,
    /// Header of the film's checkpoint; `None` for a render with a goal.
    header: Option<LazyHeader>,
    /// Image that is not the film's: denoised, or the best of a render to a time.
    image: Option<Arc<Image>>,
    stats: Option<RenderStats>,
    layers: FrameLayers,
    settings: Settings,
    is_complete: bool,
}

impl Frame {
    /// Makes the frame of a render with these settings.
    pub fn new(
        scene: Arc<Scene>,
        (film, header): (trisect::film::Film, Option<LazyHeader>),
        image: Option<Image>,
        stats: Option<RenderStats>,
        layers: FrameLayers,
        settings: &Settings,
        is_complete: bool,
    ) -> Self {
        let (film, image) = (Arc::new(film), image.map(Arc::new));
        Self { scene, film, header, image, stats, layers, settings: settings.clone(), is_complete }
    }

    /// Returns the image: the denoised one if there is one, else the mean of the film.
    pub fn shown(&self) -> Image {
        self.image.as_ref().map_or_else(|| self.film.image(), |image| Image::clone(image))
    }

    /// Returns the bytes of an image file.
    fn encoded(
        &self,
        path: &Path,
        (exposure, tone_map): (Exposure, ToneMap),
        encoding: Encoding,
        with_layers: bool,
    ) -> Result<Vec<u8>, trisect::error::Error> {
        tone_map.check(path)?;
        let mut image = self.shown();
        let exposed = exposure.of(&image, path);
        exposed.apply(&mut image);
        let alpha = if self.settings.hidden_sky { self.film.alpha() } else { None };
        tone_map.apply(&mut image, alpha.as_deref());
        let fingerprint = Fingerprint::new(&self.scene.digest(), &self.settings, None);
        let samples = self.film.counts().samples as f64 / self.settings.pixels().max(1) as f64;
        let mut text = metadata::of_image(&self.scene.name, samples, &fingerprint);
        metadata::add_display(&mut text, exposed.stops, tone_map);
        let layers = if with_layers { self.layers.channels() } else { Vec::new() };
        if with_layers {
            text.attributes.clone_from(&self.layers.attributes);
        }
        let window = self.settings.crop.map(Window::from);
        let encoding = Encoding { metadata: text, window, ..encoding };
        Ok(Picture { image: &image, alpha: alpha.as_deref(), layers }.encode(path, &encoding)?)
    }
}

#[pymethods]
impl Frame {
    /// Image: float32, shape (height, width, 3), linear Rec. 709 radiance, top row first. Denoised
    /// if that was asked for or chosen; else the mean of the film.
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = error::attempted(py, || self.shown())?;
        channels(py, (image.height, image.width, 3), image.pixels.into_flattened())
    }

    /// Film with the exact sums of all samples.
    #[getter]
    fn film(&self) -> Film {
        Film { inner: Arc::clone(&self.film), header: self.header.clone() }
    }

    /// Layers that were asked for, by name: float32 of shape (height, width, channels) or (height,
    /// width); "id" and "samples" are uint32.
    #[getter]
    fn aovs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.layers.arrays(py, (self.film.height, self.film.width))
    }

    /// Share of camera rays that hit something: float32, shape (height, width); None unless the
    /// render was transparent, denoised or had layers of first hits.
    #[getter]
    fn alpha<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, numpy::PyArray2<f32>>>> {
        let film = &self.film;
        let Some(alpha) = error::attempted(py, || film.alpha())? else { return Ok(None) };
        crate::array::plane(py, (film.height, film.width), alpha).map(Some)
    }

    /// Statistics of the render, as ``trisect render --stats`` writes them; empty for a partial
    /// frame.
    #[getter]
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = match &self.stats {
            Some(stats) => serde_json::to_string(stats)
                .map_err(|e| pyo3::exceptions::PyValueError::new_err(e.to_string()))?,
            None => "{}".to_owned(),
        };
        py.import("json")?.call_method1("loads", (text,))
    }

    /// False if the render ended before it had all samples.
    #[getter]
    fn complete(&self) -> bool {
        self.is_complete
    }

    /// Write an image file, by extension: .png .jpg .tif for a display; .exr .hdr .pfm hold
    /// radiance, an .exr also the layers.
    ///
    /// exposure is a number of stops, or "auto"; tonemap is "none", "filmic", "agx" or "aces";
    /// gamma replaces the curve of sRGB; bits is 8 or 16; full writes 32-bit floats in an .exr.
    /// Raises ImageError.
    #[allow(clippy::too_many_arguments, reason = "they are keywords")]
    #[pyo3(signature = (path, *, exposure = None, tonemap = None, gamma = None, bits = 8, full = false))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        exposure: Option<&Bound<'_, PyAny>>,
        tonemap: Option<&Bound<'_, PyAny>>,
        gamma: Option<f32>,
        bits: u32,
        full: bool,
    ) -> PyResult<()> {
        if is_stdout(&path) {
            let name = pyo3::types::PyString::new(py, &path.to_string_lossy());
            return Err(wrong("path", name.as_any(), "name a file"));
        }
        let exposure = match exposure {
            None => Exposure::Stops(0.0),
            Some(stops) => match stops.extract::<f32>().ok().filter(|stops| stops.is_finite()) {
                Some(stops) => Exposure::Stops(stops),
                None => word("exposure", stops, &[("auto", Exposure::Automatic(LightLevel::Unit))])?,
            },
        };
        let tone_map = tonemap.map_or(Ok(ToneMap::None), |name| word("tonemap", name, &ToneMap::ALL))?;
        let transfer = match gamma {
            None => Transfer::Srgb,
            Some(gamma) if GAMMA_RANGE.contains(&gamma) => Transfer::Gamma(gamma),
            Some(gamma) => {
                let given = pyo3::types::PyFloat::new(py, f64::from(gamma));
                return Err(wrong("gamma", given.as_any(), "it must be from 0.1 to 10"));
            }
        };
        let bits = match bits {
            8 => BitDepth::Eight,
            16 => BitDepth::Sixteen,
            _ => return Err(wrong("bits", pyo3::types::PyInt::new(py, bits).as_any(), "it must be 8 or 16")),
        };
        let encoding = Encoding { bits, transfer, half: !full, ..Encoding::default() };
        error::guarded(py, || {
            let with_layers = path.extension().is_some_and(|of| of.eq_ignore_ascii_case("exr"));
            let bytes = self.encoded(&path, (exposure, tone_map), encoding, with_layers)?;
            Ok(trisect::output::write_file(&path, &bytes)?)
        })
    }

    /// Picture for notebooks, with an automatic exposure unless the image fits a display.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let display = (Exposure::Automatic(LightLevel::Unit), ToneMap::None);
        let bytes =
            error::guarded(py, || self.encoded(Path::new("a.png"), display, Encoding::default(), false))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __repr__(&self) -> String {
        let partial = if self.is_complete { "" } else { ", partial" };
        format!("<Frame: {}x{}{partial}>", self.film.width, self.film.height)
    }
}
