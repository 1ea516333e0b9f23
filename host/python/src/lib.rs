//! Python module of Trisect: scenes, renders and measurements, with NumPy arrays.
//!
//! The classes hold the library's types. Python code of the package, in `python/trisect`, has the
//! exceptions, the parts of which scenes are built, and what only notebooks need.

mod array;
mod array_image;
mod array_object;
mod checkpoint_options;
mod checkpoints;
mod compare;
mod conclusion;
mod device;
mod error;
mod evaluate;
mod film;
mod frame;
mod header;
mod image_options;
mod job;
mod lab;
mod layers;
mod lifecycle;
mod nested;
mod observer;
mod options;
mod progress_callback;
mod ranks;
mod renderer;
mod scene;
mod scene_edit;
mod scene_parts;
mod scene_source;
mod words;

use pyo3::prelude::*;

/// Compiled part of the package `trisect`.
#[pymodule]
mod _trisect {
    #[pymodule_export]
    use super::compare::{compare, read_image};
    #[pymodule_export]
    use super::device::devices;
    #[pymodule_export]
    use super::evaluate::evaluate;
    #[pymodule_export]
    use super::film::{Film, merge};
    #[pymodule_export]
    use super::frame::Frame;
    #[pymodule_export]
    use super::lab::LabProgress;
    #[pymodule_export]
    use super::lab::converge::{Convergence, converge};
    #[pymodule_export]
    use super::lab::tradeoff::{Tradeoff, tradeoff};
    #[pymodule_export]
    use super::observer::Progress;
    #[pymodule_export]
    use super::renderer::Renderer;
    #[pymodule_export]
    use super::scene::Scene;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn start(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        super::lifecycle::register(module)
    }
}
