//! A model file that stays in memory, to be described at several times.

use super::gltf::Gltf;
use super::{Folder, ModelOptions, files, load_below};
use crate::description::Description;
use crate::error::SceneError;
use std::path::{Path, PathBuf};

/// A model file that was read.
pub(crate) struct OpenModel {
    path: PathBuf,
    content: Content,
}

enum Content {
    /// A glTF file, and the folder that its images are read from.
    Gltf(Box<(Gltf<'static>, Folder)>),
    /// A model that holds no choices.
    Still(Box<Description>),
}

impl OpenModel {
    /// Reads a model that a scene in `folder` names.
    ///
    /// # Errors
    ///
    /// Those of [`load_below`].
    pub fn open(path: &Path, folder: &Folder) -> Result<Self, SceneError> {
        let extension = path.extension().unwrap_or_default();
        let is_gltf = ["gltf", "glb"].iter().any(|name| extension.eq_ignore_ascii_case(name));
        let content = if is_gltf {
            let bytes = files::read_whole(path)?;
            let mut folder = folder.beside(path);
            let gltf = Gltf::open(&bytes, &path.display().to_string(), &mut folder)?.into_owned();
            Content::Gltf(Box::new((gltf, folder)))
        } else {
            Content::Still(Box::new(load_below(path, &ModelOptions::default(), folder)?))
        };
        Ok(Self { path: path.to_owned(), content })
    }

    /// Returns whether the model has animations.
    pub fn is_animated(&self) -> bool {
        matches!(&self.content, Content::Gltf(open) if open.0.is_animated())
    }

    /// Describes the model as `options` choose. Each image is read once, also for several
    /// descriptions.
    ///
    /// # Errors
    ///
    /// Those of [`load_below`] for the model's content.
    pub fn describe(&mut self, options: &ModelOptions) -> Result<Description, SceneError> {
        match &mut self.content {
            Content::Still(description) => Ok(description.as_ref().clone()),
            Content::Gltf(open) => {
                let (gltf, folder) = open.as_mut();
                let mut description = gltf.describe(options, folder)?;
                description.files.push(self.path.clone());
                description.files.extend_from_slice(folder.files_read());
                Ok(description)
            }
        }
    }
}
