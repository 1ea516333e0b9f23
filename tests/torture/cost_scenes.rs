//! Scenes whose rays may visit unusually many nodes, for the cost tests (44) and the experiment in
//! `splits`. Trisect was tuned on none of them.

use crate::construct::{self, quad, sphere, words};
use crate::mesh::Mesh;
use glam::Vec3;
use trisect::scene::Scene;
use trisect::scene::description::ShapeKind;
use trisect_shared::math::{basis, normalize, unit_f32, unit_sphere};

/// A named scene of the cost tests.
pub struct CostScene {
    pub name: &'static str,
    pub scene: Scene,
    /// Origin of a third of the rays; without it, those rays start outside the scene.
    pub eye: Option<Vec3>,
    /// Each ray visits thousands of nodes in whatever direction, so only few are traced.
    pub is_costly: bool,
    /// All boxes are equal. obvhs' builder would take one pass per box, so it does not run on this
    /// scene.
    pub is_coincident: bool,
}

/// Returns all cost scenes. Most have 10,000 to 33,000 primitives; the needles are 100,000.
pub fn all() -> Vec<CostScene> {
    let new = |name, scene| CostScene { name, scene, eye: None, is_costly: false, is_coincident: false };
    let triangles = |name, triangles: Vec<[Vec3; 3]>| new(name, construct::scene(Vec::new(), &triangles));
    let shapes = |name, shapes| new(name, construct::scene(shapes, &[]));
    let from = |eye, scene| CostScene { eye: Some(eye), ..scene };
    let costly = |scene| CostScene { is_costly: true, ..scene };
    let coincident = |scene| CostScene { is_costly: true, is_coincident: true, ..scene };
    let shells = (1..=1000).map(|i| sphere(Vec3::ZERO, i as f32 * 1e-3)).collect();
    vec![
        triangles("mesh", rock(6, 1.0)),
        from(Vec3::ZERO, triangles("camera inside the mesh", rock(6, 1.0))),
        triangles("terraces", terraces(48)),
        shapes("grid of boxes", grid(12)),
        shapes("boxes of zero thickness", sheets(20_000)),
        coincident(shapes("20,000 coincident spheres", vec![sphere(Vec3::ONE, 0.5); 20_000])),
        coincident(triangles("20,000 coincident triangles", vec![[Vec3::X, Vec3::Y, Vec3::Z]; 20_000])),
        triangles("slivers", slivers(20_000)),
        costly(triangles("100,000 needles", needles(100_000))),
        triangles("overlapping soup", soup(20_000)),
        from(Vec3::ZERO, new("tiny mesh in a huge room", room(1e4, &rock(4, 1e-2)))),
        shapes("1,000 nested spheres", shells),
        from(Vec3::splat(0.9), new("facing mirrors", room(2.0, &rock(4, 0.5)))),
    ]
}

fn signed(bits: u32) -> f32 {
    2.0 * unit_f32(bits) - 1.0
}

/// Returns a point of the cube from -1 to 1.
fn point(stream: u32, i: u32) -> Vec3 {
    let w = words(stream, i);
    Vec3::new(signed(w.x), signed(w.y), signed(w.z))
}

/// Returns a rugged ball of 8 · 4^`divisions` triangles.
fn rock(divisions: u32, size: f32) -> Vec<[Vec3; 3]> {
    let mut mesh = Mesh::octahedron();
    for _ in 0..divisions {
        mesh = mesh.divided(normalize);
    }
    for v in &mut mesh.vertices {
        let w = words(4400, v.x.to_bits() ^ v.y.to_bits().rotate_left(11) ^ v.z.to_bits().rotate_left(22));
        *v *= size * (0.9 + 0.2 * unit_f32(w.x));
    }
    mesh.faces.iter().map(|face| face.map(|i| mesh.vertices[i])).collect()
}

/// Returns the two triangles of a parallelogram.
fn halves(corner: Vec3, u: Vec3, v: Vec3) -> [[Vec3; 3]; 2] {
    [[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]]
}

/// Returns a hill of `side` by `side` flat steps, with the walls between them.
fn terraces(side: i32) -> Vec<[Vec3; 3]> {
    let height = |x: i32, z: i32| {
        let (x, z) = (x - side / 2, z - side / 2);
        if x.abs().max(z.abs()) > side / 2 { 0.0 } else { (side - x.abs() - z.abs()).max(0) as f32 * 0.5 }
    };
    let mut triangles = Vec::new();
    for x in 0..side {
        for z in 0..side {
            let top = height(x, z);
            let corner = Vec3::new(x as f32, top, z as f32);
            triangles.extend(halves(corner, Vec3::Z, Vec3::X));
            let (right, back) = (height(x + 1, z), height(x, z + 1));
            triangles.extend(halves(corner + Vec3::X, Vec3::Z, Vec3::Y * (right - top)));
            triangles.extend(halves(corner + Vec3::Z, Vec3::X, Vec3::Y * (back - top)));
        }
    }
    triangles.retain(|[a, b, c]| (b - a).cross(c - a).length_squared() > 0.0);
    triangles
}

/// Returns the faces of `side`³ cubes at whole numbers; many faces lie in the same planes.
fn grid(side: i32) -> Vec<ShapeKind> {
    let mut shapes = Vec::new();
    for i in 0..side * side * side {
        let low = Vec3::new((i % side) as f32, (i / side % side) as f32, (i / side / side) as f32);
        for (axis, &normal) in Vec3::AXES.iter().enumerate() {
            let (u, v) = (Vec3::AXES[(axis + 1) % 3] * 0.5, Vec3::AXES[(axis + 2) % 3] * 0.5);
            shapes.extend([quad(low, u, v), quad(low + normal * 0.5, u, v)]);
        }
    }
    shapes
}

/// Returns small quads in axis planes, a few hundred of them in each plane.
fn sheets(count: u32) -> Vec<ShapeKind> {
    let sheet = |i: u32| {
        let axis = i as usize % 3;
        let mut corner = point(4401, i);
        corner[axis] = (corner[axis] * 16.0).round() / 16.0;
        quad(corner, Vec3::AXES[(axis + 1) % 3] * 0.05, Vec3::AXES[(axis + 2) % 3] * 0.05)
    };
    (0..count).map(sheet).collect()
}

/// Returns triangles 10,000 times as long as wide, a tenth of the scene long.
fn slivers(count: u32) -> Vec<[Vec3; 3]> {
    let sliver = |i: u32| {
        let (a, w) = (point(4402, i), words(4403, i));
        let along = unit_sphere(w.x, w.y);
        [a, a + along * 0.2, a + along * 0.1 + basis(along).0 * 2e-5]
    };
    (0..count).map(sliver).collect()
}

/// Returns triangles from one side of the scene to another, 1e-4 wide.
fn needles(count: u32) -> Vec<[Vec3; 3]> {
    let needle = |i: u32| {
        let (a, b) = (normalize(point(4404, i)), normalize(point(4405, i)));
        [a, b, b + basis(normalize(b - a)).0 * 1e-4]
    };
    (0..count).map(needle).collect()
}

/// Returns triangles of up to a third of the scene's size.
fn soup(count: u32) -> Vec<[Vec3; 3]> {
    let triangle = |i: u32| {
        let a = point(4406, i);
        [a, a + point(4407, i) * 0.3, a + point(4408, i) * 0.3]
    };
    (0..count).map(triangle).collect()
}

/// Returns a scene of the triangles within six walls, each parallel to an axis plane and facing
/// another.
fn room(size: f32, triangles: &[[Vec3; 3]]) -> Scene {
    let half = 0.5 * size;
    let walls = Vec3::AXES.iter().enumerate().flat_map(|(axis, &normal)| {
        let (u, v) = (Vec3::AXES[(axis + 1) % 3] * size, Vec3::AXES[(axis + 2) % 3] * size);
        let corner = -Vec3::splat(half);
        [quad(corner, u, v), quad(corner + normal * size, u, v)]
    });
    construct::scene(walls.collect(), triangles)
}
