//! A scene at any time of the animations of its models, and with any changes of its fields.

use super::description::Sky;
use super::import::{Folder, ModelOptions};
use super::library::Library;
use super::loader::Loader;
use super::lower::Looks;
use super::model::{self, Additions};
use super::scene_document::{HELLO_WORLD, HELLO_WORLD_NAME};
use super::source::Source;
use super::surroundings::Surroundings;
use super::texture::TextureImage;
use super::{CameraChoice, FieldEdit, LoadOptions, Rebase, Scene, SceneDocument, SceneError, Sharing};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scene file, or a model, whose models move, and whose fields can be changed. Its files are read
/// and its images decoded once.
///
/// ```
/// # use trisect_scene::{AnimatedScene, LoadOptions, SceneError};
/// let mut scene = AnimatedScene::hello_world(&LoadOptions::default())?;
/// let edit = "camera.look_from=0,1,5".parse().expect("a path and a value");
/// let moved = scene.edit(&[edit], 0.0)?;
/// assert_eq!(moved.camera.look_from.z, 5.0);
/// # Ok::<(), SceneError>(())
/// ```
pub struct AnimatedScene {
    content: Content,
    /// File of the scene, for messages.
    name: String,
    folder: Folder,
    library: Library,
    surroundings: Surroundings,
    /// Changes of the scene file's fields.
    edits: Vec<FieldEdit>,
    /// Sky of the surroundings, if they have one, with the file that it was read from.
    sky: Option<(Sky, Option<PathBuf>)>,
    /// Choice of the meshes that instances share. A tree of shared meshes is built anew for each
    /// time.
    pub sharing: Sharing,
    /// Choice of the camera at all times.
    pub camera: CameraChoice,
    /// Records that do not change with time.
    looks: Option<Looks>,
}

enum Content {
    /// A model, with what it lacks at the start.
    Model { path: PathBuf, additions: Option<Box<Additions>> },
    /// Text of a scene file.
    File(String),
}

impl AnimatedScene {
    /// Reads a scene file, or a model, as [`SceneDocument::load_with`] does. The options of models
    /// name the animation; their time, or 0, is the start, at which a model gets what it lacks for
    /// all times.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for a scene of which nothing moves; those of
    /// [`SceneDocument::load_with`].
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Self, SceneError> {
        let scene = Self::load_moving_or_not(path, options)?;
        if !scene.moves() {
            let message = match &scene.content {
                Content::Model { .. } => "the model has no animation: it is the same at all times",
                Content::File(_) => {
                    "none of its models moves: a model needs an animation, and no `time` or `animation` of its own in the file"
                }
            };
            let message = format!("{message}; render one image of it");
            return Err(SceneError::Inconsistent { file: scene.name, message });
        }
        Ok(scene)
    }

    /// Reads a scene as [`load`](Self::load) does, and also one of which nothing moves.
    ///
    /// # Errors
    ///
    /// Those of [`SceneDocument::load_with`].
    pub fn load_moving_or_not(path: &Path, options: &LoadOptions) -> Result<Self, SceneError> {
        let name = path.display().to_string();
        let folder = Folder::of(path).including(options.includes);
        let content = match Source::open(path, &options.edits)? {
            Source::Model => Content::Model { path: path.to_owned(), additions: None },
            Source::File(text) => Content::File(text),
            Source::Foreign => {
                let message =
                    "animations of scenes of other renderers are not read; render one image of it".to_owned();
                return Err(SceneError::Inconsistent { file: name, message });
            }
        };
        Self::of(content, name, folder, options)
    }

    /// Reads a scene from text, which may name the files that `options` allow, relative to the
    /// current folder. Nothing needs to move in it. `name` stands for the file in messages.
    ///
    /// # Errors
    ///
    /// Those of [`SceneDocument::parse_including`].
    pub fn parse(text: &str, name: &str, options: &LoadOptions) -> Result<Self, SceneError> {
        let folder = Folder::new("".into()).including(options.includes);
        Self::of(Content::File(text.to_owned()), name.to_owned(), folder, options)
    }

    /// Returns the built-in scene, in which nothing moves.
    ///
    /// # Errors
    ///
    /// Those of [`SceneDocument::hello_world_with`].
    pub fn hello_world(options: &LoadOptions) -> Result<Self, SceneError> {
        Self::parse(HELLO_WORLD, HELLO_WORLD_NAME, options)
    }

    /// Reads the scene at its start.
    fn of(content: Content, name: String, folder: Folder, options: &LoadOptions) -> Result<Self, SceneError> {
        let LoadOptions { model, surroundings, edits, images, .. } = options;
        let mut library = Library::new(folder.clone(), model.clone());
        library.images.clone_from(images);
        let sky = surroundings
            .environment
            .as_ref()
            .map(|environment| environment.sky(surroundings.sun))
            .transpose()?;
        let (surroundings, edits, sharing) = (surroundings.clone(), edits.clone(), Sharing::Auto);
        let camera = CameraChoice::default();
        let mut scene =
            Self { content, name, folder, library, surroundings, edits, sky, sharing, camera, looks: None };
        scene.document(model.time.unwrap_or(0.0))?;
        Ok(scene)
    }

    /// Returns the changes of the scene file's fields.
    pub fn edits(&self) -> &[FieldEdit] {
        &self.edits
    }

    /// Changes fields of the scene file, after all changes before, and returns the device records
    /// at a time. No file is read again, but for those that the scene did not name before. Earlier
    /// changes of the same fields are forgotten. After an error the scene is what it was.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for a path that does not exist, and for a model, which has no
    /// fields; those of [`document`](Self::document) and [`lower`](Self::lower).
    pub fn edit(&mut self, edits: &[FieldEdit], time: f64) -> Result<Scene, SceneError> {
        let mut all = self.edits.clone();
        for edit in edits {
            all.retain(|earlier| !edit.replaces(earlier));
            all.push(edit.clone());
        }
        self.set_edits(all, time)
    }

    /// Replaces all changes of the scene file's fields, as [`edit`](Self::edit) does. Without any,
    /// the scene is that of its file again.
    ///
    /// # Errors
    ///
    /// Those of [`edit`](Self::edit).
    pub fn set_edits(&mut self, edits: Vec<FieldEdit>, time: f64) -> Result<Scene, SceneError> {
        self.set_edits_and(edits, time, |_| Ok(()))
    }

    /// Replaces all changes of the scene file's fields, as [`set_edits`](Self::set_edits) does;
    /// `complete` changes the scene before its device records are made, such as by adding meshes.
    /// Images and the sky stay the same while descriptions share them.
    ///
    /// # Errors
    ///
    /// Those of [`edit`](Self::edit) and of `complete`.
    pub fn set_edits_and(
        &mut self,
        edits: Vec<FieldEdit>,
        time: f64,
        complete: impl FnOnce(&mut SceneDocument) -> Result<(), SceneError>,
    ) -> Result<Scene, SceneError> {
        if matches!(self.content, Content::Model { .. }) && !edits.is_empty() {
            return Err(Source::no_fields(&self.name));
        }
        let (before, moved) = (std::mem::replace(&mut self.edits, edits), self.library.has_moved);
        let document = self.document_as_filed(time).and_then(|mut document| {
            complete(&mut document)?;
            document.choose_camera(&self.camera)?;
            Ok(document)
        });
        let scene = document.and_then(|document| self.lower(document));
        if scene.is_err() {
            (self.edits, self.library.has_moved) = (before, moved);
        }
        scene
    }

    /// Replaces the images in memory; see [`LoadOptions::images`].
    pub fn set_images(&mut self, images: BTreeMap<String, Arc<TextureImage>>) {
        self.library.images = images;
    }

    /// Returns whether a part of the scene moves.
    pub fn moves(&self) -> bool {
        self.library.has_moved
    }

    /// Returns the scene at a time of the animation, in seconds.
    ///
    /// # Errors
    ///
    /// Those of [`SceneDocument::load_with`].
    pub fn document(&mut self, time: f64) -> Result<SceneDocument, SceneError> {
        let mut document = self.document_as_filed(time)?;
        document.choose_camera(&self.camera)?;
        Ok(document)
    }

    /// Returns the scene at a time with the camera of its file.
    fn document_as_filed(&mut self, time: f64) -> Result<SceneDocument, SceneError> {
        let Self { content, name, folder, library, surroundings, edits, sky, sharing, .. } = self;
        library.options.time = Some(time);
        match content {
            Content::File(text) => {
                let (model, edits) = (library.options.clone(), edits.clone());
                let options = LoadOptions { model, edits, ..LoadOptions::default() };
                let document = SceneDocument::read_through(text, name, folder, &options, library)?;
                let others = Surroundings { environment: None, ..surroundings.clone() };
                let mut document = document.surrounded(&others)?;
                if let Some((sky, file)) = sky {
                    document.description.sky = Some(sky.clone());
                    document.description.files.extend(file.clone());
                }
                Ok(SceneDocument { surroundings: surroundings.clone(), sharing: *sharing, ..document })
            }
            Content::Model { path, additions } => {
                let model = library.model(path, &ModelOptions::default())?;
                let additions = match additions {
                    Some(additions) => additions,
                    None => additions.insert(Box::new(Additions::of(&model, surroundings)?)),
                };
                let completed = model::complete_with(model, additions);
                let options = library.options.clone();
                let document = SceneDocument::of_model(completed, name, surroundings);
                Ok(SceneDocument { options, sharing: *sharing, ..document })
            }
        }
    }

    /// Makes the device records of a [`document`](Self::document), in the file's space. Materials
    /// and textures that did not change since the last one are taken from it.
    ///
    /// # Errors
    ///
    /// Those of [`SceneDocument::lower`].
    pub fn lower(&mut self, document: SceneDocument) -> Result<Scene, SceneError> {
        document.lower_with(Rebase::IDENTITY, &mut self.looks)
    }
}

#[cfg(test)]
mod tests;
