//! Textures of a material: read at a point of a surface, into the material.

use crate::buffer::load;
use crate::features::{FeatureSet, Features, HOLES, TEXTURES};
use crate::material::{BLENDED, MASKED, Material};
use crate::scene::Scene;
use crate::texture::{NO_TEXTURE, sample};
use glam::Vec3;

/// Set of a material's texture slots: a bit for each slot, in the order of the record's fields.
pub type Slots = u32;

/// Slot of [`Material::albedo_texture`].
pub const ALBEDO: Slots = 1 << 0;
/// Slot of [`Material::metallic_roughness_texture`].
pub const METALLIC_ROUGHNESS: Slots = 1 << 1;
/// Slot of [`Material::emission_texture`].
pub const EMISSION: Slots = 1 << 2;
/// Slot of [`Material::transmission_texture`].
pub const TRANSMISSION: Slots = 1 << 3;
/// All slots.
pub const ALL: Slots = 0b1111;

/// Returns material `index` of the scene with its textures of the slots `wanted` read at texture
/// coordinates (`u`, `v`): colours, roughness and so on are multiplied by them.
///
/// The slots are a loop, so that a kernel has the code of a lookup once: inlined for each slot, it
/// is half of a large kernel, which then does not fit a GPU's instruction cache.
///
/// # Safety
///
/// `index` and the scene's textures were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn load_material<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    scene: Scene,
    index: u32,
    wanted: Slots,
    (u, v): (f32, f32),
) -> Material {
    // SAFETY: the caller's promise.
    let mut material = unsafe { load::<Material>(scene.materials, index) };
    if features.has(TEXTURES) {
        let mut slot = ALBEDO;
        while slot < ALL {
            let texture = texture_of(&material, slot);
            if wanted & slot != 0 && texture != NO_TEXTURE {
                // SAFETY: the caller's promise.
                let c = unsafe { sample(scene, texture, u, v) };
                if slot == ALBEDO {
                    material.albedo *= Vec3::new(c.x, c.y, c.z);
                    material.opacity *= c.w;
                } else if slot == METALLIC_ROUGHNESS {
                    material.roughness *= c.y;
                    material.metallic *= c.z;
                } else if slot == EMISSION {
                    material.emission *= Vec3::new(c.x, c.y, c.z);
                } else {
                    material.transmission *= c.x;
                }
            }
            slot <<= 1;
        }
    }
    material
}

/// Returns the index of a slot's texture, or [`NO_TEXTURE`].
#[inline(always)]
fn texture_of(material: &Material, slot: Slots) -> u32 {
    if slot == ALBEDO {
        material.albedo_texture
    } else if slot == METALLIC_ROUGHNESS {
        material.metallic_roughness_texture
    } else if slot == EMISSION {
        material.emission_texture
    } else {
        material.transmission_texture
    }
}

/// Returns the opacity of a material whose textures were read, 0 to 1: the part of the light that
/// does not pass straight through.
#[inline(always)]
pub fn opacity<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, material: &Material) -> f32 {
    if !features.has(HOLES) || material.flags & (MASKED | BLENDED) == 0 {
        1.0
    } else if material.flags & MASKED == 0 {
        material.opacity
    } else if material.opacity >= material.alpha_cutoff {
        1.0
    } else {
        0.0
    }
}
