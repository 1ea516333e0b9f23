//! Textures of a description: images, and their use by materials.

use glam::DAffine2;

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

/// An image for textures.
#[derive(Clone, Debug)]
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

/// The texels of an image: red, green, blue, alpha. Alpha is always linear.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits per channel, sRGB-encoded.
    Srgb8(Vec<[u8; 4]>),
    /// 8 bits per channel, linear.
    Linear8(Vec<[u8; 4]>),
    /// Linear f32.
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
