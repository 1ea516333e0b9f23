//! One source for three targets gives one image. CUDA has the CPU's bits. wgpu has the same hits,
//! except at counted edges, and the same radiance within noise. Each comparison has a negative
//! control.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::{Film, PixelTotals};
use trisect::render::{Fresnel, Settings};
use trisect::scene::Scene;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::camera::Camera;
use trisect_shared::path::FirstHit;
use trisect_shared::ray::Ray;
use trisect_shared::rng::PathKey;
use trisect_tests::renders::{brighter, cpu, differing, film, independent};
use trisect_tests::statistics::{GLOBAL_LIMIT, ZTest};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// Precise CUDA has the CPU's bits: sums, squares, counts and segments of each pixel.
#[test]
fn cuda_gives_the_cpus_bits() {
    let scene = scene("rtiow_final.ron");
    let Some(mut cuda) = BackendUnderTest::Cuda.renderer(&scene) else { return };
    let mut cpu = cpu(&scene);
    for seed in [1, 2] {
        for roulette in [true, false] {
            let settings =
                Settings { width: 1200, height: 675, samples: 16, seed, roulette, ..independent(&scene) };
            let want = film(&mut cpu, &settings);
            assert_eq!(differing(&film(&mut cuda, &settings), &want), 0, "seed {seed}, roulette {roulette}");
            if seed == 1 && !roulette {
                let hits = (cuda.first_hits(&settings, 3).unwrap(), cpu.first_hits(&settings, 3).unwrap());
                assert!(hits.0 == hits.1, "first hits");
                // Negative control: the last bit of one sphere's radius.
                let mut faulty = scene.clone();
                faulty.spheres[0].radius = faulty.spheres[0].radius.next_up();
                let faulty = film(&mut BackendUnderTest::Cuda.renderer(&faulty).unwrap(), &settings);
                assert_ne!(differing(&faulty, &want), 0, "negative control not detected");
            }
        }
    }
}

/// With exact Fresnel equations, on a scene of three spheres, each backend agrees with the CPU. The
/// book's scene has Schlick's approximation.
fn exact_fresnel_agrees(subject: BackendUnderTest) {
    let scene = scene("three_spheres.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 64, height: 36, samples: 4, ..independent(&scene) };
    let want = film(&mut cpu(&scene), &settings);
    let agrees = |got: &Film| {
        if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
            return differing(got, &want) == 0;
        }
        // Equal random numbers give almost the same paths; a few differ at an edge after an ULP of
        // difference.
        let near =
            |(a, b): &(PixelTotals, PixelTotals)| (0..3).all(|c| (a.mean()[c] - b.mean()[c]).abs() < 1e-3);
        let close = got.pixels.iter().zip(&want.pixels).filter(near).count();
        close as f64 >= 0.98 * want.pixels.len() as f64
    };
    assert!(agrees(&film(&mut renderer, &settings)));
    // Negative control: Schlick's approximation.
    let schlick = Settings { fresnel: Fresnel::Schlick, ..settings };
    assert!(!agrees(&film(&mut renderer, &schlick)), "negative control not detected");
}

/// Maximum distance from an edge, relative to the coordinates' size, of a ray whose first hit may
/// differ between two backends. The direction of a camera ray is off by a few units of 2^-24 per
/// component where division is off by 2.5 ULP (Vulkan's rule). The point where the ray passes a
/// sphere is off by that times the distance, which the size in [`is_edge`] includes.
const EDGE: f64 = 64.0 * f32::EPSILON as f64;

/// Returns whether the ray passes so near the edge of one of the two primitives that rounding
/// decides. Distances are computed in f64.
fn is_edge(scene: &Scene, hits: [&FirstHit; 2], ray: &Ray) -> bool {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
    hits.iter().any(|hit| {
        let Some(sphere) = scene.spheres.get(hit.primitive as usize) else { return false };
        let f = o - sphere.center.as_dvec3();
        let from_line = (f - d * f.dot(d)).length();
        let size = f.length() + o.length() + f64::from(sphere.radius);
        (from_line - f64::from(sphere.radius)).abs() < EDGE * size
    }) || {
        // Rounding also decides where both are hit at almost the same distance: where two spheres
        // cross.
        (hits[0].distance - hits[1].distance).abs() < EDGE as f32 * (1.0 + hits[0].distance)
    }
}

/// Returns the maximum change of a hit's distance by rounding. The discriminant is a difference of
/// numbers as large as |f|² + r², for the vector f from the centre to the ray's origin. An error of
/// a few of their roundings (four: Vulkan's division and square root are within 2.5 and 3 ULP)
/// moves the root by that error over twice the root, which is r times the cosine of incidence. The
/// change is large on the book's ground sphere near the horizon.
fn distance_limit(scene: &Scene, hit: &FirstHit, settings: &Settings, camera: &Camera, pixel: usize) -> f64 {
    let sphere = &scene.spheres[hit.primitive as usize];
    let ray = camera_ray(camera, settings, pixel);
    let f = (ray.origin - sphere.center).as_dvec3();
    let radius = f64::from(sphere.radius);
    let cosine = f64::from(ray.direction.dot(hit.normal).abs()).max(1e-3);
    4.0 * f64::from(f32::EPSILON) * (f.length_squared() + radius * radius) / (2.0 * radius * cosine)
}

/// Returns the camera ray of sample 0 of a pixel.
fn camera_ray(camera: &Camera, settings: &Settings, pixel: usize) -> Ray {
    let key = PathKey { seed: settings.seed, pixel: pixel as u32, sample: 0 };
    camera.ray(pixel as u32 % settings.width, pixel as u32 / settings.width, key.words(0))
}

/// First hits differ in few pixels, which are counted, and each is at an edge.
fn first_hits_agree(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 400, height: 225, seed: 7, ..independent(&scene) };
    let want = cpu(&scene).first_hits(&settings, 0).unwrap();
    let got = renderer.first_hits(&settings, 0).unwrap();
    let camera = renderer.camera(&settings);
    let mut edges = 0;
    for (pixel, (a, b)) in got.iter().zip(&want).enumerate() {
        if a.primitive != b.primitive {
            let ray = camera_ray(&camera, &settings, pixel);
            assert!(is_edge(&scene, [a, b], &ray), "pixel {pixel}: {a:?} for {b:?} is no edge");
            edges += 1;
        } else if a.primitive != NO_PRIMITIVE {
            let limit = distance_limit(&scene, b, &settings, &camera, pixel);
            assert!(f64::from((a.distance - b.distance).abs()) < limit, "pixel {pixel}: {a:?} for {b:?}");
            let radius = f64::from(scene.spheres[a.primitive as usize].radius);
            let turned = f64::from((a.normal - b.normal).length());
            assert!(turned < 2.0 * limit / radius + 1e-6, "pixel {pixel}: {a:?} for {b:?}");
        }
    }
    eprintln!("{subject:?}: {edges} of {} first hits differ, all at edges", want.len());
    // At most 0.01 %, the bound of torture test 20.
    assert!(edges * 10_000 <= want.len(), "{edges}");
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        assert_eq!(got, want);
    }

    // Negative control: a sphere that is moved by its radius gives more differences than the bound
    // allows.
    let mut faulty = scene.clone();
    faulty.spheres[486].center.x += faulty.spheres[486].radius;
    let Some(mut renderer) = subject.renderer(&faulty) else { return };
    let got = renderer.first_hits(&settings, 0).unwrap();
    let elsewhere = got.iter().zip(&want).filter(|(a, b)| a.primitive != b.primitive).count();
    assert!(elsewhere * 10_000 > want.len(), "negative control not detected: {elsewhere}");
}

/// First hits are right by double precision, without another backend to compare with: the nearest
/// sphere, its distance and its outward normal.
fn first_hits_are_the_nearest(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 200, height: 112, seed: 8, ..independent(&scene) };
    let hits = renderer.first_hits(&settings, 0).unwrap();
    let camera = renderer.camera(&settings);
    let wrong = |hits: &[FirstHit]| {
        let is_wrong = |&(pixel, hit): &(usize, &FirstHit)| {
            let ray = camera_ray(&camera, &settings, pixel);
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
            let meets = |index: usize| {
                let sphere = &scene.spheres[index];
                let (f, r) = (o - sphere.center.as_dvec3(), f64::from(sphere.radius));
                let b = -f.dot(d);
                let root = (r * r - (f + d * b).length_squared()).sqrt(); // NaN if it passes by
                let t = if b - root > 0.0 { b - root } else { b + root };
                (t > 0.0).then_some((t, index))
            };
            let nearest = (0..scene.spheres.len()).filter_map(meets).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((t, index)) = nearest else { return hit.primitive != NO_PRIMITIVE };
            if hit.primitive as usize != index {
                return true;
            }
            let limit = distance_limit(&scene, hit, &settings, &camera, pixel);
            let sphere = &scene.spheres[index];
            let normal = (o + d * t - sphere.center.as_dvec3()) / f64::from(sphere.radius);
            let turned = (hit.normal.as_dvec3() - normal).length();
            (f64::from(hit.distance) - t).abs() > limit
                || turned > 2.0 * limit / f64::from(sphere.radius) + 1e-6
        };
        hits.iter().enumerate().filter(is_wrong).count()
    };
    let count = wrong(&hits);
    eprintln!("{subject:?}: {count} of {} first hits are wrong", hits.len());
    // Some rays pass an edge within rounding: as many as `first_hits_agree` allows.
    assert!(count * 10_000 <= hits.len(), "{count}");
    // Negative controls: flipped normals; other spheres.
    let mut flipped = hits.clone();
    flipped.iter_mut().for_each(|hit| hit.normal = -hit.normal);
    assert!(wrong(&flipped) * 2 > hits.len(), "negative control not detected");
    let mut others = hits;
    others.iter_mut().for_each(|hit| hit.primitive ^= 1);
    assert!(wrong(&others) * 2 > others.len(), "negative control not detected");
}

/// Radiance from different seeds differs by noise only; 1 % more albedo is detected.
fn radiance_is_the_same_within_noise(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 128, height: 72, samples: 256, seed: 11, ..independent(&scene) };
    let want = film(&mut cpu(&scene), &Settings { seed: 12, ..settings.clone() });
    let test = ZTest::new(&film(&mut renderer, &settings), &want);
    eprintln!("{subject:?}: {test:?}");
    assert!(test.passes(), "{test:?}");

    let faulty = brighter(&scene);
    let Some(mut renderer) = subject.renderer(&faulty) else { return };
    let test = ZTest::new(&film(&mut renderer, &settings), &want);
    assert!(!test.passes(), "negative control not detected: {test:?}");
}

/// Russian roulette changes the noise, not the mean.
fn roulette_keeps_the_mean(subject: BackendUnderTest) {
    let scene = scene("rtiow_final.ron");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 96, height: 54, samples: 128, seed: 21, ..independent(&scene) };
    let without = film(&mut renderer, &settings);
    let roulette = Settings { seed: 22, roulette: true, ..settings };
    let with = film(&mut renderer, &roulette);
    let test = ZTest::new(&with, &without);
    assert!(test.global.iter().all(|z| z.abs() < GLOBAL_LIMIT), "{test:?}");
    // Negative control: 5 % less albedo, which changes the mean.
    let mut faulty = scene.clone();
    faulty.materials.iter_mut().for_each(|material| material.albedo *= 0.95);
    let Some(mut renderer) = subject.renderer(&faulty) else { return };
    let test = ZTest::new(&film(&mut renderer, &roulette), &without);
    assert!(test.global.iter().any(|z| z.abs() > GLOBAL_LIMIT), "negative control not detected: {test:?}");
    let (with, without) = (with.counts().segments, without.counts().segments);
    assert!(with * 10 < without * 9, "roulette ends paths: {with} segments of {without}");
}

for_each_route!(
    exact_fresnel_agrees,
    first_hits_agree,
    first_hits_are_the_nearest,
    radiance_is_the_same_within_noise,
    roulette_keeps_the_mean,
);

/// The fast build gives another image, but only by rounding: the same within noise.
#[test]
fn fast_math_is_the_same_within_noise() {
    let scene = scene("rtiow_final.ron");
    let Some(mut cuda) = BackendUnderTest::Cuda.renderer(&scene) else { return };
    let settings = Settings { width: 160, height: 90, samples: 128, seed: 31, ..independent(&scene) };
    let precise = film(&mut cuda, &settings);
    let fast = Settings { math: trisect::render::MathMode::Fast, ..settings };
    assert_ne!(differing(&film(&mut cuda, &fast), &precise), 0, "fast math is the precise build");
    let fast = Settings { seed: 32, ..fast };
    let test = ZTest::new(&film(&mut cuda, &fast), &precise);
    assert!(test.passes(), "{test:?}");
    let Some(mut cuda) = BackendUnderTest::Cuda.renderer(&brighter(&scene)) else { return };
    let test = ZTest::new(&film(&mut cuda, &fast), &precise);
    assert!(!test.passes(), "negative control not detected: {test:?}");
}
