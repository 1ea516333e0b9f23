//! Closed meshes have no holes (torture test 13), and degenerate triangles (28) do no harm.

use crate::statistics::{SLOW, samples, words};
use glam::Vec3;
use std::collections::HashMap;
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::sphere::MISS;
use trisect_shared::triangle::{Shear, Triangle};

/// A closed mesh around the origin, triangles outward.
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

    /// Each triangle in four, the new vertices moved by `project`.
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
            Triangle { a, b, c, material: 0, pad0: 0, pad1: 0 }
        };
        self.faces.iter().map(triangle).collect()
    }

    fn moved(mut self, by: impl Fn(Vec3) -> Vec3) -> Self {
        self.vertices.iter_mut().for_each(|v| *v = by(*v));
        self
    }
}

/// A rugged rock of 2048 triangles.
fn rock() -> Mesh {
    let mut mesh = Mesh::octahedron();
    for _ in 0..4 {
        mesh = mesh.divided(normalize);
    }
    let bumps = |v: Vec3| {
        let w = words(10, v.x.to_bits() ^ v.y.to_bits().rotate_left(11) ^ v.z.to_bits().rotate_left(22));
        v * (0.9 + 0.2 * unit_f32(w.x))
    };
    mesh.moved(bumps)
}

/// An octahedron whose vertices and edges lie on a grid of powers of two: rays along its axes and diagonals meet them exactly.
fn crystal() -> Mesh {
    Mesh::octahedron().divided(|v| v).divided(|v| v).divided(|v| v)
}

fn woop(t: &Triangle, origin: Vec3, direction: Vec3) -> bool {
    let hit = t.hit(origin, &Shear::new(direction));
    let sum = hit.weight_b + hit.weight_c;
    assert!(hit.distance == MISS || (-1e-3..=1.001).contains(&sum), "{hit:?}");
    hit.distance < MISS
}

/// Without a rule for edges: by inequalities between rounded numbers (Möller and Trumbore, 1997).
fn rounded(t: &Triangle, origin: Vec3, direction: Vec3) -> bool {
    let (e1, e2) = (t.b - t.a, t.c - t.a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let s = origin - t.a;
    let q = s.cross(e1);
    let (u, v) = (s.dot(p) / determinant, direction.dot(q) / determinant);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(q) / determinant > 0.0
}

/// Rays from inside: at random, at vertices, at the middles of edges, along axes and diagonals.
fn rays(mesh: &Mesh, inside: f32) -> Vec<(Vec3, Vec3)> {
    let start = |i: u32| {
        let w = words(11, i);
        unit_sphere(w.x, w.y) * (inside * unit_f32(w.z))
    };
    let mut rays: Vec<(Vec3, Vec3)> = (0..samples(40_000))
        .map(|i| {
            let w = words(12, i);
            (start(i), unit_sphere(w.x, w.y))
        })
        .collect();
    let mut targets = mesh.vertices.clone();
    for f in &mesh.faces {
        targets.extend((0..3).map(|k| (mesh.vertices[f[k]] + mesh.vertices[f[(k + 1) % 3]]) * 0.5));
    }
    for (i, &target) in targets.iter().enumerate().step_by(if SLOW { 50 } else { 1 }) {
        for origin in [start(i as u32), Vec3::ZERO, start(i as u32 + 1) * 1e-6] {
            rays.push((origin, normalize(target - origin)));
            rays.push((origin, target - origin)); // exact, not of unit length
        }
        // Along an axis and exactly through it.
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

/// How many rays meet none of the triangles. Only those about the ray are looked at: the others miss by far.
fn leaks(mesh: &Mesh, inside: f32, hits: impl Fn(&Triangle, Vec3, Vec3) -> bool) -> (usize, usize) {
    let triangles = mesh.triangles();
    // A sphere around each triangle, with room.
    let around = |t: &Triangle| {
        let middle = (t.a + t.b + t.c) / 3.0;
        let far = |v: Vec3| (v - middle).length();
        (middle, 1.01 * far(t.a).max(far(t.b)).max(far(t.c)))
    };
    let spheres: Vec<(Vec3, f32)> = triangles.iter().map(around).collect();
    let near = |o: Vec3, d: Vec3, (c, r): (Vec3, f32)| {
        let d = normalize(d);
        let f = c - o;
        let b = f.dot(d);
        b > -r && (f - d * b).length_squared() < r * r
    };
    let rays = rays(mesh, inside);
    let leaks = rays.iter().filter(|&&(o, d)| {
        !triangles.iter().zip(&spheres).any(|(t, &sphere)| near(o, d, sphere) && hits(t, o, d))
    });
    (leaks.count(), rays.len())
}

#[test]
fn closed_meshes_have_no_holes() {
    let (rock, crystal) = (rock(), crystal());
    // Inside of the rock, of the crystal: |x| + |y| + |z| < 1.
    for (name, mesh, inside) in [("rock", &rock, 0.5), ("crystal", &crystal, 0.57)] {
        let (found, of) = leaks(mesh, inside, woop);
        println!("{name}: {found} leaks of {of} rays");
        assert_eq!(found, 0, "{name}");
    }
    // The twin leaks at edges and vertices.
    let twin = leaks(&rock, 0.5, rounded);
    println!("without a rule for edges: {} leaks of {}", twin.0, twin.1);
    assert!(twin.0 > 0);
}

/// The same bits at every scale, down to where the product of three lengths ends, 2e-10 for triangles an eighth as large.
#[test]
fn scales() {
    let mesh = crystal();
    for (origin, direction) in rays(&mesh, 0.57).into_iter().step_by(if SLOW { 1000 } else { 100 }) {
        for t in mesh.triangles() {
            let want = t.hit(origin, &Shear::new(direction));
            for k in [-32, -20, 20, 40] {
                let scale = (k as f32).exp2();
                let scaled = Triangle { a: t.a * scale, b: t.b * scale, c: t.c * scale, ..t };
                let got = scaled.hit(origin * scale, &Shear::new(direction));
                let distance = if want.distance < MISS { want.distance * scale } else { MISS };
                assert_eq!((got.distance, got.weight_b), (distance, want.weight_b), "2^{k}: {t:?} {origin}");
            }
        }
    }
}

/// Collinear, doubled and needle-like triangles: no NaN; what has no area is met by no ray that passes beside it.
#[test]
fn degenerate_triangles() {
    let (p, q) = (Vec3::new(0.3, -0.7, 2.1), Vec3::new(1.9, 0.4, 2.9));
    let needle = Vec3::new(0.3, -0.7, 2.1) + (q - p) * 0.5 + Vec3::new(1e-6, -1e-6, 0.0);
    let corners =
        [(p, p, p), (p, p, q), (p, q, q), (p, q, p), (p, q, (p + q) * 0.5), (p, q, p + (q - p) * 2.0)];
    let mut sliver = 0;
    for (i, (a, b, c)) in corners.into_iter().chain([(p, q, needle)]).enumerate() {
        let t = Triangle { a, b, c, material: 0, pad0: 0, pad1: 0 };
        for k in 0..samples(100_000) {
            let w = words(13, k);
            let origin = unit_sphere(w.x, w.y);
            let on = p + (q - p) * (2.0 * unit_f32(w.z) - 0.5);
            let beside = on + unit_sphere(w.z, w.w) * if k % 2 == 0 { 0.01 } else { 0.0 };
            let direction = normalize(beside - origin);
            let hit = t.hit(origin, &Shear::new(direction));
            assert!(
                !hit.distance.is_nan() && !hit.weight_b.is_nan() && !hit.weight_c.is_nan(),
                "{i} {hit:?}"
            );
            if hit.distance < MISS {
                // From where to the line: rays within some roundings of it may meet it.
                let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
                let along = (q - p).as_dvec3().normalize();
                let between = (p.as_dvec3() - o).dot(along.cross(d).normalize()).abs();
                assert!(between < if i == 6 { 2e-6 } else { 1e-6 }, "{i}: {between}");
                sliver += 1;
            }
            assert!(i > 2 || hit.distance == MISS, "{i}: {hit:?} of a doubled vertex");
        }
    }
    println!("{sliver} hits of slivers");
}
