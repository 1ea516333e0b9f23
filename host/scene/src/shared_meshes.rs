//! Meshes of a scene that are stored once and placed by instances.

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3};
use trisect_shared::triangle::Triangle;

/// Choice between a copy of a mesh for each of its instances, and instances that share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sharing {
    /// Shares a mesh where its copies would take much memory.
    #[default]
    Auto,
    /// Copies all meshes: fastest to trace.
    Never,
    /// Shares each mesh that can be shared, even with one instance.
    Always,
}

/// Meshes that are stored once, and their instances.
#[derive(Clone, Debug, Default)]
pub struct SharedMeshes {
    /// Triangles of all meshes, mesh by mesh, in their meshes' coordinates.
    pub triangles: Vec<Triangle>,
    /// Meshes; their triangles follow each other.
    pub meshes: Vec<SharedMesh>,
    /// Instances, in the scene's order.
    pub instances: Vec<SharedInstance>,
}

/// Mesh that instances share.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SharedMesh {
    /// Minimum corner of the bounding box, in the mesh's coordinates.
    pub low: [f64; 3],
    /// Maximum corner of the bounding box.
    pub high: [f64; 3],
    /// Number of triangles, at least 1.
    pub triangles: u64,
}

/// Place of a shared mesh in the world.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SharedInstance {
    /// Columns of the affine map from the mesh's coordinates to the world.
    pub to_world: [f64; 12],
    /// Index into [`SharedMeshes::meshes`].
    pub mesh: u32,
    /// Number of the mesh instance among all of the scene, from 0.
    pub object: u32,
}

impl SharedInstance {
    /// Returns the map from the mesh's coordinates to the world.
    pub fn map(&self) -> DAffine3 {
        DAffine3::from_cols_array(&self.to_world)
    }
}

impl SharedMesh {
    /// Returns the corners of the bounding box.
    pub fn corners(&self) -> [DVec3; 8] {
        let ends = [DVec3::from(self.low), DVec3::from(self.high)];
        std::array::from_fn(|i| DVec3::new(ends[i & 1].x, ends[i >> 1 & 1].y, ends[i >> 2].z))
    }
}

impl SharedMeshes {
    /// Returns the corners of the bounding box of an instance's mesh, in the world.
    pub fn corners(&self, instance: &SharedInstance) -> impl Iterator<Item = DVec3> + use<> {
        let map = instance.map();
        let corners = self.meshes.get(instance.mesh as usize).map(SharedMesh::corners);
        corners.into_iter().flatten().map(move |corner| map.transform_point3(corner))
    }

    /// Returns the first triangle of each mesh and, at the end, the number of triangles.
    pub fn starts(&self) -> Vec<usize> {
        let counts = self.meshes.iter().scan(0, |end, mesh| {
            *end += mesh.triangles as usize;
            Some(*end)
        });
        std::iter::once(0).chain(counts).collect()
    }

    /// Returns what is wrong with the numbers of meshes and triangles, if something is.
    pub(crate) fn broken(&self) -> Option<String> {
        let counted = self.meshes.iter().try_fold(0u64, |sum, mesh| sum.checked_add(mesh.triangles));
        if counted != Some(self.triangles.len() as u64) {
            return Some(format!(
                "shared meshes have {} triangles, not as many as they say",
                self.triangles.len()
            ));
        }
        if let Some(empty) = self.meshes.iter().position(|mesh| mesh.triangles == 0) {
            return Some(format!("shared mesh {empty} has no triangle"));
        }
        let count = self.meshes.len();
        let wrong = self.instances.iter().find(|instance| instance.mesh as usize >= count);
        wrong.map(|instance| format!("an instance has shared mesh {}, but there are {count}", instance.mesh))
    }
}
