//! A scene as the host prepares it for rendering: validated, with its trees, its light table and
//! the fingerprint of its images. No device takes part.

use super::fingerprint::Fingerprint;
use super::launch_scene::LaunchScene;
use super::{Settings, Traversal};
use crate::Error;
use crate::bvh::{Bvh, BvhQuality, MAX_REFITTED_COST, Wide};
use crate::camera;
use crate::lights::Lights;
use crate::passes::{SceneArrays, ValidScene};
use crate::stats::Phases;
use glam::Vec3;
use std::time::Instant;
use trisect_device::Device;
use trisect_scene::Scene;
use trisect_system::memory;

/// Number of primitives beyond which the memory of one BVH is worth returning before the next.
const LARGE: usize = 1 << 19;

/// BVH of a scene at one time, from which that of another time is refitted.
pub struct SceneTree {
    bvh: Bvh,
    /// Cost of the BVH when it was built.
    built_cost: f64,
}

/// Scene that was validated, with trees and light table, ready for any number of devices.
pub struct PreparedScene<'a> {
    scene: ValidScene<'a>,
    quality: Option<BvhQuality>,
    bvh: Bvh,
    /// Cost of the BVH when it was built.
    built_cost: f64,
    /// True if the BVH is that of the scene at another time, refitted.
    refitted: bool,
    /// Wide BVH, once a device has asked for it.
    wide: Option<Wide>,
    lights: Lights,
    /// Maximum distance of a ray's origin from the world's origin, along each axis, for which the
    /// boxes are padded; `None` if they are not.
    padded_for: Option<Vec3>,
    /// Seconds that the trees and the light table took.
    seconds: f64,
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
        let bvh = Bvh::build(scene, quality)?;
        let built_cost = bvh.cost();
        Ok(Self::of(valid, quality, SceneTree { bvh, built_cost }, start))
    }

    /// Prepares a scene at another time, as [`new`](Self::new) does. The BVH `tree` is refitted if
    /// the scene has as many primitives, and built anew if that would make it more than
    /// [`MAX_REFITTED_COST`] times as costly as when it was built.
    ///
    /// # Errors
    ///
    /// The errors of [`new`](Self::new).
    pub fn moved(scene: &'a Scene, quality: Option<BvhQuality>, tree: SceneTree) -> Result<Self, Error> {
        let start = Instant::now();
        let valid = ValidScene::new(scene)?;
        let SceneTree { bvh, built_cost } = tree;
        let refitted = bvh.moved(scene)?.filter(|bvh| bvh.cost() <= MAX_REFITTED_COST * built_cost);
        match refitted {
            Some(bvh) => {
                let prepared = Self::of(valid, quality, SceneTree { bvh, built_cost }, start);
                Ok(Self { refitted: true, ..prepared })
            }
            None => Self::new(scene, quality),
        }
    }

    fn of(valid: ValidScene<'a>, quality: Option<BvhQuality>, tree: SceneTree, start: Instant) -> Self {
        let (scene, SceneTree { mut bvh, built_cost }) = (valid.get(), tree);
        let camera = camera::record(&scene.camera, 1, 1);
        // Rays of a parallel projection start beside the camera, as far as the image is wide.
        let padded_for = match camera.is_parallel {
            0 => bvh.pad_boxes(camera.origin, camera.lens_x.length()),
            _ => None,
        };
        let lights = Lights::new(scene);
        let seconds = start.elapsed().as_secs_f64();
        let (wide, refitted) = (None, false);
        Self { scene: valid, quality, bvh, built_cost, refitted, wide, lights, padded_for, seconds }
    }

    /// Returns whether the BVH is that of the scene at another time, refitted.
    pub fn is_refitted(&self) -> bool {
        self.refitted
    }

    /// Returns the BVH, for the scene at another time.
    pub fn into_tree(self) -> SceneTree {
        SceneTree { bvh: self.bvh, built_cost: self.built_cost }
    }

    /// Returns the fingerprint of the image with these settings.
    pub fn fingerprint(&self, settings: &Settings) -> Fingerprint {
        Fingerprint::new(&self.scene.get().digest(), settings, self.quality)
    }

    /// Copies the scene, its trees and its light table to a device. A wide BVH is built for a
    /// device that traces it.
    pub(super) fn upload(&mut self, device: &mut dyn Device) -> Result<(SceneArrays, Phases), Error> {
        self.upload_into(device, None)
    }

    /// Copies the scene to a device as [`upload`](Self::upload) does, into the arrays of the scene
    /// at another time where they have the size.
    pub(super) fn upload_into(
        &mut self,
        device: &mut dyn Device,
        before: Option<SceneArrays>,
    ) -> Result<(SceneArrays, Phases), Error> {
        let scene = self.scene.get();
        let start = Instant::now();
        let traversal = device.best_method(scene.features(), scene.primitives()).0;
        if traversal == Traversal::Wide && self.wide.is_none() {
            if scene.primitives() > LARGE && !self.refitted {
                // What the construction of the binary BVH freed.
                memory::release();
            }
            self.wide = Wide::new(scene, &self.bvh)?;
        }
        let wide = self.wide.as_ref().filter(|_| traversal == Traversal::Wide);
        let bvh_seconds = self.seconds + start.elapsed().as_secs_f64();
        let start = Instant::now();
        let arrays = self.scene.upload(device, &self.bvh, wide, &self.lights, before)?;
        let upload_seconds = start.elapsed().as_secs_f64();
        Ok((arrays, Phases { bvh_seconds, upload_seconds, ..Phases::default() }))
    }

    /// Returns what launches need to know of the scene once its arrays are on a device.
    pub(super) fn launch_scene(&self) -> LaunchScene {
        LaunchScene::new(self.scene.get(), &self.bvh, &self.lights, self.padded_for, self.quality)
    }
}
