//! Textures of a material: read at a point of a surface, into the material.

use super::is_layered;
use crate::attributes::SurfaceAttributes;
use crate::buffer::{load, load_record};
use crate::features::{ATTRIBUTES, FeatureSet, Features, HOLES, NORMAL_MAPS, TEXTURES};
use crate::layers::{GLOSSINESS, LayerTextures, MaterialLayers, load_layer_textures, load_layers};
use crate::material::{BLENDED, MASKED, Material, UNLIT};
use crate::math::sqrt;
use crate::scene::Scene;
use crate::texture::{NO_TEXTURE, SECOND_SET, Texture, filter};
use glam::{Vec3, Vec4};

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
/// First slot of [`LayerTextures`], whose fields have one each.
const LAYERS: Slots = 1 << 5;
/// Last slot of [`LayerTextures`].
const LAST_OF_LAYERS: Slots = 1 << 16;
/// All slots.
pub const ALL: Slots = 0x1_ffff;
/// Slots that decide how much light passes straight through.
pub const PASSING: Slots = ALBEDO | METALLIC_ROUGHNESS | TRANSMISSION | NORMAL;

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
    /// Layers of a layered material.
    pub layers: MaterialLayers,
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
    let (mut layers, mut of_layers) = (MaterialLayers::NONE, LayerTextures::NONE);
    let layered = is_layered(features, material.kind);
    if layered {
        // SAFETY: the host put the material's layers there, and their textures behind them.
        layers = unsafe { load_layers(scene.materials, material.layers) };
        if features.has::<TEXTURES>() {
            // SAFETY: see above.
            of_layers = unsafe { load_layer_textures(scene.materials, material.layers + 1) };
        }
    }
    if features.has::<TEXTURES>() {
        let mut last = if features.has::<NORMAL_MAPS>() { NORMAL } else { TRANSMISSION };
        if layered {
            last = LAST_OF_LAYERS;
        }
        let mut slot = ALBEDO;
        while slot <= last {
            let texture = if layered && slot >= LAYERS {
                layer_texture(&of_layers, slot)
            } else {
                texture_of(features, &material, slot)
            };
            // Without normal maps that slot is no other's.
            let skipped = layered && slot == NORMAL && !features.has::<NORMAL_MAPS>();
            if wanted & slot != 0 && texture != NO_TEXTURE && !skipped {
                // SAFETY: the caller's promise.
                let t = unsafe { load_record::<Texture>(scene.textures, texture) };
                let (mut u, mut v) = (at.u, at.v);
                if features.has::<ATTRIBUTES>() && t.flags & SECOND_SET != 0 {
                    (u, v) = (at.attributes.u, at.attributes.v);
                }
                // SAFETY: the caller's promise.
                let c = unsafe { filter(scene, t, u, v) };
                if layered && slot >= LAYERS {
                    read_layer(&mut layers, &mut material, slot, c);
                } else if slot == ALBEDO {
                    material.albedo *= Vec3::new(c.x, c.y, c.z);
                    material.opacity *= c.w;
                } else if slot == METALLIC_ROUGHNESS {
                    material.roughness *= c.y;
                    material.metallic *= c.z;
                } else if slot == EMISSION {
                    material.emission *= Vec3::new(c.x, c.y, c.z);
                } else if !features.has::<NORMAL_MAPS>() || slot == TRANSMISSION {
                    material.transmission *= c.x;
                } else {
                    let scale = material.normal_scale;
                    normal = Vec3::new((2.0 * c.x - 1.0) * scale, (2.0 * c.y - 1.0) * scale, 2.0 * c.z - 1.0);
                }
            }
            slot <<= 1;
        }
    }
    if features.has::<ATTRIBUTES>() && wanted & ALBEDO != 0 {
        material.albedo *= at.attributes.color;
        material.opacity *= at.attributes.opacity;
        if material.flags & UNLIT != 0 {
            material.emission *= at.attributes.color;
        }
    }
    TexturedMaterial { material, normal, layers }
}

/// Returns the index of the texture in a slot of layers, or [`NO_TEXTURE`].
#[inline(always)]
fn layer_texture(textures: &LayerTextures, slot: Slots) -> u32 {
    if slot == LAYERS {
        textures.coat
    } else if slot == LAYERS << 1 {
        textures.coat_roughness
    } else if slot == LAYERS << 2 {
        textures.specular
    } else if slot == LAYERS << 3 {
        textures.specular_color
    } else if slot == LAYERS << 4 {
        textures.sheen_color
    } else if slot == LAYERS << 5 {
        textures.sheen_roughness
    } else if slot == LAYERS << 6 {
        textures.anisotropy
    } else if slot == LAYERS << 7 {
        textures.film
    } else if slot == LAYERS << 8 {
        textures.film_thickness
    } else if slot == LAYERS << 9 {
        textures.diffuse_transmission
    } else if slot == LAYERS << 10 {
        textures.diffuse_transmission_color
    } else {
        textures.coat_normal
    }
}

/// Puts the texel `c` of the texture in a slot into the layers.
#[inline(always)]
fn read_layer(layers: &mut MaterialLayers, material: &mut Material, slot: Slots, c: Vec4) {
    let color = Vec3::new(c.x, c.y, c.z);
    if slot == LAYERS {
        layers.coat *= c.x;
    } else if slot == LAYERS << 1 {
        layers.coat_roughness *= c.y;
    } else if slot == LAYERS << 2 {
        layers.specular *= c.w;
    } else if slot == LAYERS << 3 {
        layers.specular_color *= color;
        if layers.flags & GLOSSINESS != 0 {
            material.roughness = 1.0 - (1.0 - material.roughness) * c.w;
        }
    } else if slot == LAYERS << 4 {
        layers.sheen_color *= color;
    } else if slot == LAYERS << 5 {
        layers.sheen_roughness *= c.w;
    } else if slot == LAYERS << 6 {
        let (x, y) = (2.0 * c.x - 1.0, 2.0 * c.y - 1.0);
        let length2 = x * x + y * y;
        if length2 > 1e-6 {
            let scale = 1.0 / sqrt(length2);
            let (cos, sin) = (layers.anisotropy_cos, layers.anisotropy_sin);
            layers.anisotropy_cos = (x * cos - y * sin) * scale;
            layers.anisotropy_sin = (x * sin + y * cos) * scale;
        }
        layers.anisotropy *= c.z;
    } else if slot == LAYERS << 7 {
        layers.film *= c.x;
    } else if slot == LAYERS << 8 {
        layers.film_thickness = layers.film_min + (layers.film_thickness - layers.film_min) * c.y;
    } else if slot == LAYERS << 9 {
        layers.diffuse_transmission *= c.w;
    } else if slot == LAYERS << 10 {
        layers.diffuse_transmission_color *= color;
    } else {
        layers.coat_normal *= color * 2.0 - Vec3::ONE;
    }
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
    } else if !features.has::<NORMAL_MAPS>() || slot == TRANSMISSION {
        material.transmission_texture
    } else {
        material.normal_texture
    }
}

/// Returns the opacity of a material whose textures were read, 0 to 1: the part of the light that
/// does not pass straight through.
#[inline(always)]
pub fn opacity<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, material: &Material) -> f32 {
    if !features.has::<HOLES>() || material.flags & (MASKED | BLENDED) == 0 {
        1.0
    } else if material.flags & MASKED == 0 {
        material.opacity
    } else if material.opacity >= material.alpha_cutoff {
        1.0
    } else {
        0.0
    }
}
