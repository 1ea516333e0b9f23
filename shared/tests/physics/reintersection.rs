//! Rays that leave a planar shape or triangle never hit its neighbours (torture test 12): convex
//! meshes, boxes and tiled planes anywhere.

use crate::materials::NO_SCENE;
use crate::mesh::Mesh;
use crate::statistics::{SLOW, samples, words};

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::bvh::Hit;
use trisect_shared::features::{FeatureSet, SHAPES};
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::planar::{Planar, QUAD};
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::MISS;
use trisect_shared::surface::{self, Surface, offset_ray_origin};
use trisect_shared::triangle::{Shear, Triangle};

fn power(low: f32, high: f32, bits: u32) -> f32 {
    10f32.powf(low + (high - low) * unit_f32(bits))
}

/// Returns the surface as a path finds it: hit by a ray from `origin` towards `target`.
fn found(scene: Scene, index: u32, origin: Vec3, target: Vec3) -> Option<Surface> {
    let direction = normalize(target - origin);
    let mut params = RenderParams::zeroed();
    params.first_triangle = scene.planars.len() as u32;
    let distance = if scene.planars.is_empty() {
        scene.triangles[index as usize].hit(origin, &Shear::new(direction)).distance
    } else {
        scene.planars[index as usize].distance(origin, direction)
    };
    let (hit, departure) = (Hit::in_world(distance, index), OriginPrimitive::NONE);
    let ray = Ray::in_world(origin, direction, departure);
    // SAFETY: the index is of a primitive.
    (distance < MISS).then(|| unsafe { surface::at(FeatureSet::<SHAPES>::ALL, &params, scene, ray, hit) })
}

/// Returns an outward direction; one in four lies almost along the surface.
fn outward(normal: Vec3, i: u32) -> Vec3 {
    let w = words(21, i);
    let d = unit_sphere(w.x, w.y);
    let lift = if i.is_multiple_of(4) { 1e-3 } else { 1.0 };
    let flat = d - normal * d.dot(normal);
    normalize(flat + normal * (d.dot(normal).abs() * lift + 1e-6))
}

/// Counts how many of the rays that leave triangles of a convex mesh of size `scale` at `place` hit
/// another triangle of it, and how many were tested; `margin` scales the offset. Only pairs count
/// that are convex in double precision: rounding the vertices may dent the mesh.
fn triangle_rehits(scale: f32, place: Vec3, seed: u32, margin: f32) -> (u32, u32) {
    let sphere = Mesh::octahedron().divided(normalize).divided(normalize);
    let triangles: Vec<Triangle> = sphere
        .triangles()
        .into_iter()
        .map(|t| Triangle { a: t.a * scale + place, b: t.b * scale + place, c: t.c * scale + place, ..t })
        .collect();
    let vertices = [MeshVertex::zeroed()];
    let scene = Scene { triangles: &triangles, vertices: &vertices, ..NO_SCENE };
    let (mut rehits, mut count) = (0, 0);
    for i in 0..40 {
        let w = words(20, seed * 40 + i);
        let index = w.x % triangles.len() as u32;
        let t = triangles[index as usize];
        // Near an edge or inside; seen from nearby or from afar.
        let near = if i % 2 == 0 { power(-8.0, -1.0, w.y) } else { unit_f32(w.y) };
        let along = unit_f32(w.z);
        let target = t.a * (1.0 - near) * along + t.b * (1.0 - near) * (1.0 - along) + t.c * near;
        let n = normalize(t.normal());
        let origin = target + outward(n, i ^ w.w) * (scale * power(-1.0, 2.0, w.w));
        let Some(s) = found(scene, index, origin, target) else { continue };
        let direction = outward(s.normal, w.w);
        let start = offset_ray_origin(s.point, s.normal, s.error_bound * margin, true);
        let exact = |v: Vec3| v.as_dvec3();
        let normal = (exact(t.b) - exact(t.a)).cross(exact(t.c) - exact(t.a));
        if exact(direction).dot(normal) <= 0.0 {
            continue; // rounding of the normal: the ray goes inward
        }
        let shear = Shear::new(direction);
        let below = |v: Vec3| (exact(v) - exact(t.a)).dot(normal) <= 0.0;
        for other in (0..triangles.len()).filter(|&k| k != index as usize) {
            let o = triangles[other];
            if below(o.a) && below(o.b) && below(o.c) {
                count += 1;
                rehits += u32::from(o.hit(start, &shear).distance < MISS);
            }
        }
    }
    (rehits, count)
}

fn quad(origin: Vec3, edge_u: Vec3, edge_v: Vec3) -> Planar {
    // In double precision, then rounded, as the host makes it.
    let [u, v]: [DVec3; 2] = [edge_u.as_dvec3(), edge_v.as_dvec3()];
    let cross = u.cross(v);
    let square = cross.length_squared();
    Planar {
        origin,
        normal: cross.normalize().as_vec3(),
        kind: QUAD,
        dual_u: (v.cross(cross) / square).as_vec3(),
        dual_v: (cross.cross(u) / square).as_vec3(),
        edge_u,
        edge_v,
        area: cross.length() as f32,
        ..Planar::zeroed()
    }
}

/// Counts rays that leave the top of a box, as [`triangle_rehits`] does for meshes. The other faces
/// and the next tile of the top's plane must not be hit.
fn quad_rehits(scale: f32, place: Vec3, seed: u32, margin: f32) -> (u32, u32) {
    let w = words(22, seed);
    let x = if seed.is_multiple_of(2) { Vec3::X } else { unit_sphere(w.x, w.y) };
    let (y, z) = trisect_shared::math::basis(x);
    let [x, y, z] = [x * scale, y * scale, z * scale];
    let corner = place;
    let flats = [
        quad(corner + z, x, y),     // top
        quad(corner + z + x, x, y), // the tile beside it
        quad(corner, z, y),
        quad(corner, x, z),
        quad(corner + y, z, x),
        quad(corner + z + y, x, y),
    ];
    let scene = Scene { planars: &flats, ..NO_SCENE };
    let (mut rehits, mut count) = (0, 0);
    for i in 0..40 {
        let w = words(23, seed * 40 + i);
        let near = |bits: u32| {
            let distance = if bits.is_multiple_of(2) { power(-8.0, -1.0, bits) } else { unit_f32(bits) };
            if bits.is_multiple_of(3) { distance } else { 1.0 - distance }
        };
        let f = flats[0];
        let target = f.origin + f.edge_u * near(w.x) + f.edge_v * near(w.y);
        let origin = target + outward(f.normal, i ^ w.w) * (scale * power(-1.0, 2.0, w.z));
        let Some(s) = found(scene, 0, origin, target) else { continue };
        let direction = outward(s.normal, w.w);
        let start = offset_ray_origin(s.point, s.normal, s.error_bound * margin, true);
        for other in &flats[1..] {
            let t = other.distance(start, direction);
            count += 1;
            // A face's border is known to the rounding of the face's own size. Where the coordinate
            // on the top is smaller than that, by cancellation, rays may hit a side that pass its
            // border by less: by half an ULP of 1 and that of u or v.
            let height = (start - f.origin).dot(f.normal) + direction.dot(f.normal) * t;
            let hit = t < MISS && height > f32::EPSILON * scale;
            rehits += u32::from(hit);
        }
    }
    (rehits, count)
}

type Case = fn(f32, Vec3, u32, f32) -> (u32, u32);

/// Counts hits by the ratio of the position's distance to the scale, in powers of ten.
fn sweep(case: Case, margin: f32) -> [(u32, u32); 8] {
    let mut bins = [(0, 0); 8];
    for seed in 0..samples(4000) {
        let w = words(24, seed);
        let (scale, far) = (power(-4.0, 4.0, w.x), power(-4.0, 6.0, w.y));
        let place = Vec3::new(far, -0.5 * far, 0.25 * far);
        let bin = ((far / scale).log10() + 1.0).floor();
        if bin > 7.0 {
            continue;
        }
        let (rehits, count) = case(scale, place, seed, margin);
        let slot = &mut bins[bin.max(0.0) as usize];
        *slot = (slot.0 + rehits, slot.1 + count);
    }
    bins
}

/// No ray hits its surface's neighbours, whether the mesh is as large as its distance from the
/// origin or 10^-7 of that, where its triangles are a few units in the last place; scales from
/// 10^-4 to 10^4.
#[test]
fn neighbours_are_not_met() {
    for (name, case) in [("triangles", triangle_rehits as Case), ("quads", quad_rehits)] {
        let bins = sweep(case, 1.0);
        println!("{name}: hits and rays by log10 of distance over size {bins:?}");
        assert!(bins.iter().all(|&(rehits, count)| rehits == 0 && count > 0), "{name}: {bins:?}");
        // Negative control: without the offset.
        let bins = sweep(case, 0.0);
        println!("{name} without the offset: {bins:?}");
        assert!(bins.iter().all(|&(rehits, _)| rehits > 0) || SLOW, "{name}: {bins:?}");
    }
}

/// The offset stays below two millionths of the coordinates.
#[test]
fn offsets_are_small() {
    for i in 0..samples(20_000) {
        let w = words(25, i);
        let (scale, far) = (power(-4.0, 4.0, w.x), power(-4.0, 6.0, w.y));
        let place = Vec3::new(far, -0.5 * far, 0.25 * far);
        let [a, b, c] = [w.z, w.w, w.z ^ w.w].map(|bits| unit_sphere(bits, w.x ^ w.y) * scale + place);
        let triangles = [Triangle::of([a, b, c])];
        let vertices = [MeshVertex::zeroed()];
        let scene = Scene { triangles: &triangles, vertices: &vertices, ..NO_SCENE };
        let target = (a + b + c) / 3.0;
        if let Some(s) = found(scene, 0, target + triangles[0].normal().normalize_or_zero() * scale, target) {
            let moved = (offset_ray_origin(s.point, s.normal, s.error_bound, true) - s.point).length();
            assert!(moved < 2e-6 * (scale + 1.2 * far), "{moved} {scale} {far}");
        }
    }
}
