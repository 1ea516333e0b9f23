//! Closest hits a second on one thread: this program's traversal beside obvhs's own, on the triangles of a scene.
//!
//! ```text
//! cargo run --release --example mesh_ply -- scenes/generated/asteroid_500k.ply 158
//! cargo run --release --example traversal -- scenes/generated/asteroid_500k.ply [fast|medium|high]
//! ```
//!
//! Rays: 2^20 primary ones of the scene's camera, row by row, then a cosine-distributed one from each of their hits, in the same
//! order, and those in random order. Each figure is the median of five rounds, in which the three traversals take turns.
#![allow(clippy::unwrap_used, reason = "a tool for the terminal")]

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle as ObvhsTriangle;
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use trisect::backend::cpu::Cpu;
use trisect::bvh::{Bvh, BvhQuality};
use trisect::render::Renderer;
use trisect::scene::Scene;
use trisect_shared::bvh::{NO_PRIMITIVE, Reach, closest_hit};
use trisect_shared::features::TRIANGLES;
use trisect_shared::math::{normalize, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::ray::{Departure, Ray};
use trisect_shared::rng::PathKey;
use trisect_shared::scene as shared;
use trisect_shared::sphere::MISS;

const SIDE: u32 = 1024;
const ROUNDS: usize = 5;

/// Number of hits, and sum of their distances.
type Answer = (u32, f64);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("usage: traversal SCENE [fast|medium|high]")?;
    let (quality, preset) = match arguments.next().as_deref() {
        Some("fast") => (BvhQuality::Fast, BvhBuildParams::fast_build()),
        None | Some("medium") => (BvhQuality::Medium, BvhBuildParams::medium_build()),
        Some("high") => (BvhQuality::High, BvhBuildParams::very_slow_build()),
        Some(other) => return Err(format!("\"{other}\" is not fast, medium or high").into()),
    };
    let mut scene = Scene::load(Path::new(&file))?;
    scene.spheres.clear();
    scene.flats.clear();
    let settings = trisect::render::Settings { width: SIDE, height: SIDE, ..scene.settings() };
    let camera = Renderer::new(Box::new(Cpu::open(Some(1))?), &scene)?.camera(&settings);
    let start = Instant::now();
    let bvh = Bvh::build(&scene, Some(quality))?;
    println!("{} triangles; built in {:.2} s", bvh.triangles.len(), start.elapsed().as_secs_f64());

    let mine = |ray: &Ray| -> (u32, f32) {
        let mut params: RenderParams = bytemuck::Zeroable::zeroed();
        params.root = bvh.root.0;
        let arrays = shared::Scene {
            spheres: &[],
            nodes: &bvh.nodes,
            materials: &[],
            flats: &[],
            triangles: &bvh.triangles,
            shading: &[],
            lights: &[],
            textures: &[],
            texels: &[],
            environment: &[],
        };
        // SAFETY: `Bvh::build` proved the tree for these triangles.
        #[allow(unsafe_code, reason = "kernels read without bounds checks")]
        let hit = unsafe { closest_hit::<TRIANGLES>(&params, arrays, *ray, Reach::CLOSEST) };
        (hit.primitive, hit.distance)
    };

    let mut time = Duration::default();
    let triangles: Vec<ObvhsTriangle> = bvh
        .triangles
        .iter()
        .map(|t| ObvhsTriangle { v0: Vec3A::from(t.a), v1: Vec3A::from(t.b), v2: Vec3A::from(t.c) })
        .collect();
    let binary = build_bvh2_from_tris(&triangles, preset, &mut time);
    let in_order =
        |order: &[u32]| -> Vec<ObvhsTriangle> { order.iter().map(|&i| triangles[i as usize]).collect() };
    let binary_triangles = in_order(&binary.primitive_indices);
    let wide = build_cwbvh_from_tris(&triangles, preset, &mut time);
    let wide_triangles = in_order(&wide.primitive_indices);
    let theirs = |ray: &Ray| ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, f32::MAX);

    let primary: Vec<Ray> = (0..SIDE * SIDE)
        .map(|pixel| {
            let key = PathKey { seed: 0, pixel, sample: 0 };
            camera.ray(pixel % SIDE, pixel / SIDE, key.words(0))
        })
        .collect();
    let mut diffuse = Vec::new();
    for (pixel, ray) in (0u32..).zip(&primary) {
        let (primitive, distance) = mine(ray);
        if primitive == NO_PRIMITIVE {
            continue;
        }
        let mut normal = normalize(bvh.triangles[primitive as usize].normal());
        normal *= -normal.dot(ray.direction).signum();
        let w = PathKey { seed: 0, pixel, sample: 0 }.words(1);
        // Off the surface, as obvhs knows no departure.
        let origin = ray.origin + ray.direction * distance + normal * (1e-4 * distance);
        let direction = normalize(normal + unit_sphere(w.x, w.y));
        diffuse.push(Ray { origin, direction, departure: Departure::NONE });
    }
    let mut shuffled: Vec<(u32, Ray)> = (0u32..)
        .zip(&diffuse)
        .map(|(i, ray)| (PathKey { seed: 1, pixel: i, sample: 0 }.words(0).x, *ray))
        .collect();
    shuffled.sort_unstable_by_key(|(key, _)| *key);
    let shuffled: Vec<Ray> = shuffled.into_iter().map(|(_, ray)| ray).collect();

    println!("{:<20} {:>10} {:>12} {:>14}   hits", "Mrays/s", "Trisect", "obvhs BVH2", "obvhs CWBVH");
    for (name, rays) in [("primary", &primary), ("diffuse", &diffuse), ("diffuse, shuffled", &shuffled)] {
        let mut seconds: [Vec<f64>; 3] = Default::default();
        let mut answers: [Answer; 3] = [(0, 0.0); 3];
        for _ in 0..ROUNDS {
            (seconds[0], answers[0]) = round(&seconds[0], rays, |ray| {
                let (primitive, distance) = mine(ray);
                if primitive == NO_PRIMITIVE { MISS } else { distance }
            });
            (seconds[1], answers[1]) = round(&seconds[1], rays, |ray| {
                let mut hit = RayHit::none();
                let tested = |ray: &ObvhsRay, i: usize| binary_triangles[i].intersect(ray);
                if binary.ray_traverse(theirs(ray), &mut hit, tested) { hit.t } else { MISS }
            });
            (seconds[2], answers[2]) = round(&seconds[2], rays, |ray| {
                let mut hit = RayHit::none();
                let tested = |ray: &ObvhsRay, i: usize| wide_triangles[i].intersect(ray);
                if wide.ray_traverse(theirs(ray), &mut hit, tested) { hit.t } else { MISS }
            });
        }
        let rate = |seconds: &mut Vec<f64>| {
            seconds.sort_by(f64::total_cmp);
            rays.len() as f64 / seconds[ROUNDS / 2] * 1e-6
        };
        let [a, b, c] = &mut seconds;
        let hits = answers.map(|(hits, _)| hits.to_string()).join(" ");
        println!("{name:<20} {:>10.2} {:>12.2} {:>14.2}   {hits}", rate(a), rate(b), rate(c));
    }
    Ok(())
}

fn round(seconds: &[f64], rays: &[Ray], hit: impl Fn(&Ray) -> f32) -> (Vec<f64>, Answer) {
    let start = Instant::now();
    let mut answer = (0, 0.0);
    for ray in rays {
        let distance = black_box(hit(ray));
        if distance < MISS {
            answer = (answer.0 + 1, answer.1 + f64::from(distance));
        }
    }
    let seconds = seconds.iter().copied().chain([start.elapsed().as_secs_f64()]).collect();
    (seconds, answer)
}
