//! Construction of a renderer: builds the BVH and the light table, uploads the scene, and computes
//! the checksum by which a checkpoint recognises what was built.

use super::scene_params::SceneParams;
use super::submissions::SubmissionSizer;
use super::tile_entry_cache::TileEntryCache;
use super::{MathMode, Renderer, Traversal, camera};
use crate::Error;
use crate::bvh::{Bvh, BvhQuality, Wide};
use crate::film::HostRecords;
use crate::lights::Lights;
use crate::passes::{DeviceScene, ValidScene};
use crate::stats::Phases;
use glam::Vec3;
use std::time::Instant;
use trisect_device::Device;
use trisect_scene::Scene;

/// Returns the CRC-32 of BVH and light table.
fn structures_crc(bvh: &Bvh, lights: &Lights) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    let parts: [&[u8]; 6] = [
        bytemuck::bytes_of(&bvh.root.0),
        bytemuck::cast_slice(&bvh.nodes),
        bytemuck::cast_slice(&bvh.triangles),
        bytemuck::cast_slice(&bvh.shading),
        bytemuck::cast_slice(&lights.lights),
        bytemuck::bytes_of(&lights.environment_probability),
    ];
    parts.into_iter().for_each(|part| crc.update(part));
    crc.finalize()
}

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
    pub fn with_quality(
        device: impl Into<Box<dyn Device>>,
        scene: &Scene,
        quality: Option<BvhQuality>,
    ) -> Result<Self, Error> {
        let start = Instant::now();
        let mut device = device.into();
        let valid = ValidScene::new(scene)?;
        let mut bvh = Bvh::build(scene, quality)?;
        let wide = match device.best_method(scene.features(), MathMode::Precise).0 {
            Traversal::Wide => Wide::new(scene, &bvh)?,
            _ => None,
        };
        let camera = camera::record(&scene.camera, 1, 1);
        let reach = bvh.pad_boxes(camera.origin, camera.lens_x.length());
        let lights = Lights::new(scene, &bvh.triangles);
        let made = structures_crc(&bvh, &lights);
        let bvh_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let arrays = valid.upload(device.as_mut(), &bvh, wide.as_ref(), &lights)?;
        let uploaded = DeviceScene::new(device, arrays);
        let phases =
            Phases { bvh_seconds, upload_seconds: start.elapsed().as_secs_f64(), ..Phases::default() };
        let pace = SubmissionSizer::new(uploaded.device().info().kind);
        Ok(Self {
            uploaded,
            camera: scene.camera,
            features: scene.features(),
            wide: wide.is_some(),
            scene: SceneParams::new(scene, &bvh, &lights, reach.is_some()),
            ray_origin_extent: reach.unwrap_or(Vec3::ZERO),
            structures_crc: made,
            submission_sizer: pace,
            chunk: HostRecords::default(),
            spare: HostRecords::default(),
            aovs: HostRecords::default(),
            spare_aovs: HostRecords::default(),
            film: None,
            filtered: Vec::new(),
            phases,
            instances: bvh.triangles.iter().map(|triangle| triangle.instance).collect(),
            tile_entries: TileEntryCache::new(bvh),
            live: None,
            ready: None,
            previous_frame: None,
        })
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
        Ok(Some(Self {
            submission_sizer: SubmissionSizer::new(uploaded.device().info().kind),
            uploaded,
            chunk: HostRecords::default(),
            spare: HostRecords::default(),
            aovs: HostRecords::default(),
            spare_aovs: HostRecords::default(),
            film: None,
            filtered: Vec::new(),
            phases: self.phases.clone(),
            instances: self.instances.clone(),
            tile_entries: self.tile_entries.for_other_stream(),
            live: None,
            ready: None,
            previous_frame: None,
            ..*self
        }))
    }

    /// Returns the CRC-32 of BVH, light table and camera record, for an image of this size. Films
    /// that differ in it do not belong together, even with equal scene and settings: another
    /// version of a library may have built another BVH.
    pub fn prepared_crc(&self, width: u32, height: u32) -> u32 {
        let mut crc = crc32fast::Hasher::new_with_initial(self.structures_crc);
        crc.update(bytemuck::bytes_of(&camera::record(&self.camera, width, height)));
        crc.finalize()
    }
}
