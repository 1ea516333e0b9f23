//! Closed meshes, and rays from inside that search for holes. The torture tests include this file,
//! too.

use glam::Vec3;
use std::collections::HashMap;
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::rng::PathKey;
use trisect_shared::triangle::Triangle;

/// Closed mesh around the origin, with triangles that face outward.
pub struct Mesh {
    pub vertices: Vec<Vec3>,
    pub faces: Vec<[usize; 3]>,
}

impl Mesh {
    pub fn octahedron() -> Self {
        let vertices = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z].to_vec();
        let mut faces = Vec::new();
        for (x, y, z) in
            [(0, 1, 2), (3, 2, 1), (3, 4, 2), (0, 2, 4), (0, 5, 1), (3, 1, 5), (3, 5, 4), (0, 4, 5)]
        {
            faces.push([x, y, z]);
        }
        Self { vertices, faces }
    }

    /// Divides each triangle into four, and moves the new vertices by `project`.
    pub fn divided(&self, project: impl Fn(Vec3) -> Vec3) -> Self {
        let mut vertices = self.vertices.clone();
        let mut middles = HashMap::new();
        let mut faces = Vec::new();
        for &[a, b, c] in &self.faces {
            let mut middle = |i: usize, j: usize| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    vertices.push(project((vertices[i] + vertices[j]) * 0.5));
                    vertices.len() - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        Self { vertices, faces }
    }

    pub fn triangles(&self) -> Vec<Triangle> {
        let triangle = |f: &[usize; 3]| {
            let [a, b, c] = f.map(|i| self.vertices[i]);
            Triangle::of([a, b, c])
        };
        self.faces.iter().map(triangle).collect()
    }
}

/// Returns an octahedron whose vertices and edges lie on a grid of powers of two: rays along its
/// axes and diagonals meet them exactly.
pub fn crystal() -> Mesh {
    Mesh::octahedron().divided(|v| v).divided(|v| v).divided(|v| v)
}

/// Returns rays from inside, as origin and direction: `random` random ones; rays at each `step`th
/// vertex or middle of an edge; rays along axes and diagonals. `inside` is the radius of a ball
/// inside the mesh.
pub fn rays(mesh: &Mesh, inside: f32, random: u32, step: usize) -> Vec<(Vec3, Vec3)> {
    let words = |stream, i| PathKey { seed: stream, pixel: i, sample: 0 }.words(0);
    let start = |i: u32| {
        let w = words(11, i);
        unit_sphere(w.x, w.y) * (inside * unit_f32(w.z))
    };
    let mut rays: Vec<(Vec3, Vec3)> = (0..random)
        .map(|i| {
            let w = words(12, i);
            (start(i), unit_sphere(w.x, w.y))
        })
        .collect();
    let mut targets = mesh.vertices.clone();
    for f in &mesh.faces {
        targets.extend((0..3).map(|k| (mesh.vertices[f[k]] + mesh.vertices[f[(k + 1) % 3]]) * 0.5));
    }
    for (i, &target) in targets.iter().enumerate().step_by(step) {
        for origin in [start(i as u32), Vec3::ZERO, start(i as u32 + 1) * 1e-6] {
            rays.push((origin, normalize(target - origin)));
            rays.push((origin, target - origin)); // exact, not of unit length
        }
        // Along an axis and exactly through the target.
        for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
            let origin = target * (Vec3::ONE - axis.abs());
            if origin.abs().element_sum() < inside * 0.999 {
                rays.push((origin, axis));
            }
        }
    }
    for x in [-1.0f32, -0.0, 0.0, 1e-38, 1.0] {
        for y in [-1.0f32, 0.0, 1e-8, 1.0] {
            for z in [-1.0f32, 0.0, 1.0] {
                if x.abs() + y.abs() + z.abs() > 1e-30 {
                    rays.push((Vec3::ZERO, normalize(Vec3::new(x, y, z))));
                }
            }
        }
    }
    rays
}
