//! The tree as the camera sees it, kept from frame to frame.

use super::{Settings, Traversal};
use crate::Error;
use crate::backend::{Backend, BackendError};
use crate::bvh::{Bvh, prune};
use trisect_kernels::Variant;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::camera::Camera;
use trisect_shared::features::{LARGE, has_any};
use trisect_shared::params::RenderParams;
use trisect_shared::view::NO_VIEW;

/// Samples a pixel from which on smaller tiles gain more than they cost, by docs/performance.md.
const FINE_FROM: u32 = 64;

/// What a tree is pruned from, and for which image the backend has it pruned.
pub(super) struct Sight {
    nodes: Vec<BvhNode>,
    root: Child,
    /// Width, height, and the edge of a tile as a power of two.
    made: Option<(u32, u32, u32)>,
    /// Why the backend did not take what was pruned last.
    refused: Option<String>,
}

impl Sight {
    pub fn new(bvh: Bvh) -> Self {
        Self { nodes: bvh.nodes, root: bvh.root, made: None, refused: None }
    }

    /// The same for another backend, which has no view yet.
    pub fn anew(&self) -> Self {
        Self { nodes: self.nodes.clone(), made: None, refused: None, ..*self }
    }

    /// Gives the backend the view of the image that the settings describe, if the kernel can make use of one: by default only one whose
    /// paths are short, so that its camera rays are a good part of all, and while the camera rests. Without memory for it, the image is made without it, and is the
    /// same: [`Sight::refused`] says so.
    pub fn look(
        &mut self,
        backend: &mut dyn Backend,
        camera: &Camera,
        settings: &Settings,
        variant: Variant,
        moves: bool,
    ) -> Result<(), Error> {
        let default = match has_any(variant.features, LARGE) || moves {
            true => 0,
            false if settings.samples < FINE_FROM => 16,
            false => 8,
        };
        let tile = settings.tile.unwrap_or(default);
        if tile == 0 || Traversal::of(variant.features) != Traversal::Stack || self.nodes.is_empty() {
            (self.made, self.refused) = (None, None);
            return Ok(());
        }
        let wanted = (settings.width, settings.height, tile.ilog2());
        if self.made != Some(wanted) {
            (self.made, self.refused) = (None, None);
            if let Some(nodes) = prune(&self.nodes, self.root, camera, wanted.0, wanted.1, wanted.2) {
                match backend.view(&nodes) {
                    Ok(()) => self.made = Some(wanted),
                    Err(error @ BackendError::TooLarge { .. }) => self.refused = Some(error.to_string()),
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Ok(())
    }

    /// Forgets what an earlier camera saw.
    pub fn forget(&mut self) {
        self.made = None;
    }

    /// Pixels along the edge of the tiles that the image is made by; `None` without.
    pub fn tile(&self) -> Option<u32> {
        self.made.map(|(.., shift)| 1 << shift)
    }

    /// Why there are no tiles where there should be some.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Says in a launch record where the view is.
    pub fn describe(&self, params: &mut RenderParams) {
        (params.first_view, params.tile_shift) = match self.made {
            Some((_, _, shift)) => (self.nodes.len() as u32, shift),
            None => (NO_VIEW, 0),
        };
    }
}
