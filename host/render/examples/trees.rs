//! Measures the construction of both BVHs of a scene: bytes, seconds, cost, and visits of rays.
//!
//! ```text
//! cargo run --release -p trisect --example trees -- \
//!     FILE|bumpy|soup|huge [COUNT] [fast|medium|high]
//! ```
//!
//! `bumpy` is a mesh of COUNT triangles on a grid of hills, `soup` has long thin triangles that
//! overlap, `huge` has one huge triangle and tiny ones in its middle. Spheres, quads and discs of a
//! file are left out.
//!
//! Bytes are those that the process allocates beyond what it held before, at the peak and
//! afterwards, per triangle. The cost is the total area of the inner nodes below the root, relative
//! to the root's area: the expected number of nodes that a line through the root's box visits. The
//! rays are 2^16 lines through the box of the triangles, and a diffuse ray from the hit of each.
#![allow(clippy::unwrap_used, reason = "a tool for the terminal")]

#[path = "../tests/counted/mod.rs"]
mod counted;

use counted::{Held, held};
use glam::Vec3;
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use trisect::bvh::{Bvh, BvhQuality, Wide};
use trisect::scene::Scene;
use trisect_shared::bvh::{Child, Corners, NO_PRIMITIVE, RayQuery};
use trisect_shared::features::{COUNTED, FeatureSet, Features, TRIANGLES, WIDE};
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::rng::PathKey;
use trisect_shared::scene as shared;
use trisect_shared::traversal::closest_hit_counted;
use trisect_shared::triangle::Triangle;

const RAYS: u32 = 1 << 16;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let what = arguments.next().ok_or("usage: trees FILE|bumpy|soup|huge [COUNT] [fast|medium|high]")?;
    let count = arguments.next().map_or(Ok(1 << 20), |text| text.parse())?;
    let quality = match arguments.next().as_deref() {
        None => None,
        Some("fast") => Some(BvhQuality::Fast),
        Some("medium") => Some(BvhQuality::Medium),
        Some("high") => Some(BvhQuality::High),
        Some(other) => return Err(format!("\"{other}\" is not fast, medium or high").into()),
    };
    let scene = match what.as_str() {
        "bumpy" => generated(bumpy(count)),
        "soup" => generated(soup(count)),
        "huge" => generated(huge(count)),
        file => Scene { spheres: Vec::new(), flats: Vec::new(), ..Scene::load(Path::new(file))? },
    };
    let triangles = scene.triangles.len();
    let (bvh, build) = measured(|| Bvh::build(&scene, quality));
    let (wide, collapse) = measured(|| Wide::new(&scene, bvh.as_ref().unwrap()));
    let (bvh, wide) = (bvh?, wide?.ok_or("more triangles than the wide BVH can index")?);
    println!("{what}: {triangles} triangles, {} levels", bvh.depth);
    for (name, (seconds, Held { peak, kept })) in [("binary BVH", build), ("wide BVH", collapse)] {
        let each = |bytes: usize| bytes as f64 / triangles as f64;
        println!(
            "{name:<10} {seconds:>7.2} s, peak {:>7.1} bytes a triangle, kept {:>6.1}",
            each(peak),
            each(kept)
        );
    }
    println!("cost {:.4}, as for refitting {:.4}", cost(&bvh), bvh.cost());
    visits(&scene.triangles, &bvh, &wide);
    Ok(())
}

/// Runs `what`. Returns what it made, the seconds that it took, and the bytes that it held.
fn measured<T>(what: impl FnOnce() -> T) -> (T, (f64, Held)) {
    let start = Instant::now();
    let (made, bytes) = held(what);
    (made, (start.elapsed().as_secs_f64(), bytes))
}

fn generated(triangles: Vec<Triangle>) -> Scene {
    let mut scene = Scene::hello_world().unwrap();
    (scene.spheres, scene.flats) = (Vec::new(), Vec::new());
    scene.vertices.push(bytemuck::Zeroable::zeroed());
    scene.triangles = triangles.into();
    scene
}

fn triangle(a: Vec3, b: Vec3, c: Vec3) -> Triangle {
    Triangle { a, b, c, ..bytemuck::Zeroable::zeroed() }
}

/// Returns three numbers in 0..1.
fn random(number: u32, what: u32) -> Vec3 {
    let w = PathKey { seed: 5, pixel: number, sample: 0 }.words(what);
    Vec3::new(unit_f32(w.x), unit_f32(w.y), unit_f32(w.z))
}

fn bumpy(count: u32) -> Vec<Triangle> {
    let side = f64::from(count / 2).sqrt() as u32;
    let at = |x: u32, z: u32| {
        let (x, z) = (x as f32 / side as f32, z as f32 / side as f32);
        let waves = (23.0 * x).sin() * (17.0 * z).cos() * 0.05 + (211.0 * x + 90.0 * z).sin() * 0.004;
        Vec3::new(x, waves + (1900.0 * x).sin() * (2300.0 * z).sin() * 0.0004, z)
    };
    let squares = (0..side).flat_map(|z| (0..side).map(move |x| (x, z)));
    squares
        .flat_map(|(x, z)| {
            let [a, b, c, d] = [at(x, z), at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)];
            [triangle(a, c, b), triangle(b, c, d)]
        })
        .collect()
}

fn soup(count: u32) -> Vec<Triangle> {
    let one = |i: u32| {
        let (center, along) = (random(i, 0), (random(i, 1) - 0.5) * 0.1);
        let across = (random(i, 2) - 0.5) * 0.001;
        triangle(center - along, center + along, center + across)
    };
    (0..count).map(one).collect()
}

fn huge(count: u32) -> Vec<Triangle> {
    let tiny = |i: u32| {
        let (corner, edges) = (random(i, 0), [1, 2].map(|what| (random(i, what) - 0.5) * 0.01));
        triangle(corner, corner + edges[0], corner + edges[1])
    };
    let large =
        triangle(Vec3::new(-20.0, 0.5, -20.0), Vec3::new(30.0, 0.6, -20.0), Vec3::new(0.0, 0.4, 30.0));
    std::iter::once(large).chain((1..count).map(tiny)).collect()
}

fn union(boxes: [Corners; 2]) -> Corners {
    let [a, b] = boxes;
    (a.0.min(b.0), a.1.max(b.1))
}

fn cost(bvh: &Bvh) -> f64 {
    let area = |(low, high): Corners| {
        let size = high.as_dvec3() - low.as_dvec3();
        size.x * size.y + size.y * size.z + size.z * size.x
    };
    let mut sum = 0.0;
    for node in bvh.inner_nodes() {
        for (child, corners) in [node.first, node.second].into_iter().zip(node.boxes()) {
            sum += if Child(child).is_leaf() { 0.0 } else { area(corners) };
        }
    }
    sum / bvh.nodes.first().map_or(1.0, |root| area(union(root.boxes())))
}

/// Prints the mean numbers of nodes and leaves that rays visit.
fn visits(triangles: &[Triangle], bvh: &Bvh, wide: &Wide) {
    let (low, high) = triangles.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), t| {
        (low.min(t.a).min(t.b).min(t.c), high.max(t.a).max(t.b).max(t.c))
    });
    // The middle half of the triangles' centres: a huge triangle does not draw the rays away.
    let center = |i: u32| {
        let t = &triangles[(i as usize * 7919) % triangles.len()];
        (t.a + t.b + t.c) / 3.0
    };
    let radius = (high - low).length();
    let mut next = Vec::new();
    let mut lines = Vec::new();
    for i in 0..RAYS {
        let key = PathKey { seed: 1, pixel: i, sample: 0 }.words(0);
        let target = center(i) + (random(i, 3) - 0.5) * 1e-3 * radius;
        let origin = target + unit_sphere(key.x, key.y) * radius;
        let ray = Ray::in_world(origin, normalize(target - origin), OriginPrimitive::NONE);
        lines.push(ray);
        let (hit, _) = trace::<{ TRIANGLES | COUNTED }>(triangles, bvh, wide, ray);
        if hit.0 != NO_PRIMITIVE {
            let mut normal = normalize(triangles[hit.0 as usize].normal());
            normal *= -normal.dot(ray.direction).signum();
            let origin = ray.origin + ray.direction * hit.1 + normal * (1e-4 * hit.1);
            let direction = normalize(normal + unit_sphere(key.z, key.w));
            next.push(Ray::in_world(origin, direction, OriginPrimitive::NONE));
        }
    }
    for (name, rays) in [("lines", &lines), ("diffuse", &next)] {
        let mut sums = [0u64; 4];
        for ray in rays {
            let (_, binary) = trace::<{ TRIANGLES | COUNTED }>(triangles, bvh, wide, *ray);
            let (_, of_wide) = trace::<{ TRIANGLES | COUNTED | WIDE }>(triangles, bvh, wide, *ray);
            for (sum, count) in sums.iter_mut().zip([binary.0, binary.1, of_wide.0, of_wide.1]) {
                *sum += u64::from(count);
            }
        }
        let [a, b, c, d] = sums.map(|sum| sum as f64 / rays.len().max(1) as f64);
        println!(
            "{name:<8} {:>7} rays; binary {a:>8.3} nodes {b:>7.3} leaves; wide {c:>7.3} {d:>7.3}",
            rays.len()
        );
    }
}

/// Returns primitive and distance of a ray's hit, and the nodes and leaves that it visits.
fn trace<const FEATURES: Features>(
    triangles: &[Triangle],
    bvh: &Bvh,
    wide: &Wide,
    ray: Ray,
) -> ((u32, f32), (u32, u32)) {
    let params = RenderParams { root: bvh.root.0, ..bytemuck::Zeroable::zeroed() };
    let arrays = shared::Scene {
        spheres: &[],
        nodes: &bvh.nodes,
        materials: &[],
        planars: &[],
        triangles,
        vertices: &[],
        lights: &[],
        textures: &[],
        texels: &[],
        environment: &[],
        wide: wide.tree(),
    };
    // SAFETY: `Bvh::build` and `Wide::new` validated the BVHs; no instruction set is named.
    #[allow(unsafe_code, reason = "kernels read without bounds checks")]
    let (hit, visits) =
        unsafe { closest_hit_counted(FeatureSet::<FEATURES>::ALL, &params, arrays, ray, RayQuery::CLOSEST) };
    ((hit.primitive, hit.distance), (visits.nodes, visits.leaves))
}
