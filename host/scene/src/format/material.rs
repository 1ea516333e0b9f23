//! The materials and textures of a scene file, as serde reads them.

use super::name::{Name, Named, some};
use crate::values::{Absorption, Albedo, Angle, Colour, Eta, Ior, Radiance, Share, TextureNumber};
use serde::Deserialize;

/// A material.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Material<'a> {
    /// Diffuse reflection.
    Lambertian {
        /// Reflected fraction.
        albedo: Albedo,
        /// Texture that multiplies `albedo`.
        #[serde(default, borrow, deserialize_with = "some")]
        texture: Option<Name<'a>>,
    },
    /// A blurred mirror.
    Metal {
        /// Reflected fraction.
        albedo: Albedo,
        /// Radius of the ball of random offsets to the mirrored direction.
        #[serde(default = "zero")]
        fuzz: Share,
    },
    /// Clear glass.
    Dielectric {
        /// Index of refraction inside, relative to outside.
        ior: Ior,
    },
    /// A rough metal.
    Conductor {
        /// Fresnel reflectance.
        fresnel: ConductorFresnel,
        /// Roughness; GGX alpha is its square.
        roughness: Share,
    },
    /// Clear glass with a rough boundary.
    RoughDielectric {
        /// Index of refraction inside, relative to outside.
        ior: Ior,
        /// Roughness; GGX alpha is its square.
        roughness: Share,
    },
    /// A light that reflects nothing.
    Emissive {
        /// Emitted radiance, equal in all directions.
        radiance: Colour,
        /// True if the back emits too.
        #[serde(default)]
        two_sided: bool,
        /// Texture that multiplies `radiance`.
        #[serde(default, borrow, deserialize_with = "some")]
        texture: Option<Name<'a>>,
    },
    /// glTF's metallic-roughness material.
    MetallicRoughness {
        /// Diffuse colour of a dielectric, reflectance of a metal.
        #[serde(default = "white")]
        base_color: Albedo,
        /// 0 for a dielectric, 1 for a metal.
        #[serde(default = "one")]
        metallic: Share,
        /// Roughness; GGX alpha is its square.
        #[serde(default = "one")]
        roughness: Share,
        /// Index of refraction of the dielectric's boundary.
        #[serde(default = "default_ior")]
        ior: Ior,
        /// Fraction of the light that enters a dielectric and passes through its thin wall.
        #[serde(default = "zero")]
        transmission: Share,
        /// Emitted radiance.
        #[serde(default = "dark")]
        emission: Colour,
        /// Texture that multiplies `base_color`; its alpha multiplies `opacity`.
        #[serde(default, borrow, deserialize_with = "some")]
        texture: Option<Name<'a>>,
        /// Texture whose green multiplies `roughness` and whose blue multiplies `metallic`.
        #[serde(default, borrow, deserialize_with = "some")]
        metallic_roughness_texture: Option<Name<'a>>,
        /// Texture that multiplies `emission`.
        #[serde(default, borrow, deserialize_with = "some")]
        emission_texture: Option<Name<'a>>,
        /// Fraction of the light that meets the surface; the rest passes straight through.
        #[serde(default = "one")]
        opacity: Share,
        /// Threshold of opacity: the surface exists where its opacity is at least this.
        #[serde(default, deserialize_with = "some")]
        alpha_cutoff: Option<Share>,
        /// True if the back emits too.
        #[serde(default)]
        two_sided: bool,
    },
}

impl Named for Material<'_> {
    const KIND: &'static str = "material";
    const FIELD: &'static str = "materials";
}

impl<'a> Material<'a> {
    /// Returns the names of the textures that the material refers to.
    pub fn textures(&self) -> impl Iterator<Item = &Name<'a>> {
        let names = match self {
            Self::Lambertian { texture, .. } | Self::Emissive { texture, .. } => {
                [texture.as_ref(), None, None]
            }
            Self::MetallicRoughness { texture, metallic_roughness_texture, emission_texture, .. } => {
                [texture.as_ref(), metallic_roughness_texture.as_ref(), emission_texture.as_ref()]
            }
            Self::Metal { .. }
            | Self::Dielectric { .. }
            | Self::Conductor { .. }
            | Self::RoughDielectric { .. } => [None; 3],
        };
        names.into_iter().flatten()
    }
}

/// A conductor's reflectance.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ConductorFresnel {
    /// Fresnel's equations for a complex index of refraction, eta + i k, by channel.
    Ior {
        /// Real part of the index.
        eta: (Eta, Eta, Eta),
        /// Imaginary part of the index (absorption).
        k: (Absorption, Absorption, Absorption),
    },
    /// Schlick's approximation.
    Schlick {
        /// Reflectance at normal incidence.
        reflectance: Albedo,
    },
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

fn zero() -> Share {
    Share(0.0)
}

fn one() -> Share {
    Share(1.0)
}

fn white() -> Albedo {
    (one(), one(), one())
}

fn dark() -> Colour {
    (Radiance(0.0), Radiance(0.0), Radiance(0.0))
}

fn default_ior() -> Ior {
    Ior(1.5)
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
