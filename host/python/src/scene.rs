//! Scenes: read, parsed, built of parts, and edited.

use crate::error;
use crate::lifecycle::Running;
use crate::scene_edit::{self, Changes, arrays_of};
use crate::scene_parts::Parts;
use crate::scene_source::{Content, Read, Source, State};
use crate::words::wrong;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};
use std::path::PathBuf;
use std::sync::Arc;
use trisect::error::Error;
use trisect::scene::{CameraChoice, FieldEdit, Includes, LoadOptions, PartName, Rebase, SceneError};
use trisect_lab::tradeoff::RenderCommand;

/// A validated scene. It does not change; :meth:`edit` returns another one.
#[pyclass(frozen, module = "trisect")]
pub struct Scene {
    source: Arc<Source>,
    state: State,
    /// Records of the scene.
    pub inner: Arc<trisect::scene::Scene>,
    /// Space in which the scene is computed.
    pub space: Rebase,
    /// Names of the objects, from object 1 on.
    pub names: Arc<Vec<PartName>>,
}

impl Scene {
    /// Reads the scene of a source in a state, and issues its warnings. `before` is a scene of the
    /// same source.
    fn of(py: Python<'_>, source: Arc<Source>, state: State, before: Option<&Self>) -> PyResult<Self> {
        let _running = Running::begin()?;
        let Read { scene, space, names } = error::guarded(py, || {
            let in_memory = before.and_then(|before| {
                source.read_in_memory(&state, &before.state, (before.space, &before.names))
            });
            Ok(in_memory.unwrap_or_else(|| source.read(&state)).map_err(|error| match before {
                Some(before) => before.with_arrays(&state, error),
                None => error,
            })?)
        })?;
        let known: &[String] = before.map_or(&[], |before| &before.inner.warnings);
        for warning in scene.warnings.iter().filter(|warning| !known.contains(warning)) {
            let category = py.import("trisect.errors")?.getattr("SceneWarning")?;
            let text = format!("{}: {warning}", scene.name);
            py.import("warnings")?.call_method1("warn", (text, category, 1))?;
        }
        Ok(Self { source, state, inner: Arc::new(scene), space, names })
    }

    /// Returns the error of an edit. If that may be of an object that does not exist, the error has
    /// the names of the objects of arrays, which the text does not know.
    fn with_arrays(&self, state: &State, error: SceneError) -> SceneError {
        let is_unknown = |edit: &FieldEdit| match edit.path() {
            [objects, name, ..] if objects == "objects" => {
                name.parse::<usize>().is_err() && !self.names.iter().any(|known| known.object == *name)
            }
            _ => false,
        };
        match (error, arrays_of(&state.parts)) {
            (SceneError::Inconsistent { file, message }, Some(arrays))
                if state.edits.iter().any(is_unknown) =>
            {
                SceneError::Inconsistent { file, message: format!("{message}; {arrays}") }
            }
            (error, _) => error,
        }
    }

    /// Returns the program's command that renders the scene, without settings; `None` for a scene
    /// that is not a file.
    pub fn command(&self) -> Option<RenderCommand> {
        self.source.command(&self.state)
    }
}

#[pymethods]
impl Scene {
    /// Build a scene of parts: see trisect.parts and the stub for the arguments.
    #[new]
    #[pyo3(signature = (**parts), text_signature = "(*, camera, materials, objects=(), lights=(), sky=None, textures=None, media=None, atmosphere=None, portals=(), ground=None, width=640, height=360, spp=64, depth=50, about='')")]
    fn new(py: Python<'_>, parts: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let built = scene_edit::build(py)?.getattr("scene")?.call((), parts)?;
        let (text, arrays): (String, Bound<'_, PyAny>) = built.extract()?;
        let content = Content::Text { text, name: "<built scene>".to_owned() };
        let state = State { edits: Vec::new(), parts: Parts::read(&arrays)? };
        Self::of(py, Source::of(content), state, None)
    }

    /// Read a scene file (.ron), a model (.gltf .glb .obj .ply .stl), or a scene of pbrt (.pbrt) or
    /// Mitsuba (.xml).
    ///
    /// set maps paths of fields to values, as :meth:`edit` takes them; camera is the name or number
    /// of a camera; time the time of an animation in seconds. Warnings are issued as SceneWarning.
    /// Raises SceneError, which names file, line and column.
    #[staticmethod]
    #[pyo3(signature = (path, *, set = None, camera = None, time = None, allow_outside = false))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        set: Option<&Bound<'_, PyDict>>,
        camera: Option<&Bound<'_, PyAny>>,
        time: Option<f64>,
        allow_outside: bool,
    ) -> PyResult<Self> {
        let includes = if allow_outside { Includes::Anywhere } else { Includes::Below };
        let name = path.display().to_string();
        let changes = set.map(|set| Changes::read(set, &Parts::default(), &name)).transpose()?;
        let state =
            changes.map_or_else(State::default, |Changes { parts, fields }| State { edits: fields, parts });
        let mut options = LoadOptions { includes, ..LoadOptions::default() };
        options.model.time = time;
        if let Some(time) = time.filter(|time| !time.is_finite()) {
            let given = pyo3::types::PyFloat::new(py, time);
            return Err(wrong("time", given.as_any(), "it must be a finite number of seconds"));
        }
        let name = camera.map(|camera| camera.str().map(|name| name.to_string())).transpose()?;
        let camera = CameraChoice { name, ..CameraChoice::default() };
        // Another current folder must not lead an edit to another file.
        let path = std::path::absolute(&path).unwrap_or(path);
        Self::of(py, Source::new(Content::File(path), options, camera), state, None)
    }

    /// Read a scene from the text of a scene file; files that it names are relative to the current
    /// folder. name stands for the file in messages.
    #[staticmethod]
    #[pyo3(signature = (text, name = "<text>"))]
    fn parse(py: Python<'_>, text: &str, name: &str) -> PyResult<Self> {
        let content = Content::Text { text: text.to_owned(), name: name.to_owned() };
        Self::of(py, Source::of(content), State::default(), None)
    }

    /// Return the built-in scene, three spheres.
    #[staticmethod]
    fn hello_world(py: Python<'_>) -> PyResult<Self> {
        Self::of(py, Source::of(Content::HelloWorld), State::default(), None)
    }

    /// Return the scene with other values of its fields, such as
    /// ``{"materials.glass.ior": 1.6, "objects.ball.center": (0, 1, 0)}``.
    ///
    /// Paths are those of ``--set``: names of fields and entries, and numbers of list entries from
    /// 0 on, with dots between them. They reach Mesh and Spheres of arrays, too: transform,
    /// material, and the arrays, as in ``{"objects.mesh.transform": matrix}`` and
    /// ``{"objects.balls.centers": array}``; ``textures.NAME`` takes a Texels or its array, and
    /// ``sky`` a Panorama or its array. Raises SceneError for a field that the scene lacks.
    fn edit(&self, py: Python<'_>, changes: &Bound<'_, PyDict>) -> PyResult<Self> {
        self.source.check_editable().map_err(|error| error::of_library(Error::Scene(error)))?;
        let Changes { parts, fields: new } = Changes::read(changes, &self.state.parts, self.name())?;
        let mut edits = self.state.edits.clone();
        // A name decides where later edits lead.
        edits.retain(|old| {
            old.path().last().is_some_and(|field| field == "name")
                || !new.iter().any(|new| new.path() == old.path())
        });
        edits.extend(new);
        Self::of(py, Arc::clone(&self.source), State { edits, parts }, Some(self))
    }

    /// File of the scene, or the name that stands for it.
    #[getter]
    fn name(&self) -> &str {
        &self.inner.name
    }

    /// Warnings about what was left out or changed, and probable mistakes.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings.clone()
    }

    /// Names of the objects, object 1 of the layer "id" first.
    #[getter]
    fn objects(&self) -> Vec<String> {
        self.names.iter().map(|name| name.object.clone()).collect()
    }

    /// Number of primitives: spheres, quads, discs and triangles.
    #[getter]
    fn primitives(&self) -> usize {
        self.inner.primitives()
    }

    /// Width and height of the image, in pixels, that the scene states.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.inner.image.width, self.inner.image.height)
    }

    /// Samples per pixel that the scene states.
    #[getter]
    fn spp(&self) -> u32 {
        self.inner.image.samples
    }

    /// SHA-256 of everything that decides the image, except settings.
    #[getter]
    fn digest(&self, py: Python<'_>) -> PyResult<String> {
        let digest = error::attempted(py, || self.inner.digest())?;
        Ok(digest.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// Bytes of the scene, for another process of the same version.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = error::attempted(py, || self.inner.to_bytes())?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Return the scene of these bytes. It cannot be edited.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        let scene = error::guarded(py, || Ok(trisect::scene::Scene::from_bytes(bytes)?))?;
        let (source, state) = (Source::of(Content::Bytes), State::default());
        let (space, names) = (Rebase::IDENTITY, Arc::default());
        Ok(Self { source, state, inner: Arc::new(scene), space, names })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Restored<'py>)> {
        let restore = PyType::new::<Self>(py).getattr("_restore")?;
        let names = self.names.iter().map(|name| (name.object.clone(), name.material.clone())).collect();
        let space = (self.space.origin.to_array(), self.space.scale);
        Ok((restore, (self.to_bytes(py)?, names, space)))
    }

    /// Return a scene that was pickled.
    #[staticmethod]
    fn _restore(
        py: Python<'_>,
        bytes: &[u8],
        names: Vec<(String, String)>,
        space: ([f64; 3], f64),
    ) -> PyResult<Self> {
        let (origin, scale) = space;
        let names = names.into_iter().map(|(object, material)| PartName { object, material }).collect();
        let space = Rebase { origin: origin.into(), scale };
        Ok(Self { names: Arc::new(names), space, ..Self::from_bytes(py, bytes)? })
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size();
        format!("<Scene {:?}: {} primitives, {width}x{height}>", self.inner.name, self.inner.primitives())
    }
}

/// Arguments of [`Scene::_restore`]: bytes, names of objects and materials, origin and scale.
type Restored<'py> = (Bound<'py, PyBytes>, Vec<(String, String)>, ([f64; 3], f64));
