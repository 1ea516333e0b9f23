//! Tangents of meshes for normal maps, by MikkTSpace (Mikkelsen, "Simulation of Wrinkled Surfaces
//! Revisited", 2008), for which normal maps are made.

use super::super::description::Mesh;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec3};

/// Tangent of each corner of each triangle, with its handedness as [`Mesh::tangents`] has it.
pub(super) type CornerTangents = Vec<[[f32; 4]; 3]>;

/// Returns the tangents of a mesh: its own, or those of MikkTSpace for a set of texture
/// coordinates. A corner whose neighbours all lack an area in texture space gets some tangent.
pub(super) fn tangents(mesh: &Mesh, uvs: &[[f32; 2]]) -> CornerTangents {
    let some = |normal: Vec3| {
        let any = normal.try_normalize().unwrap_or(Vec3::Z).any_orthonormal_vector();
        [any.x, any.y, any.z, 1.0]
    };
    let mut result = CornerTangents::with_capacity(mesh.triangles.len());
    let normals = Normals::of(mesh);
    // glTF: without normals a mesh is flat, and its tangents are ignored.
    if !mesh.tangents.is_empty() && !mesh.normals.is_empty() {
        result.extend(mesh.triangles.iter().enumerate().map(|(face, corners)| {
            [0, 1, 2].map(|corner| {
                let own = mesh.tangents.get(corners[corner] as usize).copied().unwrap_or_default();
                let [x, y, z, _] = own;
                let usable = Vec3::new(x, y, z).length_squared();
                if usable > 1e-12 && usable.is_finite() { own } else { some(normals.at(face, corner)) }
            })
        }));
        return result;
    }
    let mut faces = Faces { mesh, uvs, normals, tangents: vec![[[0.0; 4]; 3]; mesh.triangles.len()] };
    // It fails only beyond 2^32 vertices; then, as without texture coordinates, any tangent serves.
    let _ = generate_tangents(&mut faces);
    let Faces { normals, mut tangents, .. } = faces;
    for (face, corners) in tangents.iter_mut().enumerate() {
        for (corner, tangent) in corners.iter_mut().enumerate() {
            let length = Vec3::new(tangent[0], tangent[1], tangent[2]).length_squared();
            if !(length > 1e-12 && length.is_finite()) {
                *tangent = some(normals.at(face, corner));
            }
        }
    }
    tangents
}

/// Normals of a mesh at the corners of its triangles.
struct Normals<'a> {
    mesh: &'a Mesh,
    /// Normals of the triangles of a flat mesh.
    of_faces: Vec<Vec3>,
}

impl<'a> Normals<'a> {
    fn of(mesh: &'a Mesh) -> Self {
        let position = |vertex: u32| {
            mesh.positions.get(vertex as usize).map_or(DVec3::ZERO, |p| Vec3::from(*p).as_dvec3())
        };
        let normal = |&[a, b, c]: &[u32; 3]| {
            let (a, b, c) = (position(a), position(b), position(c));
            (b - a).cross(c - a).normalize_or_zero().as_vec3()
        };
        let is_flat = mesh.normals.is_empty();
        let of_faces = if is_flat { mesh.triangles.iter().map(normal).collect() } else { Vec::new() };
        Self { mesh, of_faces }
    }

    fn at(&self, face: usize, corner: usize) -> Vec3 {
        if let Some(normal) = self.of_faces.get(face) {
            return *normal;
        }
        let vertex = self.mesh.triangles[face][corner] as usize;
        self.mesh.normals.get(vertex).map_or(Vec3::Z, |normal| Vec3::from(*normal))
    }
}

/// A mesh as MikkTSpace reads it.
struct Faces<'a> {
    mesh: &'a Mesh,
    uvs: &'a [[f32; 2]],
    normals: Normals<'a>,
    tangents: CornerTangents,
}

impl Faces<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry for Faces<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions.get(self.vertex(face, corner)).copied().unwrap_or_default()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals.at(face, corner).into()
    }

    /// Returns texture coordinates with v upwards, as normal maps have y.
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let [u, v] = self.uvs.get(self.vertex(face, corner)).copied().unwrap_or_default();
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        self.tangents[face][corner] = tangent.map_or([0.0; 4], |tangent| tangent.tangent_encoded());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad() -> Mesh {
        Mesh {
            positions: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    /// The tangent points where u grows, and the bitangent where v shrinks, as an image's rows run
    /// down.
    #[test]
    fn tangents_follow_texture_coordinates() {
        let mesh = quad();
        let upright = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
        for corners in tangents(&mesh, &upright) {
            assert_eq!(corners, [[1.0, 0.0, 0.0, 1.0]; 3]);
        }
        let mirrored = upright.map(|[u, v]| [1.0 - u, v]);
        for corners in tangents(&mesh, &mirrored) {
            assert_eq!(corners, [[-1.0, 0.0, 0.0, -1.0]; 3]);
        }
        let turned = upright.map(|[u, v]| [v, 1.0 - u]);
        for corners in tangents(&mesh, &turned) {
            assert_eq!(corners, [[0.0, -1.0, 0.0, 1.0]; 3]);
        }
    }

    #[test]
    fn degenerate_coordinates_have_some_tangent() {
        let mut mesh = quad();
        let is_tangent = |corners: &[[f32; 4]; 3]| {
            corners.iter().all(|[x, y, z, w]| {
                let v = Vec3::new(*x, *y, *z);
                (v.length() - 1.0).abs() < 1e-6 && v.z.abs() < 1e-6 && w.abs() == 1.0
            })
        };
        for uvs in [vec![], vec![[0.5; 2]; 4], vec![[f32::MAX, 0.0], [0.0; 2], [1.0; 2], [0.0; 2]]] {
            assert!(tangents(&mesh, &uvs).iter().all(is_tangent), "{uvs:?}");
        }
        // Own tangents that are zero or not finite.
        mesh.normals = vec![[0.0, 0.0, 1.0]; 4];
        mesh.tangents =
            vec![[0.0; 4], [f32::NAN, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, -1.0], [1.0, 0.0, 0.0, 1.0]];
        let found = tangents(&mesh, &[]);
        assert!(found.iter().all(is_tangent), "{found:?}");
        assert_eq!(found[0][2], [0.0, 1.0, 0.0, -1.0]);
    }
}
