//! Cache of the tile entries (the BVH nodes at which the camera rays of each tile start) for the
//! current camera, kept on the device from frame to frame.

use super::launch_scene::LaunchScene;
use super::{Settings, Traversal};
use crate::Error;
use crate::bvh::build_tile_entries;
use crate::passes::DeviceScene;
use trisect_device::BackendError;
use trisect_kernels::EntryPoint;
use trisect_shared::features::{HEAVY, has_any};
use trisect_shared::params::RenderParams;
use trisect_shared::tile_entry::NO_TILE_ENTRIES;

/// Minimum samples per pixel for which smaller tiles gain more than they cost
/// (docs/notebook/camera-ray-tiles.md).
const FINE_FROM: u32 = 64;

/// Tiles of an image.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Tiles {
    width: u32,
    height: u32,
    /// Base-2 logarithm of the edge of a tile, in pixels.
    shift: u32,
}

/// Tile entries that the device has for the current camera.
#[derive(Default)]
pub(super) enum TileEntryCache {
    #[default]
    Empty,
    Built(Tiles),
    /// The device has no memory for them; with its error.
    Refused(Tiles, String),
}

impl TileEntryCache {
    /// Gives the device tile entries for the image of these settings, if the kernel can use them.
    /// Without [`Settings::tile`], only kernels without [`HEAVY`] features get them, and only while
    /// the camera rests. If there is no memory for them, the image is rendered without them and is
    /// the same; [`TileEntryCache::refused`] then returns the reason.
    pub fn update(
        &mut self,
        uploaded: &mut DeviceScene,
        scene: &LaunchScene,
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
        if tile == 0 || Traversal::of(kernel.features) != Traversal::Stack || scene.nodes.is_empty() {
            *self = Self::Empty;
            return Ok(());
        }
        let Settings { width, height, .. } = *settings;
        let wanted = Tiles { width, height, shift: tile.ilog2() };
        if matches!(self, Self::Built(tiles) | Self::Refused(tiles, _) if *tiles == wanted) {
            return Ok(());
        }
        *self = Self::Empty;
        let camera = scene.camera(settings);
        let entries = build_tile_entries(&scene.nodes, scene.root(), &camera, width, height, wanted.shift);
        if let Some(nodes) = entries {
            *self = match uploaded.write_tile_entries(&nodes) {
                Ok(()) => Self::Built(wanted),
                Err(error @ BackendError::TooLarge { .. }) => Self::Refused(wanted, error.to_string()),
                Err(error) => return Err(error.into()),
            };
        }
        Ok(())
    }

    /// Discards the tile entries, because the camera changed.
    pub fn forget(&mut self) {
        *self = Self::Empty;
    }

    /// Returns the edge in pixels of the tiles in use; `None` without tile entries.
    pub fn tile(&self) -> Option<u32> {
        match self {
            Self::Built(tiles) => Some(1 << tiles.shift),
            Self::Empty | Self::Refused(..) => None,
        }
    }

    /// Returns why there are no tile entries although there should be.
    pub fn refused(&self) -> Option<&str> {
        match self {
            Self::Refused(_, error) => Some(error),
            Self::Empty | Self::Built(_) => None,
        }
    }

    /// Writes the index of the first tile entry and the size of the tiles to launch parameters.
    pub fn fill_params(&self, scene: &LaunchScene, params: &mut RenderParams) {
        (params.first_tile_entry, params.tile_shift) = match self {
            Self::Built(tiles) => (scene.nodes.len() as u32, tiles.shift),
            Self::Empty | Self::Refused(..) => (NO_TILE_ENTRIES, 0),
        };
    }
}
