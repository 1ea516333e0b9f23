//! Tile entries: where the camera rays of a tile of the image enter the BVH.
//!
//! The host prunes the BVH for each tile (`trisect::bvh`); [`crate::path`] starts camera rays
//! there. The image does not depend on it (docs/notebook/camera-ray-tiles.md).

use crate::buffer::load;
use crate::bvh::{BvhNode, Child};
use crate::params::RenderParams;
use crate::scene::Scene;

/// Value of [`RenderParams::first_tile_entry`] if camera rays begin at the root.
pub const NO_TILE_ENTRIES: u32 = u32::MAX;

/// Returns the subtree with all primitives that the camera rays of pixel (`x`, `y`) can meet.
///
/// # Safety
///
/// The pixel lies inside the image, and the scene's nodes from `first_tile_entry` on have an entry
/// for each tile of the image.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn tile_entry(params: &RenderParams, scene: Scene, x: u32, y: u32) -> Child {
    if params.first_tile_entry == NO_TILE_ENTRIES {
        return Child(params.root);
    }
    let shift = params.tile_shift & 31;
    let across = ((params.width - 1) >> shift) + 1;
    let tile = (y >> shift) * across + (x >> shift);
    // SAFETY: the caller's promise.
    Child(unsafe { load::<BvhNode>(scene.nodes, params.first_tile_entry + tile) }.tile_entry)
}
