//! Layers of materials: loaded from the array of materials, in which they stand.

use crate::buffer::load_other;
use crate::buffer_layout::Packed;
use crate::material::Material;
pub use crate::records::layers::{GLOSSINESS, LayerTextures, MaterialLayers, SOLID};

/// Returns the layers that stand at `index` of the array of materials.
///
/// # Safety
///
/// `index < materials.len()`, and the host put layers there.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn load_layers(materials: &[Packed<Material>], index: u32) -> MaterialLayers {
    // SAFETY: the caller's promise.
    unsafe { load_other::<Material, _>(materials, index) }
}

/// Returns the textures of the layers that stand at `index` of the array of materials.
///
/// # Safety
///
/// As [`load_layers`]; `index` is the one behind that of the layers.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn load_layer_textures(materials: &[Packed<Material>], index: u32) -> LayerTextures {
    // SAFETY: the caller's promise.
    unsafe { load_other::<Material, _>(materials, index) }
}
