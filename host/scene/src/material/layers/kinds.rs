//! The layers, one struct each.

use crate::ranges::{all, each};
use crate::texture::{TextureRole, TextureUse};
use crate::values::{Angle, FilmIor, Gain, Length, Share, TextureNumber, Thickness, number, numbers, some};
use glam::DVec3;
use serde::Deserialize;

/// Coat over all other layers (KHR_materials_clearcoat): a boundary of index 1.5.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct Coat<T = TextureUse> {
    /// Strength, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub strength: f64,
    /// Roughness, 0 to 1; GGX alpha is its square.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub roughness: f64,
    /// Texture whose red multiplies `strength`.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
    /// Texture whose green multiplies `roughness`.
    #[serde(deserialize_with = "some")]
    pub roughness_texture: Option<T>,
    /// Normal map of the coat, in the tangent space of a mesh; the surface's does not bend it.
    #[serde(deserialize_with = "some")]
    pub normal_texture: Option<T>,
    /// Factor of the normal map's x and y.
    #[serde(deserialize_with = "number::<TextureNumber, _>")]
    pub normal_scale: f64,
}

/// Sheen of fibres (KHR_materials_sheen).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct Sheen<T = TextureUse> {
    /// Roughness, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub roughness: f64,
    /// Colour, each 0 to 1.
    #[serde(deserialize_with = "numbers::<Share, _>")]
    pub color: DVec3,
    /// Texture that multiplies `color`.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
    /// Texture whose alpha multiplies `roughness`.
    #[serde(deserialize_with = "some")]
    pub roughness_texture: Option<T>,
}

/// Strength and colour of the dielectric's reflection (KHR_materials_specular).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct Specular<T = TextureUse> {
    /// Strength, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub strength: f64,
    /// Colour of the reflectance at normal incidence, each 0 or more.
    #[serde(deserialize_with = "numbers::<Gain, _>")]
    pub color: DVec3,
    /// Texture whose alpha multiplies `strength`.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
    /// Texture that multiplies `color`.
    #[serde(deserialize_with = "some")]
    pub color_texture: Option<T>,
}

/// Facets stretched along a direction (KHR_materials_anisotropy).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct Anisotropy<T = TextureUse> {
    /// Strength, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub strength: f64,
    /// Angle from the tangent to the direction, in degrees, counter-clockwise.
    #[serde(deserialize_with = "number::<Angle, _>")]
    pub rotation: f64,
    /// Texture whose red and green are the direction, and whose blue multiplies `strength`.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
}

/// Thin film on the surface (KHR_materials_iridescence).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct Iridescence<T = TextureUse> {
    /// Strength, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub strength: f64,
    /// Index of refraction of the film.
    #[serde(deserialize_with = "number::<FilmIor, _>")]
    pub ior: f64,
    /// Thickness where the texture is 0, in nanometres.
    #[serde(deserialize_with = "number::<Thickness, _>")]
    pub thickness_min: f64,
    /// Thickness where the texture is 1 or missing, in nanometres.
    #[serde(deserialize_with = "number::<Thickness, _>")]
    pub thickness: f64,
    /// Texture whose red multiplies `strength`.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
    /// Texture whose green chooses the thickness.
    #[serde(deserialize_with = "some")]
    pub thickness_texture: Option<T>,
}

/// Light that passes a thin wall diffusely (KHR_materials_diffuse_transmission).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct DiffuseTransmission<T = TextureUse> {
    /// Share of the diffuse light that passes, 0 to 1.
    #[serde(deserialize_with = "number::<Share, _>")]
    pub share: f64,
    /// Colour of the light that passes, each 0 to 1.
    #[serde(deserialize_with = "numbers::<Share, _>")]
    pub color: DVec3,
    /// Texture whose alpha multiplies `share`.
    #[serde(deserialize_with = "some")]
    pub texture: Option<T>,
    /// Texture that multiplies `color`.
    #[serde(deserialize_with = "some")]
    pub color_texture: Option<T>,
}

/// Inside of a solid (KHR_materials_volume).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Volume {
    /// Part of white light that is left after `attenuation_distance`, by channel, 0 to 1.
    #[serde(deserialize_with = "numbers::<Share, _>")]
    pub attenuation_color: DVec3,
    /// Distance in scene units; without it nothing is absorbed.
    #[serde(deserialize_with = "distance")]
    pub attenuation_distance: Option<f64>,
}

fn distance<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    number::<Length, _>(deserializer).map(Some)
}

impl<T> Default for Coat<T> {
    fn default() -> Self {
        Self {
            strength: 1.0,
            roughness: 0.0,
            texture: None,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

impl<T> Default for Sheen<T> {
    fn default() -> Self {
        Self { roughness: 0.5, color: DVec3::ONE, texture: None, roughness_texture: None }
    }
}

impl<T> Default for Specular<T> {
    fn default() -> Self {
        Self { strength: 1.0, color: DVec3::ONE, texture: None, color_texture: None }
    }
}

impl<T> Default for Anisotropy<T> {
    fn default() -> Self {
        Self { strength: 1.0, rotation: 0.0, texture: None }
    }
}

impl<T> Default for Iridescence<T> {
    fn default() -> Self {
        Self {
            strength: 1.0,
            ior: 1.3,
            thickness_min: 100.0,
            thickness: 400.0,
            texture: None,
            thickness_texture: None,
        }
    }
}

impl<T> Default for DiffuseTransmission<T> {
    fn default() -> Self {
        Self { share: 1.0, color: DVec3::ONE, texture: None, color_texture: None }
    }
}

impl Default for Volume {
    fn default() -> Self {
        Self { attenuation_color: DVec3::ONE, attenuation_distance: None }
    }
}

/// Implements what all layers have, from their fields: numbers and colours with the types that a
/// scene file reads them with, and textures with their roles.
macro_rules! layers {
    ($($layer:ident $name:literal:
        [$($number:ident: $type:ty),*], [$($color:ident: $color_type:ty),*], [$($texture:ident: $role:ident),*];
    )*) => {$(
        impl<T> $layer<T> {
            /// Returns the textures that the layer may have, with their roles.
            pub(super) fn textures(&self) -> impl Iterator<Item = (&T, TextureRole)> {
                let all = [$((&self.$texture, TextureRole::$role)),*];
                all.into_iter().filter_map(|(texture, role)| Some((texture.as_ref()?, role)))
            }

            /// Returns the layer with each texture replaced by what `f` makes of it.
            pub(super) fn with_textures<U, E>(
                self,
                f: &mut impl FnMut(T) -> Result<U, E>,
            ) -> Result<$layer<U>, E> {
                Ok($layer {
                    $($number: self.$number,)*
                    $($color: self.$color,)*
                    $($texture: self.$texture.map(&mut *f).transpose()?,)*
                })
            }

            /// Checks that each number is finite and in range.
            pub(super) fn check(&self) -> Result<(), String> {
                $(all::<$type>(concat!($name, " ", stringify!($number)), &[self.$number])?;)*
                $(each::<$color_type>(concat!($name, " ", stringify!($color)), self.$color)?;)*
                Ok(())
            }
        }
    )*};
}

layers! {
    Coat "coat":
        [strength: Share, roughness: Share, normal_scale: TextureNumber], [],
        [texture: Numbers, roughness_texture: Numbers, normal_texture: Numbers];
    Sheen "sheen":
        [roughness: Share], [color: Share], [texture: Colour, roughness_texture: Numbers];
    Specular "specular":
        [strength: Share], [color: Gain], [texture: Numbers, color_texture: Colour];
    Anisotropy "anisotropy":
        [strength: Share, rotation: Angle], [], [texture: Numbers];
    Iridescence "iridescence":
        [strength: Share, ior: FilmIor, thickness_min: Thickness, thickness: Thickness], [],
        [texture: Numbers, thickness_texture: Numbers];
    DiffuseTransmission "diffuse transmission":
        [share: Share], [color: Share], [texture: Numbers, color_texture: Colour];
}
