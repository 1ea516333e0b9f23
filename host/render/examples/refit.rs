//! Measures what a refitted BVH saves and costs against one that is built anew, for a model at
//! times of its animation.
//!
//! ```text
//! cargo run --release -p trisect --example refit -- MODEL SECONDS [fast|medium|high]
//! ```
//!
//! The BVH is built at time 0 and refitted to eight times up to SECONDS. Each line of the first
//! table has the wall clock of describing the scene, of refitting, of building, and of collapsing
//! the refitted BVH for the CPU; the cost of the refitted BVH relative to that at time 0; and the
//! nodes and leaves that a ray of the camera, and a ray that is reflected diffusely, visit in the
//! refitted BVH and in the built one.
//!
//! The second table is of 48 frames up to SECONDS. A BVH is built where the refitted one exceeds a
//! bound of the cost; the bound 0 builds each.
#![allow(clippy::unwrap_used, reason = "a tool for the terminal")]

use std::error::Error;
use std::time::Instant;
use trisect::bvh::{Bvh, BvhQuality, Wide};
use trisect::device::cpu::Cpu;
use trisect::render::{Renderer, Settings};
use trisect::scene::{AnimatedScene, LoadOptions, Scene, Sharing};
use trisect_shared::bvh::{NO_PRIMITIVE, RayQuery};
use trisect_shared::features::{COUNTED, FeatureSet, TRIANGLES};
use trisect_shared::math::{normalize, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::rng::PathKey;
use trisect_shared::scene as shared;
use trisect_shared::traversal::closest_hit_counted;

const SIDE: u32 = 256;
const TIMES: u32 = 8;
const FRAMES: u32 = 48;
const BOUNDS: [f64; 8] = [0.0, 1.05, 1.1, 1.2, 1.3, 1.5, 2.0, f64::INFINITY];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let usage = "usage: refit MODEL SECONDS [fast|medium|high]";
    let (file, seconds) = (arguments.next().ok_or(usage)?, arguments.next().ok_or(usage)?);
    let seconds: f64 = seconds.parse()?;
    let quality = match arguments.next().as_deref() {
        Some("fast") => Some(BvhQuality::Fast),
        Some("medium") => Some(BvhQuality::Medium),
        Some("high") => Some(BvhQuality::High),
        _ => None,
    };
    let mut animated = AnimatedScene::load(file.as_ref(), &LoadOptions::default())?;
    animated.sharing = Sharing::Never;
    let document = animated.document(0.0)?;
    let start = animated.lower(document)?;
    let first = Bvh::build(&start, quality)?;
    println!("{} triangles", start.triangles.len());
    println!(
        "{:>7} {:>11} {:>8} {:>8} {:>8} {:>6}   visits per ray, refitted / built: camera, diffuse",
        "time", "describe ms", "refit", "build", "wide", "cost"
    );
    for step in 1..=TIMES {
        let time = seconds * f64::from(step) / f64::from(TIMES);
        let now = Instant::now();
        let document = animated.document(time)?;
        let scene = animated.lower(document)?;
        let described = now.elapsed().as_secs_f64() * 1e3;
        let copy = first.clone();
        let now = Instant::now();
        let refitted = copy.moved(&scene)?.ok_or("the number of triangles changes")?;
        let refit = now.elapsed().as_secs_f64() * 1e3;
        let now = Instant::now();
        let built = Bvh::build(&scene, quality)?;
        let build = now.elapsed().as_secs_f64() * 1e3;
        let now = Instant::now();
        let wide = Wide::new(&scene, &refitted)?;
        let collapse = now.elapsed().as_secs_f64() * 1e3;
        drop(wide);
        let [of_refitted, of_built] = [&refitted, &built].map(|bvh| visits(&scene, bvh));
        println!(
            "{time:>7.3} {described:>11.1} {refit:>8.2} {build:>8.1} {collapse:>8.1} {:>6.2}   {:>5.1} / {:>4.1} {:>7.1} / {:>4.1}",
            refitted.cost() / first.cost(),
            of_refitted[0],
            of_built[0],
            of_refitted[1],
            of_built[1]
        );
    }
    let times: Vec<f64> = (0..FRAMES).map(|frame| seconds * f64::from(frame) / f64::from(FRAMES)).collect();
    let mut scenes = Vec::new();
    for &time in &times {
        let document = animated.document(time)?;
        scenes.push(animated.lower(document)?);
    }
    println!("\n{:>7} {:>6} {:>10} {:>20}", "bound", "built", "trees, ms", "visits of a diffuse ray");
    for bound in BOUNDS {
        let (mut tree, mut cost) = (first.clone(), first.cost());
        let (mut built, mut took, mut sum) = (0, 0.0, 0.0);
        for scene in &scenes {
            let now = Instant::now();
            let moved = tree.moved(scene)?.filter(|moved| moved.cost() <= bound * cost);
            tree = match moved {
                Some(moved) => moved,
                None => {
                    built += 1;
                    let new = Bvh::build(scene, quality)?;
                    cost = new.cost();
                    new
                }
            };
            took += now.elapsed().as_secs_f64() * 1e3;
            sum += visits(scene, &tree)[1];
        }
        println!("{bound:>7} {built:>6} {took:>10.0} {:>20.1}", sum / f64::from(FRAMES));
    }
    Ok(())
}

/// Returns the mean number of nodes and leaves that rays of the camera, and rays from their hits,
/// visit.
fn visits(scene: &Scene, bvh: &Bvh) -> [f64; 2] {
    let settings = Settings::of(scene).size(SIDE, SIDE);
    let camera = Renderer::new(Cpu::open(None).unwrap(), scene).unwrap().camera(&settings);
    let params = RenderParams { root: bvh.root.0, ..bytemuck::Zeroable::zeroed() };
    let wide = Wide::new(scene, bvh).unwrap().unwrap();
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
        wide: wide.tree(),
    };
    let (mut next, mut sums, mut counts) = (Vec::new(), [0u64; 2], [0u64; 2]);
    let trace = |ray: Ray| {
        // SAFETY: `Bvh::build` validated the BVH, and refitting keeps its nodes.
        #[allow(unsafe_code, reason = "kernels read without bounds checks")]
        unsafe {
            closest_hit_counted(
                FeatureSet::<{ TRIANGLES | COUNTED }>::ALL,
                &params,
                arrays,
                ray,
                RayQuery::CLOSEST,
            )
        }
    };
    for pixel in 0..SIDE * SIDE {
        let key = PathKey { seed: 0, pixel, sample: 0 };
        let ray = camera.ray(pixel % SIDE, pixel / SIDE, key.words(0));
        let (hit, visits) = trace(ray);
        sums[0] += u64::from(visits.nodes) + u64::from(visits.leaves);
        counts[0] += 1;
        if hit.primitive == NO_PRIMITIVE {
            continue;
        }
        let mut normal = normalize(scene.triangles[hit.primitive as usize].normal());
        normal *= -normal.dot(ray.direction).signum();
        let origin = ray.origin + ray.direction * hit.distance + normal * (1e-4 * hit.distance);
        let words = key.words(1);
        let direction = normalize(normal + unit_sphere(words.x, words.y));
        next.push(Ray::in_world(origin, direction, OriginPrimitive::NONE));
    }
    for ray in next {
        let (_, visits) = trace(ray);
        sums[1] += u64::from(visits.nodes) + u64::from(visits.leaves);
        counts[1] += 1;
    }
    [0, 1].map(|of| sums[of] as f64 / counts[of].max(1) as f64)
}
