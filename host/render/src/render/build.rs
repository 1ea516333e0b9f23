//! Construction of a renderer, and of renderers beside it.

use super::Renderer;
use super::chunk_buffers::ChunkPipeline;
use super::film_state::FilmState;
use super::prepared_scene::PreparedScene;
use super::tile_entry_cache::TileEntryCache;
use crate::Error;
use crate::bvh::BvhQuality;
use crate::passes::DeviceScene;
use trisect_device::Device;
use trisect_scene::Scene;

impl Renderer {
    /// Creates a renderer: builds the BVH and the light table, and uploads the scene.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`] for a scene that is not valid; [`Error::Backend`] if it does not fit the
    /// device, or the device fails.
    pub fn new(device: impl Into<Box<dyn Device>>, scene: &Scene) -> Result<Self, Error> {
        Self::with_quality(device, scene, None)
    }

    /// Creates a renderer with a BVH of this quality; `None` chooses the quality by the number of
    /// primitives.
    ///
    /// # Errors
    ///
    /// The errors of [`new`](Self::new).
    pub fn with_quality(
        device: impl Into<Box<dyn Device>>,
        scene: &Scene,
        quality: Option<BvhQuality>,
    ) -> Result<Self, Error> {
        let (prepared, uploaded, tile_entries) = PreparedScene::upload(device.into(), scene, quality)?;
        Ok(Self::of(prepared, uploaded, tile_entries))
    }

    fn of(prepared: PreparedScene, uploaded: DeviceScene, tile_entries: TileEntryCache) -> Self {
        Self {
            pipeline: ChunkPipeline::new(uploaded.device().info().kind),
            prepared,
            uploaded,
            tile_entries,
            film_state: FilmState::default(),
            film: None,
            filtered: Vec::new(),
        }
    }

    /// Returns another renderer of the same scene on the same device, for frames that are rendered
    /// at the same time: where one waits for its last lanes or for the host, the other's lanes fill
    /// the device. Returns `None` if that gains nothing.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the device fails.
    pub fn second_stream(&self) -> Result<Option<Self>, Error> {
        let Some(uploaded) = self.uploaded.second_stream()? else { return Ok(None) };
        Ok(Some(Self::of(self.prepared.clone(), uploaded, self.tile_entries.for_other_stream())))
    }

    /// Returns the CRC-32 of BVH, light table and camera record, for an image of this size. Films
    /// that differ in it do not belong together, even with equal scene and settings: another
    /// version of a library may have built another BVH.
    pub fn prepared_crc(&self, width: u32, height: u32) -> u32 {
        self.prepared.crc(width, height)
    }
}
