//! A scene as the host prepares it for rendering: validated, with its trees, its light table and
//! the fingerprint of its images. No device takes part.

use super::fingerprint::Fingerprint;
use super::launch_scene::LaunchScene;
use super::{Settings, Traversal};
use crate::Error;
use crate::bvh::{Bvh, BvhQuality, Wide};
use crate::camera;
use crate::lights::Lights;
use crate::passes::{SceneArrays, ValidScene};
use crate::stats::Phases;
use glam::Vec3;
use std::time::Instant;
use trisect_device::Device;
use trisect_scene::Scene;

/// Scene that was validated, with trees and light table, ready for any number of devices.
pub struct PreparedScene<'a> {
    scene: ValidScene<'a>,
    quality: Option<BvhQuality>,
    bvh: Bvh,
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
        let mut bvh = Bvh::build(scene, quality)?;
        let camera = camera::record(&scene.camera, 1, 1);
        let padded_for = bvh.pad_boxes(camera.origin, camera.lens_x.length());
        let lights = Lights::new(scene, bvh.world_triangles());
        let seconds = start.elapsed().as_secs_f64();
        Ok(Self { scene: valid, quality, bvh, wide: None, lights, padded_for, seconds })
    }

    /// Returns the fingerprint of the image with these settings.
    pub fn fingerprint(&self, settings: &Settings) -> Fingerprint {
        Fingerprint::new(&self.scene.get().digest(), settings, self.quality)
    }

    /// Copies the scene, its trees and its light table to a device. A wide BVH is built for a
    /// device that traces it.
    pub(super) fn upload(&mut self, device: &mut dyn Device) -> Result<(SceneArrays, Phases), Error> {
        let scene = self.scene.get();
        let start = Instant::now();
        let traversal = device.best_method(scene.features(), scene.primitives()).0;
        if traversal == Traversal::Wide && self.wide.is_none() {
            self.wide = Wide::new(scene, &self.bvh)?;
        }
        let wide = self.wide.as_ref().filter(|_| traversal == Traversal::Wide);
        let bvh_seconds = self.seconds + start.elapsed().as_secs_f64();
        let start = Instant::now();
        let arrays = self.scene.upload(device, &self.bvh, wide, &self.lights)?;
        let upload_seconds = start.elapsed().as_secs_f64();
        Ok((arrays, Phases { bvh_seconds, upload_seconds, ..Phases::default() }))
    }

    /// Returns what launches need to know of the scene once its arrays are on a device.
    pub(super) fn launch_scene(&self) -> LaunchScene {
        LaunchScene::new(self.scene.get(), &self.bvh, &self.lights, self.padded_for, self.quality)
    }
}
