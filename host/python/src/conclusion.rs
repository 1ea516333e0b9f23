//! Conclusion of a render: its frame, or the exception that has what was rendered.

use crate::error;
use crate::frame::Frame;
use crate::header::LazyHeader;
use crate::job::{Kept, Rendered};
use crate::layers::FrameLayers;
use crate::observer::Watch;
use crate::options::RenderOptions;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use std::sync::Arc;
use trisect::checkpoint::Saver;
use trisect::film::Film;
use trisect::image::Image;
use trisect::scene::Scene;
use trisect::stats::RenderStats;

/// Facts about a render that its frame has.
pub struct Conclusion<'a> {
    /// Scene of the renderer.
    pub scene: &'a Arc<Scene>,
    /// Settings and samples.
    pub options: &'a RenderOptions,
    /// Header of the film when the render began.
    pub header: &'a LazyHeader,
}

impl Conclusion<'_> {
    /// Returns the frame of a render.
    ///
    /// # Errors
    ///
    /// The exception that ended the render, or that of its checkpoint; they have the frame.
    pub fn of(
        &self,
        py: Python<'_>,
        result: PyResult<Rendered>,
        watch: &mut Watch<'_>,
        Kept { film, unsaved }: Kept,
        saver: Option<&Saver>,
    ) -> PyResult<Frame> {
        let header = match saver {
            Some(saver) => saver.header().into(),
            None => self.header.after(watch.elapsed().as_secs_f64()),
        };
        let header = self.options.request.is_none().then_some(header);
        let has_ended = watch.has_ended();
        let frame = |film: Film, image: Option<Image>, stats: Option<RenderStats>, layers: FrameLayers| {
            let (scene, settings) = (Arc::clone(self.scene), &self.options.settings);
            Frame::new(scene, (film, header.clone()), image, stats, layers, settings, !has_ended)
        };
        let unsaved = unsaved.map(|error| error::of_library(error.into()));
        let rendered = match result {
            Ok(Rendered { film, image, stats, layers }) => Ok(frame(film, image, Some(stats), layers)),
            Err(error) => Err((error, film.filter(|film| !film.is_empty()))),
        };
        let partial = match rendered {
            Ok(frame) if !has_ended => {
                return match unsaved {
                    None => Ok(frame),
                    Some(unsaved) => Err(with_frame(py, unsaved, Some(frame))),
                };
            }
            // Another error than the end that was asked for.
            Err((error, _)) if !has_ended => return Err(caused(py, error, unsaved)),
            Ok(frame) => Some(frame),
            Err((_, film)) => film.map(|film| frame(film, None, None, FrameLayers::default())),
        };
        Err(caused(py, ended(py, watch.raised(), partial), unsaved))
    }
}

/// Returns the exception of a render that was ended: that of a callback or signal handler, else
/// CancelledError. One of Ctrl-C has the frame so far.
fn ended(py: Python<'_>, raised: Option<PyErr>, partial: Option<Frame>) -> PyErr {
    let class = match raised {
        Some(error) if !error.is_instance_of::<PyKeyboardInterrupt>(py) => return error,
        Some(_) => "RenderInterrupted",
        None => "CancelledError",
    };
    let new = || py.import("trisect.errors")?.getattr(class)?.call1(("the render was ended",));
    with_frame(py, new().map_or_else(|error| error, PyErr::from_value), partial)
}

/// Returns the exception with a frame.
fn with_frame(py: Python<'_>, error: PyErr, frame: Option<Frame>) -> PyErr {
    match error.value(py).setattr("frame", frame) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// Returns the exception with its cause, if there is one.
fn caused(py: Python<'_>, error: PyErr, cause: Option<PyErr>) -> PyErr {
    if cause.is_some() {
        error.set_cause(py, cause);
    }
    error
}
