//! Construction of a renderer, and of renderers beside it.

use super::chunk_buffers::ChunkPipeline;
use super::film_state::FilmState;
use super::fingerprint::Fingerprint;
use super::launch_scene::LaunchScene;
use super::prepared_scene::{PreparedScene, Uploaded};
use super::scene_tree::SceneTree;
use super::tile_entry_cache::TileEntryCache;
use super::{Renderer, Settings, Summation};
use crate::Error;
use crate::bvh::BvhQuality;
use crate::passes::DeviceScene;
use crate::stats::Phases;
use trisect_device::Device;
use trisect_scene::Scene;

impl Renderer {
    /// Creates a renderer: prepares the scene and uploads it.
    ///
    /// # Errors
    ///
    /// The errors of [`PreparedScene::new`] and [`upload`](Self::upload).
    pub fn new(device: impl Into<Box<dyn Device>>, scene: &Scene) -> Result<Self, Error> {
        Self::upload(device, &mut PreparedScene::new(scene, None)?)
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
        Self::upload(device, &mut PreparedScene::new(scene, quality)?)
    }

    /// Creates a renderer of a scene that was prepared, which further devices may render, too.
    ///
    /// # Errors
    ///
    /// [`Error::Backend`] if the scene does not fit the device, or the device fails;
    /// [`Error::Scene`] if there is no memory for a wide BVH.
    pub fn upload(device: impl Into<Box<dyn Device>>, scene: &mut PreparedScene<'_>) -> Result<Self, Error> {
        let mut device = device.into();
        let Uploaded { arrays, phases, .. } = scene.upload(device.as_mut())?;
        Ok(Self::of((scene.launch_scene(), scene.tree()), DeviceScene::new(device, arrays), phases))
    }

    fn of((scene, tree): (LaunchScene, SceneTree), uploaded: DeviceScene, phases: Phases) -> Self {
        Self {
            pipeline: ChunkPipeline::new(uploaded.device().info().kind, scene.features()),
            scene,
            tree,
            uploaded,
            phases,
            tile_entries: TileEntryCache::default(),
            film_state: FilmState::default(),
            film: None,
            summed: (Summation::Host, None),
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
        let scene = (self.scene.clone(), self.tree.clone());
        Ok(Some(Self::of(scene, uploaded, self.phases.clone())))
    }

    /// Returns the fingerprint of the image with these settings, for the scene's
    /// [digest](Scene::digest).
    pub fn fingerprint(&self, scene: &[u8; 32], settings: &Settings) -> Fingerprint {
        Fingerprint::new(scene, settings, self.scene.quality)
    }

    /// Returns the CRC-32 of BVH, light table and camera record, for an image of this size. Films
    /// that differ in it do not belong together, even with equal scene and settings: another
    /// version of a library may have built another BVH.
    pub fn prepared_crc(&self, width: u32, height: u32) -> u32 {
        self.scene.crc(width, height)
    }
}
