//! Files that a scene names, each read once, for the scene at several times.

use super::description::{Description, TextureImage};
use super::error::SceneError;
use super::import::{Folder, ModelOptions, OpenModel};
use super::loader::Loader;
use super::medium::DensityGrid;
use super::scene_document::FromDisk;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trisect_image::Image;

/// A loader that reads each file once, and gives models at a time.
pub(super) struct Library {
    folder: Folder,
    /// Choices for models of which the scene does not make any.
    pub options: ModelOptions,
    /// Images in memory by the names of the files that they stand for.
    pub images: BTreeMap<String, Arc<TextureImage>>,
    models: HashMap<PathBuf, OpenModel>,
    panoramas: HashMap<PathBuf, Arc<Image>>,
    textures: HashMap<(PathBuf, bool), Arc<TextureImage>>,
    grids: HashMap<PathBuf, Arc<DensityGrid>>,
    /// True once a model was given at the time of [`options`](Self::options) that has animations.
    pub has_moved: bool,
}

impl Library {
    /// Returns a library of the files that a scene in `folder` names, before any is read.
    pub fn new(folder: Folder, options: ModelOptions) -> Self {
        let (models, panoramas, textures) = (HashMap::new(), HashMap::new(), HashMap::new());
        let (grids, images) = (HashMap::new(), BTreeMap::new());
        Self { folder, options, images, models, panoramas, textures, grids, has_moved: false }
    }

    /// Returns the loader of files that were not read yet.
    fn disk(&self) -> FromDisk<'_> {
        FromDisk { folder: &self.folder, options: &self.options, images: &self.images }
    }
}

impl Loader for Library {
    fn model(&mut self, path: &Path, options: &ModelOptions) -> Result<Description, SceneError> {
        if !self.models.contains_key(path) {
            self.models.insert(path.to_owned(), OpenModel::open(path, &self.folder)?);
        }
        let unknown = || SceneError::UnknownFormat { path: path.to_owned() };
        let model = self.models.get_mut(path).ok_or_else(unknown)?;
        let follows = options.time.is_none() && options.animation.is_none();
        self.has_moved |= follows && model.is_animated();
        model.describe(&options.or(&self.options))
    }

    fn panorama(&mut self, path: &Path) -> Result<Arc<Image>, SceneError> {
        if let Some(known) = self.panoramas.get(path) {
            return Ok(Arc::clone(known));
        }
        let read = self.disk().panorama(path)?;
        self.panoramas.insert(path.to_owned(), Arc::clone(&read));
        Ok(read)
    }

    fn density(&mut self, path: &Path) -> Result<Arc<DensityGrid>, SceneError> {
        if let Some(known) = self.grids.get(path) {
            return Ok(Arc::clone(known));
        }
        let read = self.disk().density(path)?;
        self.grids.insert(path.to_owned(), Arc::clone(&read));
        Ok(read)
    }

    fn texture(&mut self, path: &Path, linear: bool) -> Result<Arc<TextureImage>, SceneError> {
        let key = (path.to_owned(), linear);
        if let Some(known) = self.textures.get(&key) {
            return Ok(Arc::clone(known));
        }
        let read = self.disk().texture(path, linear)?;
        self.textures.insert(key, Arc::clone(&read));
        Ok(read)
    }

    fn image_in_memory(&self, name: &str) -> Option<Arc<TextureImage>> {
        self.images.get(name).cloned()
    }
}
