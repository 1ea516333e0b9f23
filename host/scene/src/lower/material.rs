//! Lowers materials.

use super::super::description::{Alpha, Material as Described, Surface, TextureImage, TextureUse};
use super::texture::Packer;
use glam::Vec3;
use std::sync::Arc;
use trisect_shared::bsdf::LAMBERTIAN;
use trisect_shared::layers::{LayerTextures, MaterialLayers};
use trisect_shared::material::{BLENDED, EMITS_BOTH_SIDES, MASKED, Material, UNLIT};
use trisect_shared::math::luminance;
use trisect_shared::texture::NO_TEXTURE;

/// Returns the record of a material, and adds its layers to `layers`. Until the light table is
/// built, `light_pdf` holds the luminance of the mean emission, twice that if both sides emit. With
/// `fading_vertices` a mesh of this material has vertices of an opacity below 1.
pub(super) fn lower(
    m: &Described,
    fading_vertices: bool,
    images: &[Arc<TextureImage>],
    (textures, layers): (&mut Packer, &mut Vec<(MaterialLayers, LayerTextures)>),
) -> Result<Material, String> {
    let mut texture = |use_: &Option<TextureUse>| match use_ {
        Some(use_) => textures.add(use_, images).map_err(|e| format!("material \"{}\": {e}", m.name)),
        None => Ok(NO_TEXTURE),
    };
    let mut record = Material::new(LAMBERTIAN, Vec3::ONE);
    m.surface.fill(&mut record, layers, &mut texture)?;
    record.emission_texture = texture(&m.emission_texture)?;
    record.normal_texture = texture(&m.normal_texture)?;
    record.normal_scale = m.normal_scale as f32;
    record.emission = m.emission.as_vec3();
    if m.emits_both_sides {
        record.flags |= EMITS_BOTH_SIDES;
    }
    record.opacity = m.opacity as f32;
    if matches!(m.surface, Surface::Interface(_)) {
        (record.opacity, record.flags) = (0.0, record.flags | BLENDED);
    }
    match m.alpha {
        // Opaque materials have no flag, so the scene needs no kernel for holes.
        Alpha::Opaque => {}
        Alpha::Blend if m.opacity == 1.0 && record.albedo_texture == NO_TEXTURE && !fading_vertices => {}
        Alpha::Mask { cutoff } => {
            record.flags |= MASKED;
            record.alpha_cutoff = cutoff as f32;
        }
        Alpha::Blend => record.flags |= BLENDED,
    }
    if m.is_unlit {
        record.flags |= UNLIT;
        return Ok(record);
    }
    let [r, g, b] = match record.emission_texture {
        NO_TEXTURE => [1.0; 3],
        index => textures.mean(index),
    };
    let sides = if m.emits_both_sides { 2.0 } else { 1.0 };
    record.light_pdf = sides * luminance(record.emission * Vec3::new(r as f32, g as f32, b as f32));
    Ok(record)
}
