//! Textures of a description: images, and their use by materials.

use glam::DAffine2;
use std::sync::Arc;

/// Maximum number of a texel, that of half precision.
pub const MAX_TEXEL: f32 = 65504.0;

/// The use of an image by a material.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into the images of a description.
    pub image: usize,
    /// Continuation beyond 0 to 1, across and down.
    pub wrap: [Wrap; 2],
    /// Interpolation between texels.
    pub filter: Filter,
    /// Map from the mesh's (u, v) to the image's, where (0, 0) is the top left corner as in glTF.
    pub transform: DAffine2,
    /// True if it reads the mesh's second set of texture coordinates.
    pub second_uvs: bool,
}

impl TextureUse {
    /// Returns the use of an image that repeats, with interpolation between texels, at the mesh's
    /// first texture coordinates.
    pub fn of(image: usize) -> Self {
        Self {
            image,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
            transform: DAffine2::IDENTITY,
            second_uvs: false,
        }
    }

    /// Checks that the image is one of `images`, and that the transform is finite.
    pub(crate) fn check(&self, images: usize) -> Result<(), String> {
        if self.image >= images {
            return Err(format!("texture: image {} of {images}", self.image));
        }
        match self.transform.to_cols_array().iter().all(|number| number.is_finite()) {
            true => Ok(()),
            false => Err("texture: its transform is not finite".to_owned()),
        }
    }
}

/// Continuation of an image beyond its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Repeats the image.
    Repeat,
    /// Repeats the image, mirrored at each border.
    Mirror,
    /// Extends the texels of the border.
    Clamp,
}

/// Interpolation between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Takes the nearest texel.
    Nearest,
    /// Interpolates bilinearly.
    Linear,
}

/// An image for textures. A scene stores its texels linearly, in half precision.
///
/// ```
/// use trisect_scene::builder::{
///     Camera, Filter, Lambertian, SceneBuilder, Texels, TextureImage, TextureUse,
/// };
/// use trisect_scene::description::Mesh;
///
/// let mut scene = SceneBuilder::new();
/// let checker = [[0, 0, 0, 255], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 255]];
/// let checker = scene.texture(TextureImage::new(2, 2, Texels::Srgb8(checker.to_vec())));
/// let checker = TextureUse { filter: Filter::Nearest, ..checker };
/// let paint = Lambertian { texture: Some(checker), ..Lambertian::rgb(1.0, 1.0, 1.0) };
/// let paint = scene.material(paint);
/// let square = scene.mesh(
///     Mesh {
///         positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
///         uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
///         triangles: vec![[0, 1, 2], [0, 2, 3]],
///         ..Mesh::default()
///     },
///     paint,
/// );
/// scene.instance(square, glam::DAffine3::IDENTITY);
/// scene.camera(Camera::look_at([0.0, 0.0, 4.0], [0.0, 0.0, 0.0]));
/// let scene = scene.build()?;
/// assert_eq!((scene.textures.len(), scene.texels.len()), (1, 4));
/// # Ok::<(), trisect_scene::SceneError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TextureImage {
    /// Name for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels, top row first.
    pub texels: Texels,
}

impl TextureImage {
    /// Returns an image of `width * height` texels, top row first.
    pub fn new(width: u32, height: u32, texels: Texels) -> Self {
        Self { name: String::new(), width, height, texels }
    }

    /// Returns the image with this name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// Checks that the numbers of texels are in the range that a scene stores.
    pub(crate) fn check_range(&self) -> Result<(), String> {
        let Texels::Float(texels) = &self.texels else { return Ok(()) };
        let wrong = texels.as_flattened().iter().position(|x| !(0.0..=MAX_TEXEL).contains(x));
        wrong.map_or(Ok(()), |at| {
            let (texel, channel) = (at / 4, at % 4);
            Err(format!(
                "image \"{}\": texel {texel} has {} in channel {channel}; it must be from 0 to 65,504",
                self.name, texels[texel][channel]
            ))
        })
    }

    /// Returns the image with its 8-bit channels read as linear, or as sRGB-encoded.
    pub(crate) fn encoded(self: Arc<Self>, linear: bool) -> Arc<Self> {
        let texels = match (&self.texels, linear) {
            (Texels::Srgb8(texels), true) => Texels::Linear8(texels.clone()),
            (Texels::Linear8(texels), false) => Texels::Srgb8(texels.clone()),
            _ => return self,
        };
        Arc::new(Self { name: self.name.clone(), texels, ..*self })
    }
}

/// The texels of an image: red, green, blue, alpha. Alpha is always linear.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// 8 bits per channel, sRGB-encoded.
    Srgb8(Vec<[u8; 4]>),
    /// 8 bits per channel, linear.
    Linear8(Vec<[u8; 4]>),
    /// Linear f32, 0 to 65,504. Values below 6.1e-5 and NaN become 0, and larger ones 65,504; a
    /// [`SceneBuilder`](super::builder::SceneBuilder) refuses NaN and what is out of range.
    Float(Vec<[f32; 4]>),
}

/// Meaning of the texels of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureRole {
    /// Colours.
    Colour,
    /// Numbers, which are stored linearly.
    Numbers,
}
