//! A scene as the host prepares it for rendering: validated, with its trees, its light table and
//! the fingerprint of its images. No device takes part.

use super::fingerprint::Fingerprint;
use super::launch_scene::LaunchScene;
use super::scene_tree::{SceneTree, TreeReuse};
use super::{Settings, Traversal};
use crate::Error;
use crate::bvh::{BvhQuality, Wide};
use crate::lights::Lights;
use crate::passes::{SceneArrays, ValidScene, WideSource, WrittenArray};
use crate::stats::Phases;
use trisect_device::Device;
use trisect_scene::Scene;
use trisect_system::memory;
use web_time::Instant;

/// Number of primitives beyond which the memory of one BVH is worth returning before the next.
const LARGE: usize = 1 << 19;

/// Scene that was validated, with trees and light table, ready for any number of devices.
pub struct PreparedScene<'a> {
    scene: ValidScene<'a>,
    tree: SceneTree,
    reuse: TreeReuse,
    /// Wide BVH, once a device has asked for it.
    wide: Option<Wide>,
    lights: Lights,
    /// Seconds that the trees and the light table took.
    seconds: f64,
}

/// Scene on a device.
pub(super) struct Uploaded {
    pub arrays: SceneArrays,
    /// Times of the preparation.
    pub phases: Phases,
    /// Arrays that were written.
    pub written: Vec<WrittenArray>,
}

impl<'a> PreparedScene<'a> {
    /// Validates a scene, and builds its BVH and its light table. `None` chooses the quality of the
    /// BVH by the number of primitives.
    ///
    /// # Errors
    ///
    /// [`Error::Scene`] for a scene that is not valid, or whose BVH exceeds the memory.
    pub fn new(scene: &'a Scene, quality: Option<BvhQuality>) -> Result<Self, Error> {
        let start = Instant::now();
        let valid = ValidScene::new(scene)?;
        let tree = SceneTree::build(scene, quality)?;
        Ok(Self::of(valid, (tree, TreeReuse::Built), start))
    }

    /// Prepares a scene as [`new`](Self::new) does, with the BVH `tree` of another one. It is kept
    /// for the same shapes. It is refitted if the scene has as many primitives at other places, and
    /// built anew if that would make it more than
    /// [`MAX_REFITTED_COST`](crate::bvh::MAX_REFITTED_COST) times as costly as when it was built,
    /// or if the quality is another one.
    ///
    /// # Errors
    ///
    /// The errors of [`new`](Self::new).
    pub fn moved(scene: &'a Scene, quality: Option<BvhQuality>, tree: SceneTree) -> Result<Self, Error> {
        let start = Instant::now();
        let valid = ValidScene::new(scene)?;
        let tree = tree.update(scene, quality)?;
        Ok(Self::of(valid, tree, start))
    }

    fn of(scene: ValidScene<'a>, (tree, reuse): (SceneTree, TreeReuse), start: Instant) -> Self {
        let lights = Lights::new(scene.get());
        let seconds = start.elapsed().as_secs_f64();
        Self { scene, tree, reuse, wide: None, lights, seconds }
    }

    /// Returns whether the BVH is that of another scene, refitted or as it was.
    pub fn is_refitted(&self) -> bool {
        self.reuse != TreeReuse::Built
    }

    /// Returns the origin of the BVH.
    pub fn tree_reuse(&self) -> TreeReuse {
        self.reuse
    }

    /// Returns the BVH, for the scene at another time.
    pub fn into_tree(self) -> SceneTree {
        self.tree
    }

    /// Returns the BVH, which shares its memory with this one.
    pub(super) fn tree(&self) -> SceneTree {
        self.tree.clone()
    }

    /// Returns the fingerprint of the image with these settings.
    pub fn fingerprint(&self, settings: &Settings) -> Fingerprint {
        Fingerprint::new(&self.scene.get().digest(), settings, self.tree.quality)
    }

    /// Copies the scene, its trees and its light table to a device. A wide BVH is built for a
    /// device that traces it.
    pub(super) fn upload(&mut self, device: &mut dyn Device) -> Result<Uploaded, Error> {
        self.upload_into(device, &mut None)
    }

    /// Copies the scene to a device as [`upload`](Self::upload) does. Arrays of the scene before
    /// stay as they are if they have the same content, and are written in place if they have the
    /// size. They are taken before anything is written.
    pub(super) fn upload_into(
        &mut self,
        device: &mut dyn Device,
        before: &mut Option<SceneArrays>,
    ) -> Result<Uploaded, Error> {
        let scene = self.scene.get();
        let bvh = &self.tree.bvh;
        let start = Instant::now();
        let traversal = device.best_method(scene.features(), scene.primitives()).0;
        let has_wide = before.as_ref().is_some_and(|before| before.has_wide_of(bvh));
        if traversal == Traversal::Wide && !has_wide && self.wide.is_none() {
            if scene.primitives() > LARGE && self.reuse == TreeReuse::Built {
                // What the construction of the binary BVH freed.
                memory::release();
            }
            self.wide = Wide::new(scene, bvh)?;
        }
        let wide = match (traversal, &self.wide) {
            (Traversal::Wide, _) if has_wide => WideSource::Kept,
            (Traversal::Wide, Some(wide)) => WideSource::New(wide),
            _ => WideSource::Unused,
        };
        let bvh_seconds = self.seconds + start.elapsed().as_secs_f64();
        let start = Instant::now();
        let (arrays, written) = self.scene.upload(device, bvh, &wide, &self.lights, before.take())?;
        let upload_seconds = start.elapsed().as_secs_f64();
        let phases = Phases { bvh_seconds, upload_seconds, ..Phases::default() };
        Ok(Uploaded { arrays, phases, written })
    }

    /// Returns what launches need to know of the scene once its arrays are on a device.
    pub(super) fn launch_scene(&self) -> LaunchScene {
        LaunchScene::new(self.scene.get(), &self.tree, &self.lights)
    }
}
