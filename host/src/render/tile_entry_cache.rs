//! The tree as the camera sees it, kept from frame to frame.

use super::{Settings, Traversal};
use crate::Error;
use crate::backend::{Backend, BackendError};
use crate::bvh::{Bvh, build_tile_entries};
use trisect_kernels::Variant;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::camera::Camera;
use trisect_shared::features::{HEAVY, has_any};
use trisect_shared::params::RenderParams;
use trisect_shared::tile_entry::NO_TILE_ENTRIES;

/// Samples a pixel from which on smaller tiles gain more than they cost, by docs/performance.md.
const FINE_FROM: u32 = 64;

/// What a tree is pruned from, and for which image the backend has it pruned.
pub(super) struct TileEntryCache {
    nodes: Vec<BvhNode>,
    root: Child,
    /// Width, height, and the edge of a tile as a power of two.
    built_for: Option<(u32, u32, u32)>,
    /// Why the backend did not take what was pruned last.
    refused: Option<String>,
}

impl TileEntryCache {
    pub fn new(bvh: Bvh) -> Self {
        Self { nodes: bvh.nodes, root: bvh.root, built_for: None, refused: None }
    }

    /// The same for another backend, which has no view yet.
    pub fn for_other_backend(&self) -> Self {
        Self { nodes: self.nodes.clone(), built_for: None, refused: None, ..*self }
    }

    /// Gives the backend the view of the image that the settings describe, if the kernel can make use of one: by default only one whose
    /// paths are short, so that its camera rays are a good part of all, and while the camera rests. Without memory for it, the image is made without it, and is the
    /// same: [`TileEntryCache::refused`] says so.
    pub fn update(
        &mut self,
        backend: &mut dyn Backend,
        camera: &Camera,
        settings: &Settings,
        variant: Variant,
        moves: bool,
    ) -> Result<(), Error> {
        let default = match has_any(variant.features, HEAVY) || moves {
            true => 0,
            false if settings.samples < FINE_FROM => 16,
            false => 8,
        };
        let tile = settings.tile.unwrap_or(default);
        if tile == 0 || Traversal::of(variant.features) != Traversal::Stack || self.nodes.is_empty() {
            (self.built_for, self.refused) = (None, None);
            return Ok(());
        }
        let wanted = (settings.width, settings.height, tile.ilog2());
        if self.built_for != Some(wanted) {
            (self.built_for, self.refused) = (None, None);
            if let Some(nodes) =
                build_tile_entries(&self.nodes, self.root, camera, wanted.0, wanted.1, wanted.2)
            {
                match backend.upload_tile_entries(&nodes) {
                    Ok(()) => self.built_for = Some(wanted),
                    Err(error @ BackendError::TooLarge { .. }) => self.refused = Some(error.to_string()),
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Ok(())
    }

    /// Forgets what an earlier camera saw.
    pub fn forget(&mut self) {
        self.built_for = None;
    }

    /// Pixels along the edge of the tiles that the image is made by; `None` without.
    pub fn tile(&self) -> Option<u32> {
        self.built_for.map(|(.., shift)| 1 << shift)
    }

    /// Why there are no tiles where there should be some.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Says in a launch record where the view is.
    pub fn fill_params(&self, params: &mut RenderParams) {
        (params.first_tile_entry, params.tile_shift) = match self.built_for {
            Some((_, _, shift)) => (self.nodes.len() as u32, shift),
            None => (NO_TILE_ENTRIES, 0),
        };
    }
}
