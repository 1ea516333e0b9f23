//! Reader of the files that a scene file names: the file system, or what a test gives.

use super::description::{Description, TextureImage};
use super::error::SceneError;
use super::import::ModelOptions;
use super::medium::DensityGrid;
use std::path::Path;
use std::sync::Arc;
use trisect_image::Image;

/// Reads the files that a scene file names.
pub trait Loader {
    /// Reads a model, as `options` choose: glTF, OBJ, PLY or STL by its extension, in upper or
    /// lower case.
    fn model(&mut self, path: &Path, options: &ModelOptions) -> Result<Description, SceneError>;

    /// Reads a panorama: HDR, EXR or PFM by its extension, in upper or lower case.
    fn panorama(&mut self, path: &Path) -> Result<Arc<Image>, SceneError>;

    /// Reads a grid of densities.
    fn density(&mut self, path: &Path) -> Result<Arc<DensityGrid>, SceneError>;

    /// Reads a texture. Unless `linear`, red, green and blue of an integer format are sRGB-encoded.
    fn texture(&mut self, path: &Path, linear: bool) -> Result<Arc<TextureImage>, SceneError>;

    /// Returns the image in memory that stands for the texture file `name`, if there is one.
    fn image_in_memory(&self, name: &str) -> Option<Arc<TextureImage>>;
}
