//! The part of the launch parameters that the scene decides.

use crate::bvh::Bvh;
use crate::lights::Lights;
use trisect_scene::Scene;
use trisect_shared::bvh::Child;
use trisect_shared::sky::Sky;

/// Launch parameters that the scene decides; `padded` also depends on the camera's position.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneParams {
    pub sky: Sky,
    pub root: Child,
    pub first_flat: u32,
    pub first_triangle: u32,
    pub world_primitives: u32,
    pub primitives: u32,
    pub instances: u32,
    pub first_instance: u32,
    pub first_instance_node: u32,
    pub lights: u32,
    pub area_lights: u32,
    pub first_glass: u32,
    /// Number of pieces of smooth glass before lights without extent.
    pub glass: u32,
    /// Number of portals.
    pub portals: u32,
    /// True if the lights have a tree.
    pub light_tree: bool,
    /// True if the BVH's boxes are padded enough for rays that start at the camera.
    pub padded: bool,
    /// Index of the first medium among the materials.
    pub first_medium: u32,
    pub environment_probability: f32,
    pub environment_size: (u32, u32),
    pub environment_rotation: f64,
}

impl SceneParams {
    pub fn new(scene: &Scene, bvh: &Bvh, lights: &Lights, padded: bool) -> Self {
        let environment = scene.environment.as_ref();
        Self {
            sky: Sky { strength: lights.sky_strength, ..scene.sky },
            root: bvh.root,
            first_flat: scene.spheres.len() as u32,
            first_triangle: (scene.spheres.len() + scene.flats.len()) as u32,
            world_primitives: scene.world_primitives() as u32,
            primitives: scene.primitives() as u32,
            instances: scene.shared.instances.len() as u32,
            first_instance: bvh.first_leaf_of_instances(),
            first_instance_node: bvh.first_instance_node as u32,
            lights: lights.count,
            area_lights: lights.area_count,
            first_glass: lights.first_glass,
            glass: lights.glass_count,
            portals: scene.portals.len() as u32,
            light_tree: lights.has_tree(),
            padded,
            first_medium: lights.first_medium,
            environment_probability: lights.environment_probability,
            environment_size: environment.map_or((0, 0), |e| (e.width, e.height)),
            environment_rotation: environment.map_or(0.0, |e| e.rotation),
        }
    }
}
