//! Measures closest hits per second on one thread for the triangles of a scene, with the traversals
//! of Trisect and of obvhs.
//!
//! ```text
//! cargo generate-scene mesh_ply scenes/generated/asteroid_500k.ply 158
//! cargo run --release -p trisect --example traversal -- scenes/generated/asteroid_500k.ply \
//!     [fast|medium|high] [FOLDER]
//! ```
//!
//! Rays: 2^20 primary rays of the scene's camera, row by row; a cosine-distributed ray from each of
//! their hits, in the same order; and those in random order.
//!
//! Each figure is the median of five rounds in which the traversals take turns. In its turn, a
//! traversal traces the rays twice, and the second time counts. Times are CPU times of the thread
//! where the system reports them (Linux), else wall-clock times. The visits are the nodes and
//! leaves of a ray in the binary BVH and in the wide one, and those of 32 rays in turn that wait
//! for each other, as the lanes of a GPU do. With a folder, the triangles and the rays are written
//! there instead, for `tests/reference/embree.cc`.
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
use std::sync::OnceLock;
use std::time::{Duration, Instant};
use trisect::bvh::{Bvh, BvhQuality, Wide};
use trisect::device::cpu::{Cpu, InstructionSet};
use trisect::render::Renderer;
use trisect::scene::Scene;
use trisect_shared::bvh::{Hit, NO_PRIMITIVE, RayQuery};
use trisect_shared::features::{self, COUNTED, FeatureSet, Features, TRIANGLES, WIDE};
use trisect_shared::math::{normalize, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::rng::PathKey;
use trisect_shared::scene as shared;
use trisect_shared::sphere::MISS;
use trisect_shared::traversal::{closest_hit, closest_hit_counted};
use trisect_shared::triangle::Triangle;

const SIDE: u32 = 1024;
const ROUNDS: usize = 5;

/// Number of hits, and the sum of their distances.
type Answer = (u32, f64);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().ok_or("usage: traversal SCENE [fast|medium|high] [FOLDER]")?;
    let (quality, preset) = match arguments.next().as_deref() {
        Some("fast") => (BvhQuality::Fast, BvhBuildParams::fast_build()),
        None | Some("medium") => (BvhQuality::Medium, BvhBuildParams::medium_build()),
        Some("high") => (BvhQuality::High, BvhBuildParams::very_slow_build()),
        Some(other) => return Err(format!("\"{other}\" is not fast, medium or high").into()),
    };
    let mut scene = Scene::load(Path::new(&file))?;
    scene.spheres.clear();
    scene.flats.clear();
    let settings =
        trisect::render::Settings { width: SIDE, height: SIDE, ..trisect::render::Settings::of(&scene) };
    let camera = Renderer::new(Cpu::open(Some(1))?, &scene)?.camera(&settings);
    let start = Instant::now();
    let bvh = Bvh::build(&scene, Some(quality))?;
    println!("{} triangles; built in {:.2} s", scene.triangles.len(), start.elapsed().as_secs_f64());

    let wide_bvh = Wide::new(&scene, &bvh)?.ok_or("more triangles than the wide BVH can index")?;
    println!("wide BVH after {:.2} s", start.elapsed().as_secs_f64());

    let mut params: RenderParams = bytemuck::Zeroable::zeroed();
    params.root = bvh.root.0;
    let arrays = shared::Scene {
        spheres: &[],
        nodes: &bvh.nodes,
        materials: &[],
        planars: &[],
        triangles: &scene.triangles,
        vertices: &[],
        lights: &[],
        textures: &[],
        texels: &[],
        environment: &[],
        wide: wide_bvh.tree(),
    };
    let mine = |ray: &Ray| -> Hit {
        // SAFETY: `Bvh::build` validated the BVH for these triangles.
        #[allow(unsafe_code, reason = "kernels read without bounds checks")]
        unsafe {
            closest_hit(FeatureSet::<TRIANGLES>::ALL, &params, arrays, *ray, RayQuery::CLOSEST)
        }
    };
    let sets = [InstructionSet::best(), InstructionSet::Avx2].map(|set| match set.is_available() {
        true => set,
        false => InstructionSet::Baseline,
    });

    let mut time = Duration::default();
    let triangles: Vec<ObvhsTriangle> = scene
        .triangles
        .iter()
        .map(|t| ObvhsTriangle { v0: Vec3A::from(t.a), v1: Vec3A::from(t.b), v2: Vec3A::from(t.c) })
        .collect();
    let binary = build_bvh2_from_tris(&triangles, preset, &mut time);
    let in_order =
        |order: &[u32]| -> Vec<ObvhsTriangle> { order.iter().map(|&i| triangles[i as usize]).collect() };
    let binary_triangles = in_order(&binary.primitive_indices);
    let obvhs_wide = build_cwbvh_from_tris(&triangles, preset, &mut time);
    let wide_triangles = in_order(&obvhs_wide.primitive_indices);
    let theirs = |ray: &Ray| ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, f32::MAX);

    let primary: Vec<Ray> = (0..SIDE * SIDE)
        .map(|pixel| {
            let key = PathKey { seed: 0, pixel, sample: 0 };
            camera.ray(pixel % SIDE, pixel / SIDE, key.words(0))
        })
        .collect();
    let mut diffuse = Vec::new();
    for (pixel, ray) in (0u32..).zip(&primary) {
        let Hit { distance, primitive, .. } = mine(ray);
        if primitive == NO_PRIMITIVE {
            continue;
        }
        let mut normal = normalize(scene.triangles[primitive as usize].normal());
        normal *= -normal.dot(ray.direction).signum();
        let w = PathKey { seed: 0, pixel, sample: 0 }.words(1);
        // Starts off the surface, because obvhs has no origin primitive that a ray ignores.
        let origin = ray.origin + ray.direction * distance + normal * (1e-4 * distance);
        let direction = normalize(normal + unit_sphere(w.x, w.y));
        diffuse.push(Ray::in_world(origin, direction, OriginPrimitive::NONE));
    }
    let mut shuffled: Vec<(u32, Ray)> = (0u32..)
        .zip(&diffuse)
        .map(|(i, ray)| (PathKey { seed: 1, pixel: i, sample: 0 }.words(0).x, *ray))
        .collect();
    shuffled.sort_unstable_by_key(|(key, _)| *key);
    let shuffled: Vec<Ray> = shuffled.into_iter().map(|(_, ray)| ray).collect();

    if let Some(folder) = arguments.next() {
        write(
            Path::new(&folder),
            &scene,
            &[("primary", &primary), ("diffuse", &diffuse), ("shuffled", &shuffled)],
        )?;
        return Ok(());
    }
    let [a, b] = sets.map(|set| format!("wide, {}", set.name()));
    println!(
        "{:<20} {a:>14} {b:>14} {:>14} {:>14} {:>14}   hits",
        "Mrays/s", "binary", "obvhs BVH2", "obvhs CWBVH"
    );
    for (name, rays) in [("primary", &primary), ("diffuse", &diffuse), ("diffuse, shuffled", &shuffled)] {
        let mut seconds: [Vec<f64>; 5] = Default::default();
        let mut answers: [Answer; 5] = [(0, 0.0); 5];
        for _ in 0..ROUNDS {
            for (i, set) in sets.into_iter().enumerate() {
                trace_wide(set, &params, arrays, rays);
                let start = now();
                answers[i] = trace_wide(set, &params, arrays, rays);
                seconds[i].push(now() - start);
            }
            (seconds[2], answers[2]) = round(&seconds[2], rays, |ray| mine(ray).distance);
            (seconds[3], answers[3]) = round(&seconds[3], rays, |ray| {
                let mut hit = RayHit::none();
                let tested = |ray: &ObvhsRay, i: usize| binary_triangles[i].intersect(ray);
                if binary.ray_traverse(theirs(ray), &mut hit, tested) { hit.t } else { MISS }
            });
            (seconds[4], answers[4]) = round(&seconds[4], rays, |ray| {
                let mut hit = RayHit::none();
                let tested = |ray: &ObvhsRay, i: usize| wide_triangles[i].intersect(ray);
                if obvhs_wide.ray_traverse(theirs(ray), &mut hit, tested) { hit.t } else { MISS }
            });
        }
        let rate = |seconds: &mut Vec<f64>| {
            seconds.sort_by(f64::total_cmp);
            rays.len() as f64 / seconds[ROUNDS / 2] * 1e-6
        };
        let [a, b, c, d, e] = seconds.each_mut().map(rate);
        let hits = answers.map(|(hits, _)| hits.to_string()).join(" ");
        println!("{name:<20} {a:>14.2} {b:>14.2} {c:>14.2} {d:>14.2} {e:>14.2}   {hits}");
        if answers[0] != answers[2] || answers[1] != answers[2] {
            return Err("the hits of the wide BVH differ from those of the binary one".into());
        }
    }
    println!(
        "\n{:<38} {:>12} {:>12} {:>16} {:>16}",
        "visits", "nodes", "leaves", "nodes of 32", "leaves of 32"
    );
    for (name, rays) in [("primary", &primary), ("diffuse", &diffuse), ("diffuse, shuffled", &shuffled)] {
        let binary = visits::<{ TRIANGLES | COUNTED }>(&params, arrays, rays);
        let wide = visits::<{ TRIANGLES | COUNTED | WIDE }>(&params, arrays, rays);
        for (tree, [nodes, leaves, slowest_nodes, slowest_leaves]) in [("binary", binary), ("wide", wide)] {
            let what = format!("{name}, {tree}");
            println!("{what:<38} {nodes:>12.2} {leaves:>12.2} {slowest_nodes:>16.2} {slowest_leaves:>16.2}");
        }
    }
    Ok(())
}

/// Returns the mean numbers of nodes and leaves that a ray visits, and the means of the greatest
/// numbers of 32 rays in turn.
fn visits<const FEATURES: Features>(params: &RenderParams, scene: shared::Scene, rays: &[Ray]) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for group in rays.chunks(32) {
        let mut slowest = [0.0f64; 2];
        for ray in group {
            // SAFETY: `Bvh::build` and `Wide::new` validated the BVHs; no instruction set is named.
            #[allow(unsafe_code, reason = "kernels read without bounds checks")]
            let (_, visits) = unsafe {
                closest_hit_counted(FeatureSet::<FEATURES>::ALL, params, scene, *ray, RayQuery::CLOSEST)
            };
            for (i, number) in [visits.nodes, visits.leaves].map(f64::from).into_iter().enumerate() {
                sums[i] += number;
                slowest[i] = slowest[i].max(number);
            }
        }
        sums[2] += slowest[0] * group.len() as f64;
        sums[3] += slowest[1] * group.len() as f64;
    }
    sums.map(|sum| sum / rays.len() as f64)
}

/// Returns the CPU time of this thread in seconds, or the wall-clock time since the first call if
/// the system does not report it.
fn now() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let times = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let run = times.split_whitespace().next().and_then(|nanoseconds| nanoseconds.parse::<f64>().ok());
    run.map_or_else(|| START.get_or_init(Instant::now).elapsed().as_secs_f64(), |run| run * 1e-9)
}

/// Traces all rays in the wide BVH with an instruction set that this processor has.
#[allow(unsafe_code, reason = "kernels read without bounds checks")]
fn trace_wide(set: InstructionSet, params: &RenderParams, scene: shared::Scene, rays: &[Ray]) -> Answer {
    /// # Safety
    ///
    /// The BVH was validated, and the processor has the instructions.
    #[inline(always)]
    unsafe fn all<const FEATURES: Features>(
        params: &RenderParams,
        scene: shared::Scene,
        rays: &[Ray],
    ) -> Answer {
        let mut answer = (0, 0.0);
        for ray in rays {
            // SAFETY: the caller's promise.
            let hit =
                unsafe { closest_hit(FeatureSet::<FEATURES>::ALL, params, scene, *ray, RayQuery::CLOSEST) };
            count(&mut answer, black_box(hit.distance));
        }
        answer
    }
    /// # Safety
    ///
    /// The requirements of `all`.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    unsafe fn avx2(params: &RenderParams, scene: shared::Scene, rays: &[Ray]) -> Answer {
        // SAFETY: the caller's promise.
        unsafe { all::<{ TRIANGLES | WIDE | features::AVX2 }>(params, scene, rays) }
    }
    /// # Safety
    ///
    /// The requirements of `all`.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
    unsafe fn avx512(params: &RenderParams, scene: shared::Scene, rays: &[Ray]) -> Answer {
        // SAFETY: the caller's promise.
        unsafe { all::<{ TRIANGLES | WIDE | features::AVX512 }>(params, scene, rays) }
    }
    // SAFETY: `Wide::new` validated the BVH, and `main` checked that the set is available.
    unsafe {
        match set {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => avx2(params, scene, rays),
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => avx512(params, scene, rays),
            _ => all::<{ TRIANGLES | WIDE }>(params, scene, rays),
        }
    }
}

fn count(answer: &mut Answer, distance: f32) {
    if distance < MISS {
        *answer = (answer.0 + 1, answer.1 + f64::from(distance));
    }
}

/// Writes the triangles (nine f32 each) and the rays (origin and direction) for other programs.
fn write(folder: &Path, scene: &Scene, sets: &[(&str, &[Ray])]) -> std::io::Result<()> {
    let bytes = |numbers: Vec<f32>| -> Vec<u8> { numbers.into_iter().flat_map(f32::to_le_bytes).collect() };
    let vertices = |t: &Triangle| [t.a, t.b, t.c].map(|v| v.to_array()).concat();
    std::fs::write(folder.join("triangles"), bytes(scene.triangles.iter().flat_map(vertices).collect()))?;
    for (name, rays) in sets {
        let numbers = rays.iter().flat_map(|ray| [ray.origin, ray.direction].map(|v| v.to_array()).concat());
        std::fs::write(folder.join(name), bytes(numbers.collect()))?;
    }
    Ok(())
}

fn round(seconds: &[f64], rays: &[Ray], hit: impl Fn(&Ray) -> f32) -> (Vec<f64>, Answer) {
    let mut answer = (0, 0.0);
    let mut start = 0.0;
    // The second time counts, when the caches hold what the first read.
    for _ in 0..2 {
        answer = (0, 0.0);
        start = now();
        for ray in rays {
            count(&mut answer, black_box(hit(ray)));
        }
    }
    let seconds = seconds.iter().copied().chain([now() - start]).collect();
    (seconds, answer)
}
