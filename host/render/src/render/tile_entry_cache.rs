//! Cache of the tile entries (the BVH nodes at which the camera rays of each tile start) for the
//! current camera, kept on the device from frame to frame.

use super::{Settings, Traversal};
use crate::Error;
use crate::bvh::{Bvh, build_tile_entries};
use crate::passes::DeviceScene;
use trisect_device::BackendError;
use trisect_kernels::EntryPoint;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::camera::Camera;
use trisect_shared::features::{HEAVY, has_any};
use trisect_shared::params::RenderParams;
use trisect_shared::tile_entry::NO_TILE_ENTRIES;

/// Minimum samples per pixel for which smaller tiles gain more than they cost
/// (docs/notebook/camera-ray-tiles.md).
const FINE_FROM: u32 = 64;

/// BVH that is pruned, and the image for which the device has tile entries.
pub(super) struct TileEntryCache {
    nodes: Vec<BvhNode>,
    root: Child,
    /// Width and height of that image, and the base-2 logarithm of the edge of its tiles; `None`
    /// without tile entries.
    built_for: Option<(u32, u32, u32)>,
    /// Error of the device when it last had no memory for tile entries.
    refused: Option<String>,
}

impl TileEntryCache {
    pub fn new(bvh: Bvh) -> Self {
        Self { nodes: bvh.nodes, root: bvh.root, built_for: None, refused: None }
    }

    /// Returns a cache for another stream, which has no tile entries yet.
    pub fn for_other_stream(&self) -> Self {
        Self { nodes: self.nodes.clone(), built_for: None, refused: None, ..*self }
    }

    /// Gives the device tile entries for the image of these settings, if the kernel can use them.
    /// Without [`Settings::tile`], only kernels without [`HEAVY`] features get them, and only while
    /// the camera rests. If there is no memory for them, the image is rendered without them and is
    /// the same; [`TileEntryCache::refused`] then returns the reason.
    pub fn update(
        &mut self,
        scene: &mut DeviceScene,
        camera: &Camera,
        settings: &Settings,
        kernel: EntryPoint,
        moves: bool,
    ) -> Result<(), Error> {
        let default = match has_any(kernel.features, HEAVY) || moves {
            true => 0,
            false if settings.samples < FINE_FROM => 16,
            false => 8,
        };
        let tile = settings.tile.unwrap_or(default);
        if tile == 0 || Traversal::of(kernel.features) != Traversal::Stack || self.nodes.is_empty() {
            (self.built_for, self.refused) = (None, None);
            return Ok(());
        }
        let wanted = (settings.width, settings.height, tile.ilog2());
        if self.built_for != Some(wanted) {
            (self.built_for, self.refused) = (None, None);
            if let Some(nodes) =
                build_tile_entries(&self.nodes, self.root, camera, wanted.0, wanted.1, wanted.2)
            {
                match scene.write_tile_entries(&nodes) {
                    Ok(()) => self.built_for = Some(wanted),
                    Err(error @ BackendError::TooLarge { .. }) => self.refused = Some(error.to_string()),
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Ok(())
    }

    /// Discards the tile entries, because the camera changed.
    pub fn forget(&mut self) {
        self.built_for = None;
    }

    /// Returns the edge in pixels of the tiles in use; `None` without tile entries.
    pub fn tile(&self) -> Option<u32> {
        self.built_for.map(|(.., shift)| 1 << shift)
    }

    /// Returns why there are no tile entries although there should be.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Writes the index of the first tile entry and the size of the tiles to launch parameters.
    pub fn fill_params(&self, params: &mut RenderParams) {
        (params.first_tile_entry, params.tile_shift) = match self.built_for {
            Some((_, _, shift)) => (self.nodes.len() as u32, shift),
            None => (NO_TILE_ENTRIES, 0),
        };
    }
}
