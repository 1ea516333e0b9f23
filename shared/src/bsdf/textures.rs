//! Textures of a material: read at a point of a surface, into the material.

use crate::attributes::SurfaceAttributes;
use crate::buffer::load;
use crate::features::{ATTRIBUTES, FeatureSet, Features, HOLES, NORMAL_MAPS, TEXTURES};
use crate::material::{BLENDED, MASKED, Material};
use crate::scene::Scene;
use crate::texture::{NO_TEXTURE, SECOND_SET, Texture, filter};
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
/// Slot of [`Material::normal_texture`].
pub const NORMAL: Slots = 1 << 4;
/// All slots.
pub const ALL: Slots = 0b1_1111;

/// Point of a surface at which textures are read.
#[derive(Clone, Copy)]
pub struct TexturePoint {
    /// Texture coordinates of the first set.
    pub u: f32,
    /// See `u`.
    pub v: f32,
    /// Further attributes there.
    pub attributes: SurfaceAttributes,
}

/// Material whose textures were read. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub struct TexturedMaterial {
    /// Material.
    pub material: Material,
    /// Normal in tangent space, not of unit length: (0, 0, 1) without a normal map.
    pub normal: Vec3,
}

/// Returns material `index` of the scene with its textures of the slots `wanted` read at a point of
/// a surface: colours, roughness and so on are multiplied by them, and by the attributes of the
/// mesh.
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
    at: TexturePoint,
) -> TexturedMaterial {
    // SAFETY: the caller's promise.
    let mut material = unsafe { load::<Material>(scene.materials, index) };
    let mut normal = Vec3::Z;
    if features.has(TEXTURES) {
        let last = if features.has(NORMAL_MAPS) { NORMAL } else { TRANSMISSION };
        let mut slot = ALBEDO;
        while slot <= last {
            let texture = texture_of(features, &material, slot);
            if wanted & slot != 0 && texture != NO_TEXTURE {
                // SAFETY: the caller's promise.
                let t = unsafe { load::<Texture>(scene.textures, texture) };
                let (mut u, mut v) = (at.u, at.v);
                if features.has(ATTRIBUTES) && t.flags & SECOND_SET != 0 {
                    (u, v) = (at.attributes.u, at.attributes.v);
                }
                // SAFETY: the caller's promise.
                let c = unsafe { filter(scene, t, u, v) };
                if slot == ALBEDO {
                    material.albedo *= Vec3::new(c.x, c.y, c.z);
                    material.opacity *= c.w;
                } else if slot == METALLIC_ROUGHNESS {
                    material.roughness *= c.y;
                    material.metallic *= c.z;
                } else if slot == EMISSION {
                    material.emission *= Vec3::new(c.x, c.y, c.z);
                } else if !features.has(NORMAL_MAPS) || slot == TRANSMISSION {
                    material.transmission *= c.x;
                } else {
                    let scale = material.normal_scale;
                    normal = Vec3::new((2.0 * c.x - 1.0) * scale, (2.0 * c.y - 1.0) * scale, 2.0 * c.z - 1.0);
                }
            }
            slot <<= 1;
        }
    }
    if features.has(ATTRIBUTES) && wanted & ALBEDO != 0 {
        material.albedo *= at.attributes.color;
        material.opacity *= at.attributes.opacity;
    }
    TexturedMaterial { material, normal }
}

/// Returns the index of a slot's texture, or [`NO_TEXTURE`].
#[inline(always)]
fn texture_of<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    material: &Material,
    slot: Slots,
) -> u32 {
    if slot == ALBEDO {
        material.albedo_texture
    } else if slot == METALLIC_ROUGHNESS {
        material.metallic_roughness_texture
    } else if slot == EMISSION {
        material.emission_texture
    } else if !features.has(NORMAL_MAPS) || slot == TRANSMISSION {
        material.transmission_texture
    } else {
        material.normal_texture
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
