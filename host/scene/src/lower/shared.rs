//! Stores meshes that instances share, and their instances.

use super::super::description::Mesh;
use super::super::limits::{MAX_VERTEX, is_in_reach};
use super::super::shared_meshes::{SharedInstance, SharedMesh};
use super::geometry::Geometry;
use super::tangents::CornerTangents;
use glam::{DAffine3, Vec3};

impl Geometry {
    /// Stores a mesh that instances share, in its own coordinates. Returns its index, or `None` if
    /// it has no triangle with an area.
    pub fn share(&mut self, mesh: &Mesh, tangents: Option<&CornerTangents>) -> Result<Option<u32>, String> {
        // Baked by the identity, with vertices among those of the scene.
        let mut own = Self { vertices: std::mem::take(&mut self.vertices), ..Self::default() };
        own.mesh(mesh, tangents, &DAffine3::IDENTITY, 0)?;
        self.vertices = own.vertices;
        self.warnings.append(&mut own.warnings);
        if own.triangles.is_empty() {
            return Ok(None);
        }
        let corners = own.triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
        let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), corner| {
            (low.min(corner), high.max(corner))
        });
        self.shared.meshes.push(SharedMesh {
            low: low.as_dvec3().to_array(),
            high: high.as_dvec3().to_array(),
            triangles: own.triangles.len() as u64,
        });
        self.shared.triangles.append(&mut own.triangles);
        Ok(Some(self.shared.meshes.len() as u32 - 1))
    }

    /// Places a shared mesh in the world.
    pub fn place(&mut self, mesh: u32, transform: &DAffine3, number: u32) -> Result<(), String> {
        let instance = SharedInstance { to_world: transform.to_cols_array(), mesh, object: number };
        if let Some(corner) = self.shared.corners(&instance).find(|corner| !is_in_reach(*corner)) {
            return Err(format!(
                "mesh instance {number}: its bounding box reaches {corner} in the world; coordinates must be at most {MAX_VERTEX:e}"
            ));
        }
        self.shared.instances.push(instance);
        Ok(())
    }
}
