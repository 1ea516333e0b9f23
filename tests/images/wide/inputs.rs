//! Scenes and rays for the traversals: coincident, flat, thin, far, and random ones.

use bytemuck::Zeroable;
use glam::{DAffine3, DQuat, Vec3};
use std::fmt::Write;
use trisect::scene::{Scene, SharedInstance, SharedMesh};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::bvh::RayQuery;
use trisect_shared::math::{unit_f32, unit_sphere};
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::rng::PathKey;
use trisect_shared::triangle::Triangle;

/// Returns four random words.
pub fn words(seed: u32, index: u32) -> [u32; 4] {
    let w = PathKey { seed, pixel: index, sample: 0 }.words(0);
    [w.x, w.y, w.z, w.w]
}

fn point(seed: u32, index: u32) -> Vec3 {
    let [x, y, z, _] = words(seed, index).map(|w| 2.0 * unit_f32(w) - 1.0);
    Vec3::new(x, y, z)
}

fn pick<T: Copy>(from: &[T], word: u32) -> T {
    from[word as usize % from.len()]
}

fn triangle(scene: &mut Scene, corners: [Vec3; 3]) {
    scene.triangles.push(Triangle::of(corners));
    scene.vertices.push(MeshVertex::zeroed());
}

/// Returns a scene of spheres, quads and triangles placed in the cube from -`size` to `size`.
/// `kind`: 0 random, 1 at two places, 2 flat and along axes, 3 needles.
pub fn build(kind: u32, size: f32, count: u32) -> Scene {
    let place = |seed, i| if kind == 1 { point(seed, i % 2) } else { point(seed, i) };
    let tuple = |v: Vec3| format!("({:e}, {:e}, {:e})", v.x, v.y, v.z);
    let mut objects = String::new();
    for i in 0..count {
        let center = tuple(place(10, i) * size);
        let radius = size * if kind == 1 { 0.2 } else { 0.01 + 0.2 * unit_f32(words(11, i)[0]) };
        write!(objects, "Sphere(center: {center}, radius: {radius:e}, material: \"m\"),").unwrap();
        if i % 2 == 0 {
            let corner = tuple(place(12, i) * size);
            let (u, v) = if kind == 2 {
                (pick(&[Vec3::X, Vec3::Y], i / 2), Vec3::Z)
            } else {
                let u = unit_sphere(words(13, i / 4)[0], words(13, i / 4)[1]);
                (u, u.any_orthonormal_vector())
            };
            let (u, v) = (tuple(u * size * 0.3), tuple(v * size * 0.2));
            write!(objects, "Quad(corner: {corner}, u: {u}, v: {v}, material: \"m\"),").unwrap();
        }
    }
    let text = format!(
        "Scene(version: 1, image: (width: 1, height: 1), materials: {{ \"m\": Lambertian(albedo: (1, 1, 1)) }},
         camera: (look_from: (0, 0, 0), look_at: (0, 0, -1), vertical_fov: 60), objects: [{objects}])"
    );
    let mut scene = Scene::parse(&text, "wide").unwrap();
    for i in 0..4 * count {
        let a = place(14, i);
        let corners = match kind {
            2 => {
                // A lattice of a few planes: shared edges, flat boxes, and faces of boxes at the
                // same place.
                let cell = (a * 4.0).round() * 0.25;
                let (u, v) = pick(&[(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)], i);
                [cell, cell + u * 0.25, cell + v * 0.25]
            }
            3 => [a, point(15, i), point(15, i) + point(16, i) * 1e-5],
            1 => [a, a + Vec3::X * 0.1, a + Vec3::Y * 0.1],
            _ => [a, a + point(15, i) * 0.2, a + point(16, i) * 0.2],
        };
        triangle(&mut scene, corners.map(|corner| corner * size));
    }
    scene
}

/// Returns various rays: from anywhere and from primitives, along axes, with tiny components, and
/// towards vertices and centres.
pub fn rays(scene: &Scene, size: f32, count: u32) -> Vec<(Ray, RayQuery)> {
    let triangles = scene.numbered_triangles();
    let small = [0.0, -0.0, 1e-45, -1e-38, 1e-20, 1e-8, 1.0, -1.0];
    let all = scene.primitives() as u32;
    (0..count)
        .map(|i| {
            let [w, v] = [words(20, i), words(21, i)];
            let vertex = triangles[w[3] as usize % triangles.len()];
            let origin = match v[0] % 4 {
                0 => pick(&[vertex.a, vertex.b, (vertex.a + vertex.b + vertex.c) / 3.0], v[1]),
                1 => scene.spheres[v[1] as usize % scene.spheres.len()].center,
                2 => (point(22, i) * 4.0).round() * 0.25 * size,
                _ => point(22, i) * size * 2.0,
            };
            let mut direction = match v[2] % 4 {
                0 => Vec3::new(pick(&small, w[0]), pick(&small, w[1]), pick(&small, w[2])),
                1 => pick(&Vec3::AXES, w[0]) * if w[1] % 2 == 0 { 1.0 } else { -1.0 },
                2 => vertex.c / size - origin / size,
                _ => unit_sphere(w[0], w[1]),
            };
            if !(1e-6..1e6).contains(&direction.length_squared()) {
                direction = Vec3::Z;
            }
            let departure = match v[3] % 3 {
                0 => OriginPrimitive::new(w[3] % all, w[2] % 2 == 0),
                _ => OriginPrimitive::NONE,
            };
            let limit = if v[3] % 5 == 0 { size * unit_f32(w[1]) } else { RayQuery::CLOSEST.t_max };
            (
                Ray::in_world(origin, direction.normalize(), departure),
                RayQuery { t_max: limit, ..RayQuery::CLOSEST },
            )
        })
        .collect()
}

/// Moves the triangles of a scene to shared meshes, of which there are instances, some of them
/// coincident, and one at a time mirrored or of one triangle.
pub fn share(scene: &mut Scene, size: f32) {
    let all = std::mem::take(&mut scene.triangles);
    let counts = [all.len() / 2, 1, all.len() - all.len() / 2 - 1];
    let mut first = 0;
    for count in counts {
        let corners = all[first..first + count].iter().flat_map(|t| [t.a, t.b, t.c]);
        let (low, high) =
            corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        scene.shared.meshes.push(SharedMesh {
            low: low.as_dvec3().to_array(),
            high: high.as_dvec3().to_array(),
            triangles: count as u64,
        });
        first += count;
    }
    scene.shared.triangles = all.to_vec();
    for i in 0..12u32 {
        let w = words(17, i / 2);
        let scale = Vec3::splat(0.3 + unit_f32(w[0])) * if i % 4 < 2 { Vec3::ONE } else { -Vec3::ONE };
        let turn = if i < 4 { 0.0 } else { f64::from(unit_f32(w[1])) };
        let map = DAffine3::from_scale_rotation_translation(
            scale.as_dvec3(),
            DQuat::from_rotation_y(turn),
            (point(18, i / 2) * size * 0.5).as_dvec3(),
        );
        scene.shared.instances.push(SharedInstance {
            to_world: map.to_cols_array(),
            mesh: i / 2 % 3,
            object: i,
        });
    }
}
