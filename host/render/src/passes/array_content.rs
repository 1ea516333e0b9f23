//! Content of a scene's arrays on a device, from which follows which of them another scene keeps.

use super::record_digest::{Digest, digest, equal};
use crate::bvh::Bvh;
use crate::lights::Lights;
use bytemuck::Pod;
use std::sync::Arc;
use trisect_scene::{Scene, SharedVec};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::planar::Planar;
use trisect_shared::texture::Texel;
use trisect_shared::triangle::Triangle;

/// Content of the arrays of a scene on a device: large arrays that the host has in any case, and
/// digests of the others. What is shared stays in memory, so that the same address is the same
/// content.
#[derive(Clone)]
pub(super) struct ArrayContent {
    /// Nodes, and the wide BVH, which follows from them and the shapes that they are of.
    bvh: Arc<Bvh>,
    triangles: SharedVec<Triangle>,
    shared_triangles: Digest,
    vertices: SharedVec<MeshVertex>,
    pub texels: Arc<[Texel]>,
    pub environment: Arc<[EnvironmentTexel]>,
    spheres: Digest,
    planars: Digest,
    materials: Digest,
    lights: Digest,
    textures: Digest,
}

/// Arrays of a device whose content is that of another scene's.
#[derive(Clone, Copy, Default)]
pub(super) struct SameArrays {
    pub bvh: bool,
    pub triangles: bool,
    pub vertices: bool,
    pub texels: bool,
    pub environment: bool,
    pub spheres: bool,
    pub planars: bool,
    pub materials: bool,
    pub lights: bool,
    pub textures: bool,
}

impl ArrayContent {
    /// Returns the content of a scene's arrays. `planars` are the records of quads, discs and
    /// portals.
    pub fn of(scene: &Scene, bvh: &Arc<Bvh>, lights: &Lights, planars: &[Planar]) -> Self {
        let no_texels = || Arc::from([]);
        Self {
            bvh: Arc::clone(bvh),
            triangles: scene.triangles.clone(),
            shared_triangles: digest(&scene.shared.triangles),
            vertices: scene.vertices.clone(),
            texels: Arc::clone(&scene.texels),
            environment: scene.environment.as_ref().map_or_else(no_texels, |of| Arc::clone(&of.texels)),
            spheres: digest(&scene.spheres),
            planars: digest(planars),
            materials: digest(&lights.materials),
            lights: digest(&lights.lights),
            textures: digest(&scene.textures),
        }
    }

    /// Returns whether the nodes are those of this BVH.
    pub fn is_of(&self, bvh: &Arc<Bvh>) -> bool {
        Arc::ptr_eq(&self.bvh, bvh)
    }

    /// Returns which arrays have the same content.
    pub fn compared(&self, other: &Self) -> SameArrays {
        SameArrays {
            bvh: self.is_of(&other.bvh),
            triangles: same(&self.triangles, &other.triangles)
                && self.shared_triangles == other.shared_triangles,
            vertices: same(&self.vertices, &other.vertices),
            texels: Arc::ptr_eq(&self.texels, &other.texels) || equal(&self.texels, &other.texels),
            environment: Arc::ptr_eq(&self.environment, &other.environment)
                || equal(&self.environment, &other.environment),
            spheres: self.spheres == other.spheres,
            planars: self.planars == other.planars,
            materials: self.materials == other.materials,
            lights: self.lights == other.lights,
            textures: self.textures == other.textures,
        }
    }
}

fn same<T: Pod + Sync>(a: &SharedVec<T>, b: &SharedVec<T>) -> bool {
    a.is_shared_with(b) || equal(a, b)
}
