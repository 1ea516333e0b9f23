//! The part of a scene that launches need once its arrays are on a device, and its camera.

use super::Settings;
use super::boundaries::Boundaries;
use super::scene_params::SceneParams;
use super::scene_tree::SceneTree;
use crate::bvh::{BvhQuality, TreeOnHost};
use crate::camera;
use crate::lights::Lights;
use crate::passes::Launch;
use glam::Vec3;
use std::sync::Arc;
use trisect_scene::{CameraPose, Scene, SceneError, SharedVec};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::camera::Camera;
use trisect_shared::features::{Features, LIGHT_TREE, PADDED_BOXES, REFRACTED_LIGHT};
use trisect_shared::medium::MediumStack;
use trisect_shared::params::{FLAG_HIDDEN_SKY, NO_CLAMP, RenderParams};
use trisect_shared::tile_entry::NO_TILE_ENTRIES;
use trisect_shared::triangle::Triangle;

/// Camera of a scene, and what launches and tile entries need to know of the scene.
#[derive(Clone)]
pub(super) struct LaunchScene {
    camera: CameraPose,
    /// Features that a kernel for the scene needs.
    features: Features,
    /// Launch parameters that the scene decides.
    params: SceneParams,
    /// Boundaries of media, and the media around the camera.
    boundaries: Arc<Boundaries>,
    media: MediumStack,
    /// Maximum distance of a ray's origin from the world's origin, along each axis, for which the
    /// boxes are padded.
    ray_origin_extent: Vec3,
    /// Quality of the BVH, as it was asked for.
    pub quality: Option<BvhQuality>,
    /// CRC-32 of BVH and light table.
    structures_crc: u32,
    /// Triangles in the world, and vertices, which name mesh instances.
    triangles: SharedVec<Triangle>,
    vertices: SharedVec<MeshVertex>,
    /// Mesh instance of each instance of a shared mesh.
    placed: Arc<[u32]>,
    /// Nodes of the BVH, from which tile entries are pruned.
    pub nodes: SharedVec<BvhNode>,
}

/// Returns the CRC-32 of BVH and light table.
fn structures_crc(tree: &SceneTree, lights: &Lights) -> u32 {
    let mut crc = crc32fast::Hasher::new_with_initial(tree.crc);
    let parts: [&[u8]; 3] = [
        bytemuck::cast_slice(&lights.lights),
        bytemuck::bytes_of(&lights.environment_probability),
        bytemuck::bytes_of(&lights.sky_strength),
    ];
    parts.into_iter().for_each(|part| crc.update(part));
    crc.finalize()
}

impl LaunchScene {
    /// Collects what launches need.
    pub fn new(scene: &Scene, tree: &SceneTree, lights: &Lights) -> Self {
        let (bvh, padded_for) = (&tree.bvh, tree.padded_for());
        let boundaries = Boundaries::of(scene);
        Self {
            camera: scene.camera,
            media: boundaries.around(scene.camera.look_from),
            boundaries: Arc::new(boundaries),
            features: scene.features(),
            params: SceneParams::new(scene, bvh, lights, padded_for.is_some()),
            ray_origin_extent: padded_for.unwrap_or(Vec3::ZERO),
            quality: tree.quality,
            structures_crc: structures_crc(tree, lights),
            triangles: scene.triangles.clone(),
            vertices: scene.vertices.clone(),
            placed: scene.shared.instances.iter().map(|instance| instance.object).collect(),
            nodes: bvh.nodes.clone(),
        }
    }

    /// Returns the pose of the camera.
    pub fn pose(&self) -> &CameraPose {
        &self.camera
    }

    /// Moves the camera. Returns whether it was elsewhere.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for a pose that is not valid; the camera stays where it was.
    pub fn set_camera(&mut self, pose: CameraPose) -> Result<bool, SceneError> {
        pose.check().map_err(|message| SceneError::Inconsistent { file: "camera".to_owned(), message })?;
        if pose == self.camera {
            return Ok(false);
        }
        let record = camera::record(&pose, 1, 1);
        let start = record.origin.abs() + record.lens_x.length();
        // Rays from beyond use the test for boxes without padding. Padded boxes are wider than that
        // needs, so no hit is lost.
        self.params.padded = record.is_parallel == 0 && start.cmple(self.ray_origin_extent).all();
        self.camera = pose;
        self.media = self.boundaries.around(pose.look_from);
        Ok(true)
    }

    /// Returns the camera record of the launch parameters.
    pub fn camera(&self, settings: &Settings) -> Camera {
        settings.camera_record(&self.camera)
    }

    /// Returns the CRC-32 of BVH, light table and camera record, for an image of this size. Films
    /// that differ in it do not belong together, even with equal scene and settings: another
    /// version of a library may have built another BVH.
    pub fn crc(&self, width: u32, height: u32) -> u32 {
        let mut crc = crc32fast::Hasher::new_with_initial(self.structures_crc);
        crc.update(bytemuck::bytes_of(&camera::record(&self.camera, width, height)));
        crc.finalize()
    }

    /// Returns the number of the object that a primitive is part of, from 1 on: spheres, then quads
    /// and discs, in the scene's order, then mesh instances. Returns 0 for `None`.
    pub fn object(&self, primitive: Option<u32>) -> u32 {
        let first = self.params.first_triangle;
        match primitive {
            None => 0,
            Some(shape) if shape < first => shape + 1,
            Some(number) => {
                let instance = match number.checked_sub(self.params.first_instance) {
                    Some(placed) => self.placed.get(placed as usize).copied(),
                    None => self.triangles.get((number - first) as usize).and_then(|triangle| {
                        self.vertices.get(triangle.vertex_a as usize).map(|vertex| vertex.instance)
                    }),
                };
                instance.map_or(0, |instance| first + instance + 1)
            }
        }
    }

    /// Returns the launch of an image without rows and samples.
    pub fn launch(&self, settings: &Settings) -> Launch {
        Launch { params: self.launch_params(settings), padded: self.params.padded }
    }

    /// Forgets features of the scene, for a test that its kernel then renders another image.
    #[cfg(test)]
    pub fn forget_features(&mut self, features: Features) {
        self.features &= !features;
    }

    /// Returns the number of primitives.
    pub fn primitives(&self) -> usize {
        self.params.primitives as usize
    }

    /// Returns the root of the BVH.
    pub fn root(&self) -> Child {
        self.params.root
    }

    /// Returns the binary BVH, with the trees of instances.
    pub fn tree(&self) -> TreeOnHost<'_> {
        let SceneParams { root, first_instance, first_instance_node, .. } = self.params;
        TreeOnHost { nodes: &self.nodes, root, first_instance, first_instance_node }
    }

    /// Returns the middle of the scene's box, or `None` for fewer than two primitives.
    pub fn middle(&self) -> Option<Vec3> {
        let root = Some(self.root()).filter(|root| !root.is_leaf())?;
        let [(low, high), (low2, high2)] = self.nodes.get(root.index() as usize)?.boxes();
        Some(low.min(low2).midpoint(high.max(high2)))
    }

    /// Returns the features that a kernel needs to render the scene.
    pub fn features(&self) -> Features {
        let padded = if self.params.padded { PADDED_BOXES } else { 0 };
        let tree = if self.params.light_tree { LIGHT_TREE } else { 0 };
        let refracted = if self.params.glass > 0 { REFRACTED_LIGHT } else { 0 };
        self.features | padded | tree | refracted
    }

    fn launch_params(&self, settings: &Settings) -> RenderParams {
        let SceneParams { sky, root, first_flat, first_triangle, .. } = self.params;
        let (sine, cosine) = self.params.environment_rotation.sin_cos();
        let sampled = settings.light_sampling;
        RenderParams {
            camera: Camera {
                media: self.media.0,
                first_medium: self.params.first_medium,
                ..self.camera(settings)
            },
            sky,
            width: settings.width,
            height: settings.height,
            first_row: 0,
            rows: 0,
            first_sample: 0,
            end_sample: 0,
            resume: 0,
            seed: settings.seed,
            max_depth: settings.depth,
            root: root.0,
            first_planar: first_flat,
            first_triangle,
            light_count: if sampled { self.params.lights } else { 0 },
            roulette_from: if settings.roulette { settings.roulette_depth } else { u32::MAX },
            flags: if settings.hidden_sky { FLAG_HIDDEN_SKY } else { 0 },
            environment_probability: if sampled { self.params.environment_probability } else { 0.0 },
            environment_width: self.params.environment_size.0,
            environment_height: self.params.environment_size.1,
            environment_cos: cosine as f32,
            environment_sin: sine as f32,
            primitive_count: self.params.world_primitives,
            max_lane_pixels: u32::MAX,
            first_tile_entry: NO_TILE_ENTRIES,
            tile_shift: 0,
            share_first_row: 0,
            block_shift: 31,
            block_gap: 0,
            max_radiance: settings.clamp.unwrap_or(NO_CLAMP),
            first_instance: self.params.first_instance,
            instance_count: self.params.instances,
            first_instance_node: self.params.first_instance_node,
            area_light_count: self.params.area_lights,
            first_glass: self.params.first_glass,
            glass_count: if sampled { self.params.glass } else { 0 },
            first_portal: first_triangle - first_flat,
            portal_count: if sampled { self.params.portals } else { 0 },
        }
    }
}
