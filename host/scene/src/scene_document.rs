//! A scene as it was read, in f64, with its image settings: the stage between the file and the
//! device records.

use super::description::{Description, TextureImage};
use super::import::{Folder, Includes, ModelOptions};
use super::loader::Loader;
use super::medium::DensityGrid;
use super::part_names::{self, PartName};
use super::source::Source;
use super::surroundings::{self, Surroundings};
use super::{
    FieldEdit, ImageSettings, LoadOptions, Rebase, Scene, SceneError, Sharing, field_edit, format, import,
    lower, model, resolve, warnings,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use trisect_image::Image;

/// The built-in scene, a copy of the one in `scenes`, which a published crate does not contain.
pub(super) const HELLO_WORLD: &str = include_str!("../assets/three_spheres.ron");

/// Name of the built-in scene.
pub(super) const HELLO_WORLD_NAME: &str = "scenes/three_spheres.ron (built in)";

/// A scene as its author describes it, before anything is rounded to f32. [`Self::lower`] makes a
/// [`Scene`] of it.
#[derive(Clone, Debug)]
pub struct SceneDocument {
    /// File of the scene, or the name that stands for it, for messages.
    pub name: String,
    /// Content of the scene, in its own units. The first camera is the one to use.
    pub description: Description,
    /// Image settings of the scene; the command line overrides them.
    pub image: ImageSettings,
    /// Space that the file states; the renderer computes in it.
    pub space: Rebase,
    /// Decisions about models, for people.
    pub notes: Vec<String>,
    /// Choices for models of which the scene does not make any.
    pub options: ModelOptions,
    /// Choice of the meshes that instances share.
    pub sharing: Sharing,
    /// Environment, sun and ground that were chosen in addition to what the file states.
    pub surroundings: Surroundings,
    /// Changes of the file's fields that were chosen.
    pub edits: Vec<FieldEdit>,
}

/// A loader that reads from the file system the files that a scene in this folder names.
pub(super) struct FromDisk<'a> {
    pub folder: &'a Folder,
    /// Choices for models of which the scene does not make any.
    pub options: &'a ModelOptions,
    /// Images in memory by the names of the files that they stand for.
    pub images: &'a BTreeMap<String, Arc<TextureImage>>,
}

impl Loader for FromDisk<'_> {
    fn model(&mut self, path: &Path, options: &ModelOptions) -> Result<Description, SceneError> {
        import::load_below(path, &options.or(self.options), self.folder)
    }

    fn panorama(&mut self, path: &Path) -> Result<Arc<Image>, SceneError> {
        surroundings::read_panorama(path)
    }

    fn density(&mut self, path: &Path) -> Result<Arc<DensityGrid>, SceneError> {
        DensityGrid::load(path).map(Arc::new)
    }

    fn texture(&mut self, path: &Path, linear: bool) -> Result<Arc<TextureImage>, SceneError> {
        import::texture(path, linear).map(Arc::new)
    }

    fn image_in_memory(&self, name: &str) -> Option<Arc<TextureImage>> {
        self.images.get(name).cloned()
    }
}

impl SceneDocument {
    /// Reads a scene file, a model, or a scene of another renderer; see [`Scene::load`].
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_with(path, &LoadOptions::default())
    }

    /// Reads a scene file, a model, or a scene of another renderer, with these choices.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the file and the place.
    pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Self, SceneError> {
        let LoadOptions { includes, model: model_options, surroundings, edits, .. } = options;
        let name = path.display().to_string();
        let folder = Folder::of(path).including(*includes);
        match Source::open(path, edits)? {
            Source::Model => {
                let model = import::load_below(path, model_options, &folder)?;
                let document = Self::from_model_in_surroundings(model, &name, surroundings)?;
                Ok(Self { options: model_options.clone(), ..document })
            }
            Source::Foreign => {
                let (description, image) = import::load_foreign_scene(path, &folder)?;
                Self::of_foreign_scene(description, image, &name)?.surrounded(surroundings)
            }
            Source::File(text) => Self::read(&text, &name, &folder, options)?.surrounded(surroundings),
        }
    }

    /// Returns the scene with these surroundings. It is one of a scene file, not a bare model.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a panorama that cannot be read, and for a ground, which a scene file
    /// states itself.
    pub fn surrounded(mut self, surroundings: &Surroundings) -> Result<Self, SceneError> {
        surroundings.apply(&mut self.description, &self.name)?;
        Ok(Self { surroundings: surroundings.clone(), ..self })
    }

    /// Reads a scene from text; see [`Scene::parse`].
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        Self::parse_including(text, name, Includes::Below)
    }

    /// Reads a scene from text, which may name the files that `includes` allows, relative to the
    /// current folder.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the place.
    pub fn parse_including(text: &str, name: &str, includes: Includes) -> Result<Self, SceneError> {
        Self::parse_with(text, name, &LoadOptions { includes, ..LoadOptions::default() })
    }

    /// Reads a scene from text with these choices. Files that it names are relative to the current
    /// folder.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the place.
    pub fn parse_with(text: &str, name: &str, options: &LoadOptions) -> Result<Self, SceneError> {
        let folder = Folder::new("".into()).including(options.includes);
        Self::read(text, name, &folder, options)?.surrounded(&options.surroundings)
    }

    /// Returns the built-in scene; see [`Scene::hello_world`].
    pub fn hello_world() -> Result<Self, SceneError> {
        Self::hello_world_with(&LoadOptions::default())
    }

    /// Returns the built-in scene with these choices.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names the choice.
    pub fn hello_world_with(options: &LoadOptions) -> Result<Self, SceneError> {
        let scene = Self::read(HELLO_WORLD, HELLO_WORLD_NAME, &Folder::new("".into()), options)?;
        scene.surrounded(&options.surroundings)
    }

    /// Makes a scene of a model, with the camera, the light and the ground that it lacks; see
    /// [`Scene::from_model`].
    pub fn from_model(model: Description, name: &str) -> Result<Self, SceneError> {
        Self::from_model_in_surroundings(model, name, &Surroundings::default())
    }

    /// Makes a scene of a model as [`Self::from_model`] does, with these surroundings.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a panorama that cannot be read.
    pub fn from_model_in_surroundings(
        model: Description,
        name: &str,
        surroundings: &Surroundings,
    ) -> Result<Self, SceneError> {
        let completed = model::complete(model, surroundings)?;
        Ok(Self::of_model(completed, name, surroundings))
    }

    /// Returns the scene of another renderer's file. Without a camera it gets a view of all of it,
    /// and nothing else is added.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a camera that cannot be chosen.
    pub fn of_foreign_scene(
        mut description: Description,
        image: ImageSettings,
        name: &str,
    ) -> Result<Self, SceneError> {
        let mut notes = std::mem::take(&mut description.notes);
        if description.cameras.is_empty() {
            description.cameras.push(("all".to_owned(), model::view_of_all(&description)));
            notes.push(format!("{}the view shows all of the scene", crate::camera_choice::NO_CAMERA));
        }
        Ok(Self { notes, ..Self::of_description(description, image, name) })
    }

    /// Returns the scene of a description, in its own space; `name` stands for its file.
    pub fn of_description(description: Description, image: ImageSettings, name: &str) -> Self {
        Self {
            name: name.to_owned(),
            description,
            image,
            space: Rebase::IDENTITY,
            notes: Vec::new(),
            options: ModelOptions::default(),
            sharing: Sharing::Auto,
            surroundings: Surroundings::default(),
            edits: Vec::new(),
        }
    }

    /// Returns the scene of a model that was completed with these surroundings.
    pub(super) fn of_model(model: model::Completed, name: &str, surroundings: &Surroundings) -> Self {
        let model::Completed { description, image, notes } = model;
        Self { notes, surroundings: surroundings.clone(), ..Self::of_description(description, image, name) }
    }

    fn read(text: &str, name: &str, folder: &Folder, options: &LoadOptions) -> Result<Self, SceneError> {
        let LoadOptions { model, images, .. } = options;
        Self::read_through(text, name, folder, options, &mut FromDisk { folder, options: model, images })
    }

    /// Reads a scene from text, and the files that it names through `loader`. The surroundings of
    /// `options` are left out.
    pub(super) fn read_through(
        text: &str,
        name: &str,
        folder: &Folder,
        options: &LoadOptions,
        loader: &mut dyn Loader,
    ) -> Result<Self, SceneError> {
        let edits = options.edits.clone();
        let text = field_edit::apply(text, name, &edits)?;
        let shown = field_edit::edited_name(name, &edits);
        let file = format::parse(&text, &shown)?;
        let described = resolve::describe(&file, folder, loader);
        let (description, image) = described.map_err(|error| error.with_comment(&text))?;
        let notes = description.notes.clone();
        let (name, options) = (name.to_owned(), options.model.clone());
        let (space, sharing) = (file.space.space, Sharing::Auto);
        let surroundings = Surroundings::default();
        Ok(Self { name, description, image, space, notes, options, sharing, surroundings, edits })
    }

    /// Returns the warnings: data that was left out or changed while reading, and probable mistakes
    /// in the scene.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.description.warnings.clone();
        let aspect = f64::from(self.image.width) / f64::from(self.image.height.max(1));
        warnings.extend(warnings::warnings(&self.description, aspect));
        warnings
    }

    /// Returns the names of all objects, as a renderer numbers them: spheres, then quads and discs,
    /// then mesh instances, each in the order of the scene.
    pub fn part_names(&self) -> Vec<PartName> {
        let mut names = part_names::all(&self.description);
        let ground = || "ground".to_owned();
        names.extend(
            self.description.ground.iter().map(|_| PartName { object: ground(), material: ground() }),
        );
        names
    }

    /// Makes the device records, in the file's space and then `space`.
    pub fn lower(self, space: Rebase) -> Result<Scene, SceneError> {
        self.lower_with(space, &mut None)
    }

    /// Makes the device records as [`lower`](Self::lower) does; `looks` are those of the scene at
    /// another time.
    pub(super) fn lower_with(
        mut self,
        space: Rebase,
        looks: &mut Option<lower::Looks>,
    ) -> Result<Scene, SceneError> {
        // Warnings are about the author's own numbers, which a space may move out of range.
        self.description.warnings = self.warnings();
        lower::place_ground(&mut self.description);
        let inconsistent = |message| SceneError::Inconsistent { file: self.name.clone(), message };
        self.description.check().map_err(inconsistent)?;
        let moved = self.description.move_to(self.space.then(space));
        moved.map_err(|message| SceneError::Inconsistent { file: self.name.clone(), message })?;
        lower::lower(&self.description, &self.image, &self.name, self.sharing, looks)
    }
}
