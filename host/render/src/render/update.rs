//! Another scene for a renderer that has one, with what both have in common.

use super::Renderer;
use super::film_state::FilmState;
use super::prepared_scene::{PreparedScene, Uploaded};
use super::scene_tree::TreeReuse;
use super::tile_entry_cache::TileEntryCache;
use crate::Error;
use crate::bvh::BvhQuality;
use crate::passes::WrittenArray;
use crate::stats::Phases;
use trisect_scene::Scene;

/// Trees that a renderer kept when it got another scene, and arrays that it wrote to its device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneReuse {
    /// Origin of the BVH.
    pub tree: TreeReuse,
    /// Arrays that were written; those of a device that reads the host's memory in place are not.
    pub written: Vec<WrittenArray>,
}

impl SceneReuse {
    /// Returns the number of bytes that were written to the device.
    pub fn bytes(&self) -> u64 {
        self.written.iter().map(|array| array.bytes).sum()
    }
}

impl Renderer {
    /// Replaces the scene by one that was edited, from the next frame on, and keeps what is equal
    /// in both: the BVH if all shapes are at their places, and each array of the device that has
    /// the same content. Shapes that moved have their BVH refitted, as
    /// [`PreparedScene::moved`] does. `None` chooses the quality of the BVH by the number of
    /// primitives; with another quality than before, a BVH is built.
    ///
    /// The images are those of a new renderer of the scene, bit for bit. So is
    /// [`prepared_crc`](Self::prepared_crc), unless this BVH, or one that it comes from, was
    /// refitted to shapes that moved.
    ///
    /// After [`Error::Scene`] the renderer has the scene before, and after another error no scene
    /// until this function succeeds.
    ///
    /// # Errors
    ///
    /// The errors of [`PreparedScene::new`] and [`upload`](Self::upload).
    pub fn update_scene(&mut self, scene: &Scene, quality: Option<BvhQuality>) -> Result<SceneReuse, Error> {
        self.replace_scene(&mut PreparedScene::moved(scene, quality, self.tree.clone())?)
    }

    /// Replaces the scene, from the next frame on. Arrays of the device that have the same content
    /// are kept, and memory of the same size is used again. After an error of the device the
    /// renderer has no scene, and renders nothing.
    ///
    /// # Errors
    ///
    /// The errors of [`upload`](Self::upload).
    pub fn set_scene(&mut self, scene: &mut PreparedScene<'_>) -> Result<(), Error> {
        self.replace_scene(scene).map(drop)
    }

    fn replace_scene(&mut self, scene: &mut PreparedScene<'_>) -> Result<SceneReuse, Error> {
        let (mut phases, mut written) = (Phases::default(), Vec::new());
        self.uploaded.set_scene(|device, before| {
            let uploaded: Uploaded = scene.upload_into(device, before)?;
            (phases, written) = (uploaded.phases, uploaded.written);
            Ok::<_, Error>(uploaded.arrays)
        })?;
        (self.scene, self.tree, self.phases) = (scene.launch_scene(), scene.tree(), phases);
        (self.film_state, self.tile_entries) = (FilmState::default(), TileEntryCache::default());
        self.pipeline.adapt_to(self.uploaded.device().info().kind, self.scene.features());
        Ok(SceneReuse { tree: scene.tree_reuse(), written })
    }
}
