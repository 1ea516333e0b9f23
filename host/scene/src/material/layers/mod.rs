//! Layers and further lobes of [`MetallicRoughness`](super::surface::MetallicRoughness): those of
//! glTF's extensions.

mod kinds;

pub use kinds::{Anisotropy, Coat, DiffuseTransmission, Iridescence, Sheen, Specular, Volume};

use crate::ranges::{all, each};
use crate::texture::{TextureRole, TextureUse};
use crate::values::{Dispersion, Length, Share, number, some};
use glam::{DVec3, Vec3};
use serde::Deserialize;
use trisect_shared::layers::{GLOSSINESS, LayerTextures, MaterialLayers, SOLID};

/// Transmittance below which a channel of a solid is black.
const BLACK: f64 = 1e-9;

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

impl<T> Layers<T> {
    /// Returns whether the layers bound a solid that absorbs light.
    pub(super) fn absorbs(&self) -> bool {
        let absorbs =
            |volume: &Volume| volume.attenuation_distance.is_some() && volume.attenuation_color != DVec3::ONE;
        self.volume.as_ref().is_some_and(absorbs)
    }

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

    /// Returns whether there is nothing but the inside of a solid that absorbs no light.
    pub(super) fn is_clear_solid(&self) -> bool {
        let Self { coat, sheen, specular, anisotropy, iridescence, diffuse_transmission, volume, .. } = self;
        let others = coat.is_some()
            || sheen.is_some()
            || specular.is_some()
            || anisotropy.is_some()
            || iridescence.is_some()
            || diffuse_transmission.is_some();
        let absorbs =
            |volume: &Volume| volume.attenuation_distance.is_some() && volume.attenuation_color != DVec3::ONE;
        !others
            && volume.as_ref().is_some_and(|volume| !absorbs(volume))
            && self.dispersion == 0.0
            && !self.has_glossiness
    }

    /// Returns whether the facets have a direction, for which the surface needs the tangents of its
    /// mesh.
    pub fn is_anisotropic(&self) -> bool {
        self.anisotropy.as_ref().is_some_and(|anisotropy| anisotropy.strength > 0.0)
    }

    /// Returns the textures with their roles.
    pub(super) fn textures(&self) -> impl Iterator<Item = (&T, TextureRole)> {
        let Self { coat, sheen, specular, anisotropy, iridescence, diffuse_transmission, .. } = self;
        let all = coat.iter().flat_map(Coat::textures).chain(sheen.iter().flat_map(Sheen::textures));
        let all = all.chain(specular.iter().flat_map(Specular::textures));
        let all = all.chain(anisotropy.iter().flat_map(Anisotropy::textures));
        let all = all.chain(iridescence.iter().flat_map(Iridescence::textures));
        all.chain(diffuse_transmission.iter().flat_map(DiffuseTransmission::textures))
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
            textures.coat_normal = texture(&coat.normal_texture)?;
            if coat.normal_texture.is_some() {
                let scale = coat.normal_scale as f32;
                layers.coat_normal = Vec3::new(scale, scale, 1.0);
            }
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
