//! Layers and further lobes of [`MetallicRoughness`](super::surface::MetallicRoughness): those of
//! glTF's extensions.

use crate::ranges::{all, each};
use crate::texture::{TextureRole, TextureUse};
use crate::values::{Angle, Dispersion, FilmIor, Gain, Length, Share, Thickness, number, numbers, some};
use glam::DVec3;
use serde::Deserialize;
use trisect_shared::layers::{GLOSSINESS, LayerTextures, MaterialLayers, SOLID};

/// Transmittance below which a channel of a solid is black.
const BLACK: f64 = 1e-9;

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

/// Layers and further lobes of a material; `None` for those that it does not have.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default, bound = "T: Deserialize<'de>")]
pub struct Layers<T = TextureUse> {
    /// Coat over all else.
    #[serde(deserialize_with = "some")]
    pub coat: Option<Coat<T>>,
    /// Sheen of fibres.
    #[serde(deserialize_with = "some")]
    pub sheen: Option<Sheen<T>>,
    /// Strength and colour of the dielectric's reflection.
    #[serde(deserialize_with = "some")]
    pub specular: Option<Specular<T>>,
    /// Direction of the facets.
    #[serde(deserialize_with = "some")]
    pub anisotropy: Option<Anisotropy<T>>,
    /// Thin film.
    #[serde(deserialize_with = "some")]
    pub iridescence: Option<Iridescence<T>>,
    /// Light that passes diffusely.
    #[serde(deserialize_with = "some")]
    pub diffuse_transmission: Option<DiffuseTransmission<T>>,
    /// Inside, if the surface bounds a solid; otherwise what is transmitted passes a thin wall.
    #[serde(deserialize_with = "some")]
    pub volume: Option<Volume>,
    /// Dispersion of a solid: 20 over its Abbe number (KHR_materials_dispersion).
    #[serde(deserialize_with = "number::<Dispersion, _>")]
    pub dispersion: f64,
    /// True if the alpha of `specular.color_texture` multiplies 1 minus the roughness, as in
    /// KHR_materials_pbrSpecularGlossiness.
    #[serde(skip)]
    pub has_glossiness: bool,
}

impl<T> Default for Coat<T> {
    fn default() -> Self {
        Self { strength: 1.0, roughness: 0.0, texture: None, roughness_texture: None }
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

impl<T> Default for Layers<T> {
    fn default() -> Self {
        Self {
            coat: None,
            sheen: None,
            specular: None,
            anisotropy: None,
            iridescence: None,
            diffuse_transmission: None,
            volume: None,
            dispersion: 0.0,
            has_glossiness: false,
        }
    }
}

impl<T> Coat<T> {
    fn textures(&self) -> [(&Option<T>, TextureRole); 2] {
        [(&self.texture, TextureRole::Numbers), (&self.roughness_texture, TextureRole::Numbers)]
    }

    fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Coat<U>, E> {
        let mut map = |texture: Option<T>| texture.map(&mut *f).transpose();
        Ok(Coat {
            strength: self.strength,
            roughness: self.roughness,
            texture: map(self.texture)?,
            roughness_texture: map(self.roughness_texture)?,
        })
    }

    fn check(&self) -> Result<(), String> {
        all::<Share>("coat strength", &[self.strength])?;
        all::<Share>("coat roughness", &[self.roughness])
    }
}

impl<T> Sheen<T> {
    fn textures(&self) -> [(&Option<T>, TextureRole); 2] {
        [(&self.texture, TextureRole::Colour), (&self.roughness_texture, TextureRole::Numbers)]
    }

    fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Sheen<U>, E> {
        let mut map = |texture: Option<T>| texture.map(&mut *f).transpose();
        Ok(Sheen {
            roughness: self.roughness,
            color: self.color,
            texture: map(self.texture)?,
            roughness_texture: map(self.roughness_texture)?,
        })
    }

    fn check(&self) -> Result<(), String> {
        all::<Share>("sheen roughness", &[self.roughness])?;
        each::<Share>("sheen color", self.color)
    }
}

impl<T> Specular<T> {
    fn textures(&self) -> [(&Option<T>, TextureRole); 2] {
        [(&self.texture, TextureRole::Numbers), (&self.color_texture, TextureRole::Colour)]
    }

    fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Specular<U>, E> {
        let mut map = |texture: Option<T>| texture.map(&mut *f).transpose();
        Ok(Specular {
            strength: self.strength,
            color: self.color,
            texture: map(self.texture)?,
            color_texture: map(self.color_texture)?,
        })
    }

    fn check(&self) -> Result<(), String> {
        all::<Share>("specular strength", &[self.strength])?;
        each::<Gain>("specular color", self.color)
    }
}

impl<T> Anisotropy<T> {
    fn textures(&self) -> [(&Option<T>, TextureRole); 1] {
        [(&self.texture, TextureRole::Numbers)]
    }

    fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Anisotropy<U>, E> {
        let mut map = |texture: Option<T>| texture.map(&mut *f).transpose();
        Ok(Anisotropy { strength: self.strength, rotation: self.rotation, texture: map(self.texture)? })
    }

    fn check(&self) -> Result<(), String> {
        all::<Share>("anisotropy strength", &[self.strength])?;
        all::<Angle>("anisotropy rotation", &[self.rotation])
    }
}

impl<T> Iridescence<T> {
    fn textures(&self) -> [(&Option<T>, TextureRole); 2] {
        [(&self.texture, TextureRole::Numbers), (&self.thickness_texture, TextureRole::Numbers)]
    }

    fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Iridescence<U>, E> {
        let mut map = |texture: Option<T>| texture.map(&mut *f).transpose();
        Ok(Iridescence {
            strength: self.strength,
            ior: self.ior,
            thickness_min: self.thickness_min,
            thickness: self.thickness,
            texture: map(self.texture)?,
            thickness_texture: map(self.thickness_texture)?,
        })
    }

    fn check(&self) -> Result<(), String> {
        all::<Share>("iridescence strength", &[self.strength])?;
        all::<FilmIor>("iridescence ior", &[self.ior])?;
        all::<Thickness>("iridescence thickness_min", &[self.thickness_min])?;
        all::<Thickness>("iridescence thickness", &[self.thickness])
    }
}

impl<T> DiffuseTransmission<T> {
    fn textures(&self) -> [(&Option<T>, TextureRole); 2] {
        [(&self.texture, TextureRole::Numbers), (&self.color_texture, TextureRole::Colour)]
    }

    fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<DiffuseTransmission<U>, E> {
        let mut map = |texture: Option<T>| texture.map(&mut *f).transpose();
        Ok(DiffuseTransmission {
            share: self.share,
            color: self.color,
            texture: map(self.texture)?,
            color_texture: map(self.color_texture)?,
        })
    }

    fn check(&self) -> Result<(), String> {
        all::<Share>("diffuse transmission share", &[self.share])?;
        each::<Share>("diffuse transmission color", self.color)
    }
}

impl<T> Layers<T> {
    /// Returns whether there is no layer.
    pub fn is_empty(&self) -> bool {
        let Self { coat, sheen, specular, anisotropy, iridescence, diffuse_transmission, volume, .. } = self;
        coat.is_none()
            && sheen.is_none()
            && specular.is_none()
            && anisotropy.is_none()
            && iridescence.is_none()
            && diffuse_transmission.is_none()
            && volume.is_none()
    }

    /// Returns whether the surface needs the tangents of its mesh.
    pub fn needs_tangents(&self) -> bool {
        self.anisotropy.as_ref().is_some_and(|anisotropy| anisotropy.strength > 0.0)
    }

    /// Returns the textures with their roles.
    pub(super) fn textures(&self) -> impl Iterator<Item = (&T, TextureRole)> {
        let all = [
            self.coat.as_ref().map(|of| of.textures().to_vec()),
            self.sheen.as_ref().map(|of| of.textures().to_vec()),
            self.specular.as_ref().map(|of| of.textures().to_vec()),
            self.anisotropy.as_ref().map(|of| of.textures().to_vec()),
            self.iridescence.as_ref().map(|of| of.textures().to_vec()),
            self.diffuse_transmission.as_ref().map(|of| of.textures().to_vec()),
        ];
        all.into_iter().flatten().flatten().filter_map(|(texture, role)| Some((texture.as_ref()?, role)))
    }

    /// Returns the layers with each texture replaced by what `f` makes of it.
    pub(super) fn with_textures<U, E>(self, f: &mut impl FnMut(T) -> Result<U, E>) -> Result<Layers<U>, E> {
        Ok(Layers {
            coat: self.coat.map(|of| of.with_textures(f)).transpose()?,
            sheen: self.sheen.map(|of| of.with_textures(f)).transpose()?,
            specular: self.specular.map(|of| of.with_textures(f)).transpose()?,
            anisotropy: self.anisotropy.map(|of| of.with_textures(f)).transpose()?,
            iridescence: self.iridescence.map(|of| of.with_textures(f)).transpose()?,
            diffuse_transmission: self.diffuse_transmission.map(|of| of.with_textures(f)).transpose()?,
            volume: self.volume,
            dispersion: self.dispersion,
            has_glossiness: self.has_glossiness,
        })
    }

    /// Checks that each number is finite and in range.
    pub(super) fn check(&self) -> Result<(), String> {
        self.coat.as_ref().map_or(Ok(()), Coat::check)?;
        self.sheen.as_ref().map_or(Ok(()), Sheen::check)?;
        self.specular.as_ref().map_or(Ok(()), Specular::check)?;
        self.anisotropy.as_ref().map_or(Ok(()), Anisotropy::check)?;
        self.iridescence.as_ref().map_or(Ok(()), Iridescence::check)?;
        self.diffuse_transmission.as_ref().map_or(Ok(()), DiffuseTransmission::check)?;
        if let Some(volume) = &self.volume {
            each::<Share>("attenuation color", volume.attenuation_color)?;
            all::<Length>("attenuation distance", volume.attenuation_distance.as_slice())?;
        }
        all::<Dispersion>("dispersion", &[self.dispersion])
    }
}

impl Layers {
    /// Scales the lengths in the material.
    pub(crate) fn scale(&mut self, scale: f64) {
        if let Some(distance) = self.volume.as_mut().and_then(|volume| volume.attenuation_distance.as_mut()) {
            *distance *= scale;
        }
    }

    /// Returns the device records; `ior` is the index of refraction, and `texture` returns the
    /// index of a texture's record.
    pub(super) fn records(
        &self,
        ior: f64,
        texture: &mut impl FnMut(&Option<TextureUse>) -> Result<u32, String>,
    ) -> Result<(MaterialLayers, LayerTextures), String> {
        let (mut layers, mut textures) = (MaterialLayers::NONE, LayerTextures::NONE);
        if let Some(coat) = &self.coat {
            (layers.coat, layers.coat_roughness) = (coat.strength as f32, coat.roughness as f32);
            textures.coat = texture(&coat.texture)?;
            textures.coat_roughness = texture(&coat.roughness_texture)?;
        }
        if let Some(sheen) = &self.sheen {
            (layers.sheen_color, layers.sheen_roughness) = (sheen.color.as_vec3(), sheen.roughness as f32);
            textures.sheen_color = texture(&sheen.texture)?;
            textures.sheen_roughness = texture(&sheen.roughness_texture)?;
        }
        if let Some(specular) = &self.specular {
            // A number beyond f32's range is one that no reflectance reaches.
            layers.specular_color = specular.color.min(DVec3::splat(1e6)).as_vec3();
            layers.specular = specular.strength as f32;
            textures.specular = texture(&specular.texture)?;
            textures.specular_color = texture(&specular.color_texture)?;
        }
        if self.has_glossiness {
            layers.flags |= GLOSSINESS;
        }
        if let Some(anisotropy) = &self.anisotropy {
            let (sin, cos) = anisotropy.rotation.to_radians().sin_cos();
            layers.anisotropy = anisotropy.strength as f32;
            (layers.anisotropy_cos, layers.anisotropy_sin) = (cos as f32, sin as f32);
            textures.anisotropy = texture(&anisotropy.texture)?;
        }
        if let Some(film) = &self.iridescence {
            (layers.film, layers.film_ior) = (film.strength as f32, film.ior as f32);
            (layers.film_min, layers.film_thickness) = (film.thickness_min as f32, film.thickness as f32);
            textures.film = texture(&film.texture)?;
            textures.film_thickness = texture(&film.thickness_texture)?;
        }
        if let Some(passed) = &self.diffuse_transmission {
            layers.diffuse_transmission = passed.share as f32;
            layers.diffuse_transmission_color = passed.color.as_vec3();
            textures.diffuse_transmission = texture(&passed.texture)?;
            textures.diffuse_transmission_color = texture(&passed.color_texture)?;
        }
        // A boundary of index 0 bends no light: it stands for a reflectance.
        if let Some(volume) = self.volume.as_ref().filter(|_| ior > 0.0) {
            layers.flags |= SOLID;
            if let Some(distance) = volume.attenuation_distance {
                let absorbed = volume.attenuation_color.max(DVec3::splat(BLACK)).map(|c| -c.ln() / distance);
                layers.absorption = absorbed.min(DVec3::splat(f64::from(f32::MAX))).as_vec3();
            }
            // KHR_materials_dispersion: the index differs by this much at both ends of the
            // spectrum.
            layers.dispersion = ((ior - 1.0).max(0.0) * 0.025 * self.dispersion) as f32;
        }
        Ok((layers, textures))
    }
}
