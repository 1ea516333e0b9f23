//! Materials and the images on them.

use super::name::{Name, Named, some};
use crate::scene::values::{Absorption, Albedo, Angle, Colour, Eta, Ior, Radiance, Share, TextureNumber};
use serde::Deserialize;

/// A material.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Material<'a> {
    /// Diffuse.
    Lambertian {
        /// Reflected share.
        albedo: Albedo,
        /// Multiplies it.
        #[serde(default, borrow, deserialize_with = "some")]
        texture: Option<Name<'a>>,
    },
    /// A mirror, blurred.
    Metal {
        /// Reflected share.
        albedo: Albedo,
        /// Radius of the ball that moves the mirrored direction.
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
        /// How much it reflects.
        fresnel: ConductorFresnel,
        /// GGX alpha is its square.
        roughness: Share,
    },
    /// Clear glass with a rough boundary.
    RoughDielectric {
        /// Index of refraction inside, relative to outside.
        ior: Ior,
        /// GGX alpha is its square.
        roughness: Share,
    },
    /// A light that reflects nothing.
    Emissive {
        /// The same in all directions.
        radiance: Colour,
        /// Whether the back emits, too.
        #[serde(default)]
        two_sided: bool,
        /// Multiplies the radiance.
        #[serde(default, borrow, deserialize_with = "some")]
        texture: Option<Name<'a>>,
    },
    /// glTF's material.
    MetallicRoughness {
        /// A dielectric's diffuse colour, a metal's reflectance.
        #[serde(default = "white")]
        base_color: Albedo,
        /// 0 a dielectric, 1 a metal.
        #[serde(default = "one")]
        metallic: Share,
        /// GGX alpha is its square.
        #[serde(default = "one")]
        roughness: Share,
        /// Of the dielectric's boundary.
        #[serde(default = "default_ior")]
        ior: Ior,
        /// Share of the light that enters a dielectric and passes through its thin wall.
        #[serde(default = "zero")]
        transmission: Share,
        /// Radiance.
        #[serde(default = "dark")]
        emission: Colour,
        /// Multiplies `base_color`, its alpha `opacity`.
        #[serde(default, borrow, deserialize_with = "some")]
        texture: Option<Name<'a>>,
        /// Green multiplies `roughness`, blue `metallic`.
        #[serde(default, borrow, deserialize_with = "some")]
        metallic_roughness_texture: Option<Name<'a>>,
        /// Multiplies `emission`.
        #[serde(default, borrow, deserialize_with = "some")]
        emission_texture: Option<Name<'a>>,
        /// Share that does not pass through unseen.
        #[serde(default = "one")]
        opacity: Share,
        /// It is there where its opacity is at least this, else not.
        #[serde(default, deserialize_with = "some")]
        alpha_cutoff: Option<Share>,
        /// Whether the back emits, too.
        #[serde(default)]
        two_sided: bool,
    },
}

impl Named for Material<'_> {
    const KIND: &'static str = "material";
    const FIELD: &'static str = "materials";
}

impl<'a> Material<'a> {
    /// The textures that it refers to.
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
    /// Fresnel's equations for a complex index, eta + i k, by channel.
    Ior {
        /// Real part.
        eta: (Eta, Eta, Eta),
        /// Absorption.
        k: (Absorption, Absorption, Absorption),
    },
    /// Schlick's approximation.
    Schlick {
        /// At normal incidence.
        reflectance: Albedo,
    },
}

/// An image on a surface.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Texture<'a> {
    /// Relative to the scene file.
    #[serde(borrow)]
    pub file: Name<'a>,
    /// What its numbers mean.
    #[serde(default)]
    pub color_space: ColorSpace,
    /// Beyond its border.
    #[serde(default)]
    pub wrap: Wrap,
    /// Between its texels.
    #[serde(default)]
    pub filter: Filter,
    /// Of the texture coordinates; done first.
    #[serde(default = "default_scale")]
    pub scale: (TextureNumber, TextureNumber),
    /// Of the texture coordinates; done last.
    #[serde(default = "default_offset")]
    pub offset: (TextureNumber, TextureNumber),
    /// Of the texture coordinates.
    #[serde(default = "default_rotation")]
    pub rotation: Angle,
}

impl Named for Texture<'_> {
    const KIND: &'static str = "texture";
    const FIELD: &'static str = "textures";
}

/// What an image's numbers mean.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
pub enum ColorSpace {
    /// Colours, encoded with sRGB's curve.
    #[default]
    Srgb,
    /// Numbers, as they are.
    Linear,
}

/// What lies beyond an image's border.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image again, mirrored.
    Mirror,
    /// Its border.
    Clamp,
}

/// How to read between texels.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub enum Filter {
    /// Bilinear.
    #[default]
    Linear,
    /// The nearest texel.
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
