//! A scene that was read: in f64, and what to render of it.

use super::description::{Description, TextureImage};
use super::import::{Folder, Includes};
use super::resolve::{self, Loader};
use super::{Rebase, Scene, SceneError, format, import, lower, model, warnings};
use crate::image::{Image, ImageError};
use crate::input;
use crate::render::{Fresnel, MathMode, Sampler, Settings};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The scene that `trisect render` draws when none is named: that of `scenes`, which a published crate does not have.
const HELLO_WORLD: &str = include_str!("../../assets/three_spheres.ron");

/// What to render unless the command line says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples a pixel.
    pub samples: u32,
    /// Segments a path, at most.
    pub depth: u32,
    /// How dielectrics reflect.
    pub fresnel: Fresnel,
}

impl ImageSettings {
    /// With the program's defaults for what no file says.
    pub fn settings(&self) -> Settings {
        Settings {
            width: self.width,
            height: self.height,
            samples: self.samples,
            depth: self.depth,
            seed: 0,
            roulette: false,
            roulette_depth: 1,
            fresnel: self.fresnel,
            math: MathMode::Precise,
            sampler: Sampler::Independent,
            light_sampling: true,
            traversal: None,
            schedule: None,
            tile: None,
            clamp: None,
            guides: false,
            variant: None,
        }
    }
}

/// A scene as its author describes it, before anything is rounded to f32. [`Self::lower`] makes a [`Scene`] of it.
#[derive(Clone, Debug)]
pub struct SceneDocument {
    /// Where it came from, for messages.
    pub name: String,
    /// What there is, in the scene's own units; the first camera is the one to use.
    pub description: Description,
    /// What to render unless told otherwise.
    pub image: ImageSettings,
    /// Where the file asks to compute.
    pub space: Rebase,
    /// What was decided about a model by itself, for people.
    pub notes: Vec<String>,
}

/// Reads the files that a scene in this folder names from the file system.
struct FromDisk<'a>(&'a Folder);

impl Loader for FromDisk<'_> {
    fn model(&mut self, path: &Path) -> Result<Description, SceneError> {
        import::load_below(path, self.0)
    }

    fn panorama(&mut self, path: &Path) -> Result<Image, SceneError> {
        Image::read(path).map_err(|error| match error {
            ImageError::Io { path, source } => SceneError::Read { path, source },
            ImageError::Codec { message, .. } => {
                SceneError::Inconsistent { file: path.display().to_string(), message }
            }
            other => {
                let (file, text) = (path.display().to_string(), other.to_string());
                let message = text.strip_prefix(&format!("{file}: ")).unwrap_or(&text).to_owned();
                SceneError::Inconsistent { file, message }
            }
        })
    }

    fn texture(&mut self, path: &Path, linear: bool) -> Result<TextureImage, SceneError> {
        import::texture(path, linear)
    }
}

impl SceneDocument {
    /// Reads a scene file, or a model; see [`Scene::load`].
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_including(path, Includes::Below)
    }

    /// Reads a scene file, or a model, that may name such files.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the file and the place.
    pub fn load_including(path: &Path, includes: Includes) -> Result<Self, SceneError> {
        let name = path.display().to_string();
        let folder = Folder::of(path).including(includes);
        if import::is_model(path) {
            return Self::from_model(import::load_below(path, &folder)?, &name);
        }
        // A pipe has no extension.
        if path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("ron")) {
            return Err(SceneError::UnknownFormat { path: path.to_owned() });
        }
        let text =
            input::read_text(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        Self::read(&text, &name, &folder)
    }

    /// Reads a scene from text; see [`Scene::parse`].
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        Self::parse_including(text, name, Includes::Below)
    }

    /// Reads a scene from text, which may name such files, relative to the current folder.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the place.
    pub fn parse_including(text: &str, name: &str, includes: Includes) -> Result<Self, SceneError> {
        Self::read(text, name, &Folder::new("".into()).including(includes))
    }

    /// The built-in scene; see [`Scene::hello_world`].
    pub fn hello_world() -> Result<Self, SceneError> {
        Self::parse(HELLO_WORLD, "scenes/three_spheres.ron (built in)")
    }

    /// A model with what it lacks to be seen; see [`Scene::from_model`].
    pub fn from_model(model: Description, name: &str) -> Result<Self, SceneError> {
        let refused = |message| SceneError::Inconsistent { file: name.to_owned(), message };
        lower::check_memory(&model).map_err(refused)?;
        let model::Completed { description, image, notes } = model::complete(model);
        Ok(Self { name: name.to_owned(), description, image, space: Rebase::IDENTITY, notes })
    }

    fn read(text: &str, name: &str, folder: &Folder) -> Result<Self, SceneError> {
        let file = format::parse(text, name)?;
        let (description, image) = resolve::describe(&file, folder, &mut FromDisk(folder))?;
        let notes = Vec::new();
        Ok(Self { name: name.to_owned(), description, image, space: file.space.space, notes })
    }

    /// What to render unless told otherwise, with the program's defaults for what no file says.
    pub fn settings(&self) -> Settings {
        self.image.settings()
    }

    /// Returns what was left out or changed as it was read, and what in it is hardly meant.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.description.warnings.clone();
        warnings.extend(warnings::warnings(&self.description));
        warnings
    }

    /// The device's records, in the file's space and then `space`.
    pub fn lower(mut self, space: Rebase) -> Result<Scene, SceneError> {
        // By the author's own numbers, which a space may move out of range.
        self.description.warnings = self.warnings();
        let moved = self.description.move_to(self.space.then(space));
        moved.map_err(|message| SceneError::Inconsistent { file: self.name.clone(), message })?;
        lower::lower(&self.description, &self.image, &self.name)
    }
}
