//! A scene at any time of the animations of its models.

use super::description::Sky;
use super::import::{Folder, ModelOptions};
use super::library::Library;
use super::loader::Loader;
use super::lower::Looks;
use super::model::{self, Additions};
use super::source::Source;
use super::surroundings::Surroundings;
use super::{CameraChoice, FieldEdit, LoadOptions, Rebase, Scene, SceneDocument, SceneError, Sharing};
use std::path::{Path, PathBuf};

/// A scene file, or a model, whose models move. Its files are read, its images decoded and its
/// textures packed once.
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
        let LoadOptions { includes, model: options, surroundings, edits } = options;
        let name = path.display().to_string();
        let folder = Folder::of(path).including(*includes);
        let content = match Source::open(path, edits)? {
            Source::Model => Content::Model { path: path.to_owned(), additions: None },
            Source::File(text) => Content::File(text),
            Source::Foreign => {
                let message =
                    "animations of scenes of other renderers are not read; render one image of it".to_owned();
                return Err(SceneError::Inconsistent { file: name, message });
            }
        };
        let library = Library::new(folder.clone(), options.clone());
        let sky = surroundings
            .environment
            .as_ref()
            .map(|environment| environment.sky(surroundings.sun))
            .transpose()?;
        let (surroundings, edits, sharing) = (surroundings.clone(), edits.clone(), Sharing::Auto);
        let camera = CameraChoice::default();
        let mut scene =
            Self { content, name, folder, library, surroundings, edits, sky, sharing, camera, looks: None };
        scene.document(options.time.unwrap_or(0.0))?;
        Ok(scene)
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
