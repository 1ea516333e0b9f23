//! Choices with which a scene is read, in addition to what its file states.

use super::field_edit::FieldEdit;
use super::import::{Includes, ModelOptions};
use super::surroundings::Surroundings;
use super::texture::TextureImage;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Choices with which a scene is read, in addition to what its file states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Files that the scene may name.
    pub includes: Includes,
    /// Choices among what models hold, unless the scene file makes them.
    pub model: ModelOptions,
    /// Environment, sun and ground. They replace the sky and the ground of a scene file, and those
    /// that a model gets.
    pub surroundings: Surroundings,
    /// Changes of a scene file's fields, in this order.
    pub edits: Vec<FieldEdit>,
    /// Images in memory by file name: a texture whose `file` is such a name shows the image, and no
    /// file is read. 8-bit channels are encoded as the texture's `color_space` says.
    ///
    /// ```
    /// # use trisect_scene::builder::{Texels, TextureImage};
    /// # use trisect_scene::{LoadOptions, Rebase, SceneDocument, SceneError};
    /// let text = r#"Scene(
    ///     version: 1,
    ///     image: (width: 64, height: 64),
    ///     camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 40),
    ///     textures: {"red": (file: "red.png")},
    ///     materials: {"paint": Lambertian(albedo: (1, 1, 1), texture: "red")},
    ///     objects: [Sphere(center: (0, 0, 0), radius: 1, material: "paint")],
    /// )"#;
    /// let red = TextureImage::new(1, 1, Texels::Srgb8(vec![[255, 0, 0, 255]]));
    /// let images = [("red.png".to_owned(), red.into())].into();
    /// let options = LoadOptions { images, ..LoadOptions::default() };
    /// let scene = SceneDocument::parse_with(text, "scene", &options)?.lower(Rebase::IDENTITY)?;
    /// assert_eq!(scene.texels.len(), 1);
    /// # Ok::<(), SceneError>(())
    /// ```
    pub images: BTreeMap<String, Arc<TextureImage>>,
}
