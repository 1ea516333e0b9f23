//! Edge of the light on coarse smooth meshes (torture test 47).

use crate::construct::words;
use crate::mesh::Mesh;
use bytemuck::Zeroable;
use glam::{EulerRot, Quat, Vec3};
use trisect::film::Film;
use trisect::scene::Scene;
use trisect_shared::attributes::MeshVertex;
use trisect_shared::math::{normalize, unit_sphere};
use trisect_shared::triangle::Triangle;
use trisect_tests::renders::{cpu, differing, film, independent};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Width and height of the images in pixels.
const SIZE: u32 = 64;

/// Returns a ball of 128 triangles with the normals of a sphere, before a wall if there is one, in
/// the light of a lamp from the right and of nothing else. Its triangles stay behind for the test.
fn ball(wall: &str) -> (Scene, Vec<Triangle>) {
    let text = format!(
        r#"Scene(version: 1, image: (width: {SIZE}, height: {SIZE}, samples: 16, depth: 2),
        camera: (look_from: (0, 0, 10), look_at: (0, 0, 0), height: 2),
        sky: Uniform(radiance: (0, 0, 0)),
        materials: {{ "white": Lambertian(albedo: (1, 1, 1)) }}, objects: [{wall}],
        lights: [Directional(direction: (-1, 0, 0), irradiance: (1, 1, 1))])"#
    );
    let mut scene = Scene::parse(&text, "ball").unwrap();
    // Turned, so that no edge follows the edge of the light.
    let turn = Quat::from_euler(EulerRot::XYZ, 0.3, 0.4, 0.5);
    let mut mesh = Mesh::octahedron().divided(normalize).divided(normalize);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
    let triangles = mesh.triangles();
    for triangle in &triangles {
        let first = scene.vertices.len() as u32;
        let vertex = |normal| MeshVertex { normal, ..MeshVertex::zeroed() };
        scene.vertices.extend([triangle.a, triangle.b, triangle.c].map(vertex));
        let (vertex_a, vertex_b, vertex_c) = (first, first + 1, first + 2);
        scene.triangles.push(Triangle { vertex_a, vertex_b, vertex_c, ..*triangle });
    }
    (scene, triangles)
}

/// Returns whether the sphere's normal at the middle of a pixel sees the lamp while its triangle
/// does not.
fn is_between_horizons(triangles: &[Triangle], x: u32, y: u32) -> bool {
    let place = |i: u32| (i as f32 + 0.5) * 2.0 / SIZE as f32 - 1.0;
    let (x, y) = (place(x), -place(y));
    triangles.iter().any(|t| {
        let edge = |p: Vec3, q: Vec3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
        let (a, b, c) = (edge(t.b, t.c), edge(t.c, t.a), edge(t.a, t.b));
        let normal = t.a * a + t.b * b + t.c * c;
        a > 0.0 && b > 0.0 && c > 0.0 && t.normal().x < 0.0 && normal.normalize().x > 0.05
    })
}

/// Returns how many pixels between the horizons there are, and how many of them are lit.
fn lit(film: &Film, triangles: &[Triangle]) -> (usize, usize) {
    let mut counts = (0, 0);
    for (index, pixel) in (0u32..).zip(&film.pixels) {
        if is_between_horizons(triangles, index % SIZE, index / SIZE) {
            counts.0 += 1;
            counts.1 += usize::from(pixel.mean()[0] > 0.0);
        }
    }
    counts
}

/// Light reaches most of the places that a smooth ball shows to it, though their triangles turn
/// away; a wall that is a tenth of a triangle away keeps it off.
fn t47_terminators(subject: BackendUnderTest) {
    let (scene, triangles) = ball("");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = independent(&scene);
    let got = film(&mut renderer, &settings);
    let (all, seen) = lit(&got, &triangles);
    assert!(all > 30 && seen * 10 > all * 7, "{seen} of {all}");
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        assert_eq!(differing(&got, &film(&mut cpu(&scene), &settings)), 0);
    }
    // The longest extent of a triangle is below 0.5.
    let wall = r#"Quad(corner: (1.06, -5, -5), u: (0, 10, 0), v: (0, 0, 10), material: "white")"#;
    let shaded = film(&mut subject.renderer(&ball(wall).0).expect("it opened before"), &settings);
    let light: f64 = shaded.pixels.iter().map(|pixel| pixel.mean()[0]).sum();
    assert_eq!(light, 0.0, "light behind the wall");
    // Negative control: flat triangles are dark there.
    let mut flat = scene;
    flat.vertices.iter_mut().for_each(|vertex| vertex.normal = Vec3::ZERO);
    let flat = film(&mut subject.renderer(&flat).expect("it opened before"), &settings);
    let (_, faulty) = lit(&flat, &triangles);
    assert!(faulty * 10 < all * 4, "negative control not detected: {faulty} of {all}");
    report(47, subject, Outcome::Passed, format!("{seen} of {all} pixels between the horizons are lit"));
}

/// Returns a closed room of 12 triangles in a white sky, with a camera inside. `normals` are those
/// of its eight vertices.
fn room(normals: impl Fn(usize, Vec3) -> Vec3) -> Scene {
    let text = r#"Scene(version: 1, image: (width: 61, height: 43, samples: 32, depth: 20),
        camera: (look_from: (0.6, -0.3, 0.5), look_at: (-1, 0.4, -1), vertical_fov: 90),
        sky: Uniform(radiance: (1, 1, 1)), objects: [],
        materials: { "white": Lambertian(albedo: (0.9, 0.9, 0.9)) })"#;
    let mut scene = Scene::parse(text, "room").unwrap();
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 2.0 } else { -1.0 };
        Vec3::new(side(0), side(1), side(2))
    };
    let vertex = |i| MeshVertex { normal: normals(i, corner(i)), ..MeshVertex::zeroed() };
    scene.vertices = (0..8).map(vertex).collect();
    for axis in 0..3 {
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        for side in [0, 1 << axis] {
            for [a, b, c] in [[0, u, v], [u, u | v, v]].map(|of| of.map(|i: usize| i | side)) {
                let (vertex_a, vertex_b, vertex_c) = (a as u32, b as u32, c as u32);
                let triangle = Triangle::of([corner(a), corner(b), corner(c)]);
                scene.triangles.push(Triangle { vertex_a, vertex_b, vertex_c, ..triangle });
            }
        }
    }
    scene
}

/// No light comes into a closed room of few triangles, whatever their normals: those of a ball,
/// and random ones. As with flat walls, a vertex of a path within rounding of an edge may lie
/// behind the other wall (torture test 46).
fn t47_closed_rooms(subject: BackendUnderTest) {
    let lit = |scene: &Scene| -> Option<usize> {
        let film = film(&mut subject.renderer(scene)?, &independent(scene));
        Some(film.pixels.iter().filter(|pixel| pixel.mean()[0] > 0.0).count())
    };
    let random = |i: usize, _| {
        let w = words(4700, i as u32);
        unit_sphere(w.x, w.y)
    };
    for scene in [room(|_, corner| (corner - 0.5).normalize()), room(random)] {
        let Some(lit) = lit(&scene) else { return };
        assert!(lit <= 2, "{lit} pixels see the sky");
    }
    // Negative control: a triangle is missing.
    let mut open = room(random);
    open.triangles.remove(3);
    let seen = lit(&open).expect("it opened before");
    assert!(seen > 500, "negative control not detected: {seen}");
    report(47, subject, Outcome::Passed, "closed rooms of few smooth triangles are dark");
}

for_each_route!(t47_terminators);
for_each_route!(t47_closed_rooms);
