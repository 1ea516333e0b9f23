//! Lowers materials.

use super::super::description::{
    Alpha, ConductorFresnel, Material as Described, Surface, TextureImage, TextureUse,
};
use super::texture::Packer;
use glam::Vec3;
use trisect_shared::material::{
    BLENDED, COMPLEX_IOR, CONDUCTOR, DIELECTRIC, EMITS_BOTH_SIDES, LAMBERTIAN, MASKED, METAL,
    METALLIC_ROUGHNESS, Material, ROUGH_DIELECTRIC,
};
use trisect_shared::math::luminance;
use trisect_shared::microfacet::MIN_ROUGH_ALPHA;
use trisect_shared::texture::NO_TEXTURE;

/// Returns the record of a material. Until the light table is built, `light_pdf` holds the
/// luminance of the mean emission, twice that if both sides emit.
pub(super) fn lower(
    m: &Described,
    images: &[TextureImage],
    textures: &mut Packer,
) -> Result<Material, String> {
    let mut texture = |use_: &Option<TextureUse>| match use_ {
        Some(use_) => textures.add(use_, images).map_err(|e| format!("material \"{}\": {e}", m.name)),
        None => Ok(NO_TEXTURE),
    };
    let mut record = Material::new(LAMBERTIAN, m.base_color.as_vec3());
    record.albedo_texture = texture(&m.base_color_texture)?;
    record.emission_texture = texture(&m.emission_texture)?;
    match &m.surface {
        Surface::Lambertian => {}
        Surface::Metal { fuzz } => {
            record.kind = METAL;
            record.fuzz = *fuzz as f32;
        }
        Surface::Dielectric { ior } => {
            record.kind = DIELECTRIC;
            record.ior = *ior as f32;
        }
        Surface::RoughDielectric { ior, roughness } => {
            // Below the minimum alpha its boundary is smooth.
            let rough = (*roughness * *roughness) as f32 >= MIN_ROUGH_ALPHA;
            record.kind = if rough { ROUGH_DIELECTRIC } else { DIELECTRIC };
            record.ior = *ior as f32;
            record.roughness = *roughness as f32;
        }
        Surface::Conductor { fresnel, roughness } => {
            record.kind = CONDUCTOR;
            record.roughness = *roughness as f32;
            if let ConductorFresnel::Ior { eta, k } = fresnel {
                record.flags |= COMPLEX_IOR;
                record.eta = eta.as_vec3();
                record.k = k.as_vec3();
            }
        }
        Surface::MetallicRoughness {
            metallic,
            roughness,
            metallic_roughness_texture,
            ior,
            transmission,
            transmission_texture,
        } => {
            record.kind = METALLIC_ROUGHNESS;
            record.metallic = *metallic as f32;
            record.roughness = *roughness as f32;
            record.ior = *ior as f32;
            record.transmission = *transmission as f32;
            record.metallic_roughness_texture = texture(metallic_roughness_texture)?;
            record.transmission_texture = texture(transmission_texture)?;
        }
    }
    if record.kind == DIELECTRIC || record.kind == ROUGH_DIELECTRIC {
        record.albedo = Vec3::ONE;
        record.albedo_texture = NO_TEXTURE;
    }
    record.emission = m.emission.as_vec3();
    if m.emits_both_sides {
        record.flags |= EMITS_BOTH_SIDES;
    }
    record.opacity = m.opacity as f32;
    match m.alpha {
        // Opaque materials have no flag, so the scene needs no kernel for holes.
        Alpha::Opaque => {}
        Alpha::Blend if m.opacity == 1.0 && m.base_color_texture.is_none() => {}
        Alpha::Mask { cutoff } => {
            record.flags |= MASKED;
            record.alpha_cutoff = cutoff as f32;
        }
        Alpha::Blend => record.flags |= BLENDED,
    }
    let [r, g, b] = match record.emission_texture {
        NO_TEXTURE => [1.0; 3],
        index => textures.mean(index),
    };
    let sides = if m.emits_both_sides { 2.0 } else { 1.0 };
    record.light_pdf = sides * luminance(record.emission * Vec3::new(r as f32, g as f32, b as f32));
    Ok(record)
}
