//! Origins of scenes, from which they are read, and read again for edits.

use crate::scene_parts::Parts;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use trisect::scene::{
    AnimatedScene, CameraChoice, FieldEdit, Includes, LoadOptions, PartName, Rebase, SceneDocument,
    SceneError,
};
use trisect_lab::tradeoff::RenderCommand;

/// Origin of a scene, from which it is read again for an edit.
#[derive(Debug)]
pub enum Content {
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
pub struct Source {
    content: Content,
    options: LoadOptions,
    camera: CameraChoice,
    /// Scene with its files in memory, once an edit has asked for it.
    in_memory: Mutex<Option<AnimatedScene>>,
}

/// Changes of a scene's text, with the arrays that it has in addition.
#[derive(Clone, Default)]
pub struct State {
    pub edits: Vec<FieldEdit>,
    pub parts: Parts,
}

/// Scene with its space and the names of its objects.
pub struct Read {
    pub scene: trisect::scene::Scene,
    pub space: Rebase,
    pub names: Arc<Vec<PartName>>,
}

impl State {
    /// Returns the edits that may change names of objects or their materials.
    fn naming(&self) -> impl Iterator<Item = &FieldEdit> {
        let keeps = ["camera", "image", "lights", "materials", "media", "sky", "textures"];
        let names =
            move |edit: &&FieldEdit| !edit.path().first().is_some_and(|of| keeps.contains(&of.as_str()));
        self.edits.iter().filter(names)
    }

    /// Returns whether the objects have the same names and materials in both states of a scene.
    fn has_names_of(&self, other: &Self) -> bool {
        self.naming().eq(other.naming()) && self.parts.has_names_of(&other.parts)
    }
}

impl Source {
    /// Returns the origin of a scene with these choices.
    pub fn new(content: Content, options: LoadOptions, camera: CameraChoice) -> Arc<Self> {
        Arc::new(Self { content, options, camera, in_memory: Mutex::new(None) })
    }

    /// Returns the origin of a scene without choices.
    pub fn of(content: Content) -> Arc<Self> {
        Self::new(content, LoadOptions::default(), CameraChoice::default())
    }

    /// Refuses edits of a scene without its text.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`].
    pub fn check_editable(&self) -> Result<(), SceneError> {
        if let Content::Bytes = self.content { Err(without_text()) } else { Ok(()) }
    }

    /// Reads the scene in a state.
    ///
    /// # Errors
    ///
    /// Those of [`SceneDocument::load_with`] and [`SceneDocument::lower`].
    pub fn read(&self, state: &State) -> Result<Read, SceneError> {
        let document = self.document(state)?;
        let (space, names) = (document.space, Arc::new(document.part_names()));
        Ok(Read { scene: document.lower(Rebase::IDENTITY)?, space, names })
    }

    /// Returns the scene in a state, after it was read in the state `before` with this space and
    /// these names, of the files in memory. `None` where they would not give what the files give.
    ///
    /// # Errors
    ///
    /// Those of [`read`](Self::read).
    pub fn read_in_memory(
        &self,
        state: &State,
        before: &State,
        (space, names): (Rebase, &Arc<Vec<PartName>>),
    ) -> Option<Result<Read, SceneError>> {
        let Self { content, options, camera, in_memory } = self;
        let State { edits, parts } = state;
        let mut in_memory = in_memory.lock().unwrap_or_else(PoisonError::into_inner);
        if in_memory.is_none() {
            let options = &LoadOptions { images: parts.images.clone(), ..options.clone() };
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
        animated.set_images(parts.images.clone());
        let mut found = (space, Arc::clone(names));
        let scene = animated.set_edits_and(edits.clone(), options.model.time.unwrap_or(0.0), |document| {
            add(parts, document)?;
            if !state.has_names_of(before) {
                found = (document.space, Arc::new(document.part_names()));
            }
            Ok(())
        });
        let (space, names) = found;
        Some(scene.map(|scene| Read { scene, space, names }))
    }

    fn document(&self, State { edits, parts }: &State) -> Result<SceneDocument, SceneError> {
        let Self { content, options, camera, .. } = self;
        let (edits, images) = ([options.edits.as_slice(), edits].concat(), parts.images.clone());
        let options = &LoadOptions { edits, images, ..options.clone() };
        let mut document = match content {
            Content::File(path) => SceneDocument::load_with(path, options)?,
            Content::Text { text, name } => SceneDocument::parse_with(text, name, options)?,
            Content::HelloWorld => SceneDocument::hello_world_with(options)?,
            Content::Bytes => return Err(without_text()),
        };
        add(parts, &mut document)?;
        document.choose_camera(camera)?;
        Ok(document)
    }

    /// Returns the program's command that renders the scene in a state, without settings; `None`
    /// for a scene that is not a file, or has arrays.
    pub fn command(&self, state: &State) -> Option<RenderCommand> {
        let Self { content, options, camera, .. } = self;
        let scene = match content {
            _ if !state.parts.is_empty() => return None,
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
        let edits = state.edits.iter().map(|edit| ("--set", Some(edit.to_string())));
        let all = of_load.into_iter().chain(edits).filter(|(_, value)| value.is_some());
        given.extend(all.map(|(name, value)| (name.to_owned(), value)));
        Some(RenderCommand { scene, options: given })
    }
}

/// Returns the error for an edit of a scene without its text.
fn without_text() -> SceneError {
    let message = "it was made of bytes, without its text; edit the scene before".to_owned();
    SceneError::Inconsistent { file: "the scene".to_owned(), message }
}

/// Adds arrays to a scene.
fn add(parts: &Parts, document: &mut SceneDocument) -> Result<(), SceneError> {
    let file = &document.name;
    let added = parts.add_to(&mut document.description);
    added.map_err(|message| SceneError::Inconsistent { file: file.clone(), message })
}
