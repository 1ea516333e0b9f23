//! Vertices of a mesh instance: one record for each vertex that triangles use, and one for all if
//! nothing varies between them.

use super::super::description::Mesh;
use super::tangents::CornerTangents;
use super::texture::texel;
use super::unit;
use glam::{DMat3, Vec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use trisect_shared::attributes::{MeshVertex, VertexAttributes, encode_tangent};
use trisect_shared::texture::Texel;

/// Records that the vertices of a mesh instance have so far.
pub(super) struct Vertices<'a> {
    mesh: &'a Mesh,
    instance: u32,
    matrix: DMat3,
    /// Transforms normals.
    normal_matrix: DMat3,
    mirrored: bool,
    has_attributes: bool,
    /// Record of each vertex, or [`NONE`]; a single entry if nothing varies between vertices.
    records: Vec<u32>,
    /// Record of each vertex and encoded tangent of a mesh with tangents, which may differ between
    /// the triangles at a vertex.
    by_tangent: HashMap<(u32, u32), u32>,
}

/// Stands for a vertex that no triangle has used yet.
const NONE: u32 = u32::MAX;

impl<'a> Vertices<'a> {
    /// Begins the vertices of instance `number` of a mesh, whose linear part is `matrix`.
    pub fn of(mesh: &'a Mesh, tangents: Option<&CornerTangents>, matrix: DMat3, number: u32) -> Self {
        let has_attributes = tangents.is_some() || mesh.has_attributes();
        let varies = has_attributes || !mesh.normals.is_empty() || !mesh.uvs.is_empty();
        Self {
            mesh,
            instance: number,
            matrix,
            normal_matrix: normal_matrix(matrix),
            mirrored: matrix.determinant() < 0.0,
            has_attributes,
            records: vec![NONE; if varies { mesh.positions.len() } else { 1 }],
            by_tangent: HashMap::new(),
        }
    }

    /// Returns the index of the record of a vertex with this tangent, which is appended to `all`
    /// if there is none yet.
    pub fn record(&mut self, vertex: usize, tangent: Option<[f32; 4]>, all: &mut Vec<MeshVertex>) -> u32 {
        let next = all.len() as u32;
        let tangent = tangent.map_or(0, |tangent| self.encoded(tangent));
        if tangent != 0 {
            match self.by_tangent.entry((vertex as u32, tangent)) {
                Entry::Occupied(index) => return *index.get(),
                Entry::Vacant(place) => place.insert(next),
            };
        } else {
            let last = self.records.len() - 1;
            let index = &mut self.records[vertex.min(last)];
            if *index != NONE {
                return *index;
            }
            *index = next;
        }
        self.append(vertex, tangent, all);
        next
    }

    fn append(&self, vertex: usize, tangent: u32, all: &mut Vec<MeshVertex>) {
        let mesh = self.mesh;
        let normal = mesh.normals.get(vertex);
        let [u, v] = mesh.uvs.get(vertex).copied().unwrap_or([0.0; 2]);
        let attributes = if self.has_attributes { all.len() as u32 + 1 } else { 0 };
        all.push(MeshVertex {
            normal: normal.map_or(Vec3::ZERO, |n| unit(self.normal_matrix * Vec3::from(*n).as_dvec3())),
            material: mesh.material as u32,
            u,
            v,
            attributes,
            instance: self.instance,
        });
        if self.has_attributes {
            let [u, v] = mesh.second_uvs.get(vertex).copied().unwrap_or([0.0; 2]);
            let color = mesh.colors.get(vertex).map_or(Texel::WHITE, |color| texel(*color));
            all.push(bytemuck::cast(VertexAttributes { color, u, v, tangent, pad: [0; 3] }));
        }
    }

    /// Returns a tangent in the world, encoded. A mirroring transform turns the bitangent, which
    /// the cross product of the world's normal and tangent does not.
    fn encoded(&self, [x, y, z, handedness]: [f32; 4]) -> u32 {
        let tangent = unit(self.matrix * Vec3::new(x, y, z).as_dvec3());
        let tangent = if tangent == Vec3::ZERO { Vec3::X } else { tangent };
        encode_tangent(tangent, (handedness < 0.0) != self.mirrored)
    }
}

/// Returns the matrix that transforms normals where `matrix` transforms points: its inverse
/// transpose up to a positive factor, from cofactors, which singular matrices have too.
fn normal_matrix(matrix: DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if matrix.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}
