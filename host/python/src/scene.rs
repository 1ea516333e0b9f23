//! Scenes: read, parsed, built of parts, and edited.

use crate::error;
use crate::lifecycle::Running;
use crate::scene_parts::Parts;
use crate::words::wrong;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use trisect::error::Error;
use trisect::scene::{
    AnimatedScene, CameraChoice, FieldEdit, Includes, LoadOptions, PartName, Rebase, SceneDocument,
    SceneError,
};
use trisect_lab::tradeoff::RenderCommand;

/// Origin of a scene, from which it is read again for an edit.
#[derive(Debug)]
enum Content {
    File(PathBuf),
    Text {
        text: String,
        name: String,
    },
    HelloWorld,
    /// Bytes of another process, without the text that an edit needs.
    Bytes,
}

/// Origin of a scene with the choices made for it, without edits.
struct Source {
    content: Content,
    parts: Parts,
    options: LoadOptions,
    camera: CameraChoice,
    /// Scene with its files in memory, once an edit has asked for it.
    in_memory: Mutex<Option<AnimatedScene>>,
}

/// Scene with its space and the names of its objects.
struct Read {
    scene: trisect::scene::Scene,
    space: Rebase,
    names: Arc<Vec<PartName>>,
}

impl Source {
    fn new(content: Content, parts: Parts, options: LoadOptions, camera: CameraChoice) -> Arc<Self> {
        Arc::new(Self { content, parts, options, camera, in_memory: Mutex::new(None) })
    }

    /// Reads the scene with edits.
    fn read(&self, edits: &[FieldEdit]) -> Result<Read, SceneError> {
        let document = self.document(edits)?;
        let (space, names) = (document.space, Arc::new(document.part_names()));
        Ok(Read { scene: document.lower(Rebase::IDENTITY)?, space, names })
    }

    /// Returns the scene with edits, after the scene `before`, of the files in memory. `None` where
    /// they would not give what the files give.
    fn read_in_memory(&self, edits: &[FieldEdit], before: &Scene) -> Option<Result<Read, SceneError>> {
        let Self { content, parts, options, camera, in_memory } = self;
        if !parts.is_empty() {
            return None;
        }
        let mut in_memory = in_memory.lock().unwrap_or_else(PoisonError::into_inner);
        if in_memory.is_none() {
            let loaded = match content {
                Content::File(path) => AnimatedScene::load_moving_or_not(path, options),
                Content::Text { text, name } => AnimatedScene::parse(text, name, options),
                Content::HelloWorld => AnimatedScene::hello_world(options),
                Content::Bytes => return None,
            };
            let mut loaded = loaded.ok()?;
            loaded.camera = camera.clone();
            *in_memory = Some(loaded);
        }
        let animated = in_memory.as_mut()?;
        // Without a time, a model that moves has the pose of its file.
        if animated.moves() && options.model.time.is_none() {
            return None;
        }
        let time = options.model.time.unwrap_or(0.0);
        let mut change = || {
            let scene = animated.set_edits(edits.to_vec(), time)?;
            let keeps_names = edits.iter().all(|edit| {
                let path = edit.to_string();
                ["camera", "image", "lights", "materials", "sky"].iter().any(|field| path.starts_with(field))
            });
            if keeps_names && before.edits.is_empty() {
                return Ok(Read { scene, space: before.space, names: Arc::clone(&before.names) });
            }
            let document = animated.document(time)?;
            Ok(Read { scene, space: document.space, names: Arc::new(document.part_names()) })
        };
        Some(change())
    }

    fn document(&self, edits: &[FieldEdit]) -> Result<SceneDocument, SceneError> {
        let Self { content, parts, options, camera, .. } = self;
        let options = &LoadOptions { edits: [&options.edits, edits].concat(), ..options.clone() };
        let mut document = match content {
            Content::File(path) => SceneDocument::load_with(path, options)?,
            Content::Text { text, name } => SceneDocument::parse_with(text, name, options)?,
            Content::HelloWorld => SceneDocument::hello_world_with(options)?,
            Content::Bytes => {
                let message = "it was made of bytes, without its text; edit the scene before".to_owned();
                return Err(SceneError::Inconsistent { file: "the scene".to_owned(), message });
            }
        };
        let is_of_sky = |edit: &FieldEdit| edit.to_string().starts_with("sky");
        if parts.has_sky() && options.edits.iter().any(is_of_sky) {
            let message = "the sky is an array, which edits do not reach; build the scene again";
            return Err(SceneError::Inconsistent { file: document.name, message: message.to_owned() });
        }
        parts.add_to(&mut document.description);
        document.choose_camera(camera)?;
        Ok(document)
    }
}

/// A validated scene. It does not change; :meth:`edit` returns another one.
#[pyclass(frozen, module = "trisect")]
pub struct Scene {
    source: Arc<Source>,
    edits: Vec<FieldEdit>,
    /// Records of the scene.
    pub inner: Arc<trisect::scene::Scene>,
    /// Space in which the scene is computed.
    pub space: Rebase,
    /// Names of the objects, from object 1 on.
    pub names: Arc<Vec<PartName>>,
}

impl Scene {
    /// Reads the scene of a source with edits, and issues its warnings. `before` is a scene of the
    /// same source.
    fn of(
        py: Python<'_>,
        source: Arc<Source>,
        edits: Vec<FieldEdit>,
        before: Option<&Self>,
    ) -> PyResult<Self> {
        let _running = Running::begin()?;
        let Read { scene, space, names } = error::guarded(py, || {
            let in_memory = before.and_then(|before| source.read_in_memory(&edits, before));
            Ok(in_memory.unwrap_or_else(|| source.read(&edits))?)
        })?;
        let module = py.import("trisect.errors")?;
        let category = module.getattr("SceneWarning")?;
        let known: &[String] = before.map_or(&[], |before| &before.inner.warnings);
        for warning in scene.warnings.iter().filter(|warning| !known.contains(warning)) {
            let text = format!("{}: {warning}", scene.name);
            py.import("warnings")?.call_method1("warn", (text, &category, 1))?;
        }
        Ok(Self { source, edits, inner: Arc::new(scene), space, names })
    }

    /// Returns the program's command that renders the scene, without settings; `None` for a scene
    /// that is not a file.
    pub fn command(&self) -> Option<RenderCommand> {
        let Source { content, options, camera, .. } = &*self.source;
        let scene = match content {
            Content::File(path) => Some(path.display().to_string()),
            Content::HelloWorld => None,
            Content::Text { .. } | Content::Bytes => return None,
        };
        let mut given = Vec::new();
        if options.includes == Includes::Anywhere {
            given.push(("--allow-outside".to_owned(), None));
        }
        let time = options.model.time.map(|time| time.to_string());
        let of_load = [("--time", time), ("--camera", camera.name.clone())];
        let edits = self.edits.iter().map(|edit| ("--set", Some(edit.to_string())));
        let all = of_load.into_iter().chain(edits).filter(|(_, value)| value.is_some());
        given.extend(all.map(|(name, value)| (name.to_owned(), value)));
        Some(RenderCommand { scene, options: given })
    }
}

#[pymethods]
impl Scene {
    /// Build a scene of parts: see trisect.parts and the stub for the arguments.
    #[new]
    #[pyo3(signature = (**parts), text_signature = "(*, camera, materials, objects=(), lights=(), sky=None, textures=None, media=None, atmosphere=None, portals=(), ground=None, width=640, height=360, spp=64, depth=50, about='')")]
    fn new(py: Python<'_>, parts: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let module = py.import("trisect._build")?;
        let built = module.getattr("scene")?.call((), parts)?;
        let (text, arrays): (String, Bound<'_, PyAny>) = built.extract()?;
        let content = Content::Text { text, name: "<built scene>".to_owned() };
        let parts = Parts::read(&arrays)?;
        let source = Source::new(content, parts, LoadOptions::default(), CameraChoice::default());
        Self::of(py, source, Vec::new(), None)
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
        let edits = set.map_or(Ok(Vec::new()), edits)?;
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
        let source = Source::new(Content::File(path), Parts::default(), options, camera);
        Self::of(py, source, edits, None)
    }

    /// Read a scene from the text of a scene file; files that it names are relative to the current
    /// folder. name stands for the file in messages.
    #[staticmethod]
    #[pyo3(signature = (text, name = "<text>"))]
    fn parse(py: Python<'_>, text: &str, name: &str) -> PyResult<Self> {
        let content = Content::Text { text: text.to_owned(), name: name.to_owned() };
        let (options, camera) = (LoadOptions::default(), CameraChoice::default());
        Self::of(py, Source::new(content, Parts::default(), options, camera), Vec::new(), None)
    }

    /// Return the built-in scene, three spheres.
    #[staticmethod]
    fn hello_world(py: Python<'_>) -> PyResult<Self> {
        let (options, camera) = (LoadOptions::default(), CameraChoice::default());
        let source = Source::new(Content::HelloWorld, Parts::default(), options, camera);
        Self::of(py, source, Vec::new(), None)
    }

    /// Return the scene with other values of its fields, such as
    /// ``{"materials.glass.ior": 1.6, "objects.ball.center": (0, 1, 0)}``.
    ///
    /// Paths are those of ``--set``: names of fields and entries, and numbers of list entries from
    /// 0 on, with dots between them. Raises SceneError for a field that the scene lacks.
    fn edit(&self, py: Python<'_>, changes: &Bound<'_, PyDict>) -> PyResult<Self> {
        let new = edits(changes)?;
        let mut all = self.edits.clone();
        // A name decides where later edits lead.
        all.retain(|old| {
            path_of(old).ends_with("name") || !new.iter().any(|new| path_of(new) == path_of(old))
        });
        all.extend(new);
        Self::of(py, Arc::clone(&self.source), all, Some(self))
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
        let (options, camera) = (LoadOptions::default(), CameraChoice::default());
        let source = Source::new(Content::Bytes, Parts::default(), options, camera);
        let (space, names) = (Rebase::IDENTITY, Arc::default());
        Ok(Self { source, edits: Vec::new(), inner: Arc::new(scene), space, names })
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

/// Returns the path of an edit, as text.
fn path_of(edit: &FieldEdit) -> String {
    let text = edit.to_string();
    text.split_once('=').map_or_else(String::new, |(path, _)| path.to_owned())
}

/// Returns the edits that a dict states.
fn edits(changes: &Bound<'_, PyDict>) -> PyResult<Vec<FieldEdit>> {
    let value = changes.py().import("trisect._build")?.getattr("value_of_field")?;
    let mut all = Vec::new();
    for (path, change) in changes {
        let path: String = path.extract()?;
        let text: String = value.call1((change, &path))?.extract()?;
        if path.contains('=') && !path.contains('"') {
            let message = format!("{path:?} is not the path of a field, such as \"camera.look_at\"");
            return Err(pyo3::exceptions::PyValueError::new_err(message));
        }
        let edit: Result<FieldEdit, String> = format!("{path}={text}").parse();
        all.push(edit.map_err(|message| {
            let message = SceneError::Inconsistent { file: format!("{path}={text}"), message };
            error::of_library(Error::Scene(message))
        })?);
    }
    Ok(all)
}
