//! Bilinear patches of pbrt.

use super::super::assembly::grid;
use super::super::mesh;
use super::parameters::Parameters;
use super::tokens::At;
use super::{Reader, SceneError};
use crate::description::Mesh;
use glam::DVec3;

/// Cells along each side of a patch that is not flat.
const CELLS: u32 = 16;

impl Reader<'_> {
    /// Returns bilinear patches: a cell where they are flat, and a grid elsewhere.
    pub fn patches(&mut self, parameters: &Parameters, at: At) -> Result<(Mesh, DVec3), SceneError> {
        let (given, origin) = self.vertices(parameters, at)?;
        let indices = self.indices(parameters, (given.positions.len(), 4), at)?;
        let mut all = Mesh { name: "mesh".to_owned(), ..Mesh::default() };
        for patch in indices.chunks_exact(4) {
            let corners = [0, 1, 2, 3].map(|i| patch[i] as usize);
            let points = corners.map(|corner| DVec3::from(given.positions[corner].map(f64::from)));
            let cells = if is_flat(points) { 1 } else { CELLS };
            let bytes = mesh::bytes(u64::from((cells + 1).pow(2)), u64::from(2 * cells * cells));
            self.assembly.budget.take(bytes, &self.tokens.site(at, "Shape"))?;
            let normals = (!given.normals.is_empty())
                .then(|| corners.map(|corner| DVec3::from(given.normals[corner].map(f64::from))));
            let uvs = (!given.uvs.is_empty()).then(|| corners.map(|corner| given.uvs[corner]));
            append(&mut all, &patch_grid(points, normals, uvs, cells));
        }
        Ok((all, origin))
    }
}

/// Returns whether four corners are a parallelogram, of which two triangles are all.
fn is_flat([a, b, c, d]: [DVec3; 4]) -> bool {
    (a + d - b - c).length() <= 1e-6 * (d - a).length().max((c - b).length())
}

/// Returns the value of a bilinear patch, whose corners are at (0, 0), (1, 0), (0, 1) and (1, 1).
fn bilinear([a, b, c, d]: [DVec3; 4], u: f64, v: f64) -> DVec3 {
    (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v
}

/// Returns the mesh of a bilinear patch.
fn patch_grid(
    points: [DVec3; 4],
    normals: Option<[DVec3; 4]>,
    uvs: Option<[[f32; 2]; 4]>,
    cells: u32,
) -> Mesh {
    let [a, b, c, d] = points;
    grid(cells, cells, |u, v| {
        let along_u = (b - a) * (1.0 - v) + (d - c) * v;
        let along_v = (c - a) * (1.0 - u) + (d - b) * u;
        let normal = match normals {
            Some(normals) => bilinear(normals, u, v),
            None => along_u.cross(along_v).normalize_or(DVec3::Z),
        };
        let uv = match uvs {
            Some(uvs) => bilinear(uvs.map(|[u, v]| DVec3::new(f64::from(u), f64::from(v), 0.0)), u, v)
                .truncate()
                .as_vec2(),
            None => glam::DVec2::new(u, 1.0 - v).as_vec2(),
        };
        (bilinear(points, u, v), normal, uv.into())
    })
}

/// Appends a mesh with normals and texture coordinates to another one.
fn append(mesh: &mut Mesh, part: &Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend_from_slice(&part.positions);
    mesh.normals.extend_from_slice(&part.normals);
    mesh.uvs.extend_from_slice(&part.uvs);
    mesh.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
}
