//! Device records of surfaces.

use super::surface::{
    Conductor, ConductorFresnel, Dielectric, Metal, MetallicRoughness, RoughDielectric, Surface, is_smooth,
};
use crate::texture::TextureUse;
use glam::{DVec3, Vec3};
use trisect_shared::bsdf;
use trisect_shared::layers::{LayerTextures, MaterialLayers};
use trisect_shared::material::{COMPLEX_IOR, Material as Record, SINGLE_SCATTERING};

impl<T> MetallicRoughness<T> {
    /// Returns whether the surface bounds a solid of clear glass without roughness and colour: a
    /// [`Dielectric`].
    pub(super) fn is_clear_solid(&self) -> bool {
        let Self { texture, metallic_roughness_texture, transmission_texture, layers, .. } = self;
        texture.is_none()
            && metallic_roughness_texture.is_none()
            && transmission_texture.is_none()
            && self.base_color == DVec3::ONE
            && (self.metallic, self.transmission) == (0.0, 1.0)
            && self.ior > 0.0
            && is_smooth(self.roughness)
            && layers.is_clear_solid()
    }
}

impl Surface {
    /// Fills in the fields of a device record that describe the surface, and adds its layers.
    /// `texture` returns the index of a texture's record.
    pub(crate) fn fill(
        &self,
        record: &mut Record,
        layers: &mut Vec<(MaterialLayers, LayerTextures)>,
        texture: &mut impl FnMut(&Option<TextureUse>) -> Result<u32, String>,
    ) -> Result<(), String> {
        match self {
            Self::Lambertian(lambertian) => {
                record.kind = bsdf::LAMBERTIAN;
                record.albedo = lambertian.albedo.as_vec3();
                record.albedo_texture = texture(&lambertian.texture)?;
            }
            Self::Interface(_) => {
                record.kind = bsdf::LAMBERTIAN;
                record.albedo = Vec3::ZERO;
            }
            Self::Metal(Metal { albedo, fuzz }) => {
                record.kind = bsdf::METAL;
                record.albedo = albedo.as_vec3();
                record.fuzz = *fuzz as f32;
            }
            Self::Dielectric(Dielectric { ior }) => {
                record.kind = bsdf::DIELECTRIC;
                record.ior = *ior as f32;
            }
            Self::RoughDielectric(RoughDielectric { ior, roughness, multiple_scattering }) => {
                record.kind = if is_smooth(*roughness) { bsdf::DIELECTRIC } else { bsdf::ROUGH_DIELECTRIC };
                record.ior = *ior as f32;
                record.roughness = *roughness as f32;
                if !multiple_scattering {
                    record.flags |= SINGLE_SCATTERING;
                }
            }
            Self::Conductor(Conductor { fresnel, roughness, multiple_scattering }) => {
                record.kind = bsdf::CONDUCTOR;
                record.roughness = *roughness as f32;
                if !multiple_scattering {
                    record.flags |= SINGLE_SCATTERING;
                }
                match fresnel {
                    ConductorFresnel::Ior { eta, k } => {
                        record.flags |= COMPLEX_IOR;
                        record.eta = eta.as_vec3();
                        record.k = k.as_vec3();
                    }
                    ConductorFresnel::Schlick { reflectance } => record.albedo = reflectance.as_vec3(),
                }
            }
            Self::MetallicRoughness(m) if m.is_clear_solid() => {
                record.kind = bsdf::DIELECTRIC;
                record.ior = m.ior as f32;
            }
            Self::MetallicRoughness(m) => {
                record.kind = bsdf::METALLIC_ROUGHNESS;
                record.albedo = m.base_color.as_vec3();
                record.metallic = m.metallic as f32;
                record.roughness = m.roughness as f32;
                record.ior = m.ior as f32;
                record.transmission = m.transmission as f32;
                record.albedo_texture = texture(&m.texture)?;
                record.metallic_roughness_texture = texture(&m.metallic_roughness_texture)?;
                record.transmission_texture = texture(&m.transmission_texture)?;
                if !m.layers.is_empty() {
                    record.kind = bsdf::LAYERED;
                    layers.push(m.layers.records(m.ior, texture)?);
                    record.layers = layers.len() as u32;
                }
            }
        }
        Ok(())
    }
}
