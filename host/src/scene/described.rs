//! A scene that was read: in f64, and what to render of it.

use super::describe::{self, Loader};
use super::description::{Description, TextureImage};
use super::{Scene, SceneError, Space, format, import, lower, model};
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
pub struct Described {
    /// Where it came from, for messages.
    pub name: String,
    /// What there is, in the scene's own units; the first camera is the one to use.
    pub description: Description,
    /// What to render unless told otherwise.
    pub image: ImageSettings,
    /// Where the file asks to compute.
    pub space: Space,
}

/// Reads the files that a scene names from the file system.
struct FromDisk;

impl Loader for FromDisk {
    fn model(&mut self, path: &Path) -> Result<Description, SceneError> {
        import::load(path)
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

impl Described {
    /// Reads a scene file, or a model; see [`Scene::load`].
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let name = path.display().to_string();
        if import::is_model(path) {
            return Self::from_model(import::load(path)?, &name);
        }
        let text =
            input::read_text(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        Self::read(&text, &name, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a scene from text; see [`Scene::parse`].
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        Self::read(text, name, Path::new(""))
    }

    /// The built-in scene; see [`Scene::hello_world`].
    pub fn hello_world() -> Result<Self, SceneError> {
        Self::parse(HELLO_WORLD, "scenes/three_spheres.ron (built in)")
    }

    /// A model with what it lacks to be seen; see [`Scene::from_model`].
    pub fn from_model(model: Description, name: &str) -> Result<Self, SceneError> {
        let refused = |message| SceneError::Inconsistent { file: name.to_owned(), message };
        lower::check_room(&model).map_err(refused)?;
        let (description, image) = model::complete(model);
        Ok(Self { name: name.to_owned(), description, image, space: Space::IDENTITY })
    }

    fn read(text: &str, name: &str, folder: &Path) -> Result<Self, SceneError> {
        let file = format::parse(text, name)?;
        let (description, image) = describe::describe(&file, folder, &mut FromDisk)?;
        Ok(Self { name: name.to_owned(), description, image, space: file.space.space })
    }

    /// What to render unless told otherwise, with the program's defaults for what no file says.
    pub fn settings(&self) -> Settings {
        self.image.settings()
    }

    /// The device's records, in the file's space and then `space`.
    pub fn lower(mut self, space: Space) -> Result<Scene, SceneError> {
        let moved = self.description.move_to(self.space.then(space));
        moved.map_err(|message| SceneError::Inconsistent { file: self.name.clone(), message })?;
        lower::lower(&self.description, &self.image, &self.name)
    }
}
