//! The materials and textures of a scene file, as serde reads them.

use super::name::{Name, Named};
use crate::values::{Angle, TextureNumber};
use serde::Deserialize;

/// A material whose textures and medium are names.
pub type Material<'a> = crate::material::Written<Name<'a>>;

impl Named for Material<'_> {
    const KIND: &'static str = "material";
    const FIELD: &'static str = "materials";
}

/// An image on a surface.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texture<'a> {
    /// File name, relative to the scene file.
    #[serde(borrow)]
    pub file: Name<'a>,
    /// Encoding of the image's numbers.
    #[serde(default)]
    pub color_space: ColorSpace,
    /// Continuation beyond the border.
    #[serde(default)]
    pub wrap: Wrap,
    /// Interpolation between texels.
    #[serde(default)]
    pub filter: Filter,
    /// Scale of the texture coordinates; applied first.
    #[serde(default = "default_scale")]
    pub scale: (TextureNumber, TextureNumber),
    /// Offset of the texture coordinates; applied last.
    #[serde(default = "default_offset")]
    pub offset: (TextureNumber, TextureNumber),
    /// Rotation of the texture coordinates, in degrees; applied between scale and offset.
    #[serde(default = "default_rotation")]
    pub rotation: Angle,
}

impl Named for Texture<'_> {
    const KIND: &'static str = "texture";
    const FIELD: &'static str = "textures";
}

/// Encoding of an image's numbers.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
pub enum ColorSpace {
    /// Colours, sRGB-encoded.
    #[default]
    Srgb,
    /// Linear numbers, used as they are.
    Linear,
}

/// Continuation of an image beyond its border.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub enum Wrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Repeats the image, mirrored at each border.
    Mirror,
    /// Extends the texels of the border.
    Clamp,
}

/// Interpolation between texels.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub enum Filter {
    /// Interpolates bilinearly.
    #[default]
    Linear,
    /// Takes the nearest texel.
    Nearest,
}

fn default_scale() -> (TextureNumber, TextureNumber) {
    (TextureNumber(1.0), TextureNumber(1.0))
}

fn default_offset() -> (TextureNumber, TextureNumber) {
    (TextureNumber(0.0), TextureNumber(0.0))
}

fn default_rotation() -> Angle {
    Angle(0.0)
}
