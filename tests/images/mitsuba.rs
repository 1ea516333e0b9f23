//! Compares renders of the CPU with images of Mitsuba 3 (`tests/reference/mitsuba`), by blocks of
//! 8 x 8 pixels and as a whole. Each scene has negative controls, which must be detected.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::PathBuf;
use trisect::image::Image;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_shared::bsdf::{CONDUCTOR, ROUGH_DIELECTRIC};
use trisect_tests::renders::{cpu, film, independent, lit};
use trisect_tests::statistics::{BLOCK, BlockTest, Blocks};

fn folder() -> PathBuf {
    let root = trisect_tests::root();
    let folders = [root.join("tests/reference/mitsuba"), root.join("reference/mitsuba")]; // the second in a bundle
    folders.into_iter().find(|folder| folder.exists()).expect("tests/reference/mitsuba")
}

/// Reads the reference: `NAME.pfm`, and the standard error of each block's mean from
/// `NAME.error.pfm`. Each of a block's n pixels gets n times the block's variance, so that
/// [`Blocks`] computes the stored variance again.
fn reference(name: &str) -> Blocks {
    let read = |name: String| Image::read(&folder().join(name)).unwrap();
    let (mean, error) = (read(format!("{name}.pfm")), read(format!("{name}.error.pfm")));
    let pixel = |i: u32| {
        let (x, y) = (i % mean.width, i / mean.width);
        let side = |at: u32, size: u32| f64::from((size - at / BLOCK * BLOCK).min(BLOCK));
        let n = side(x, mean.width) * side(y, mean.height);
        let e = error.pixels[(y / BLOCK * error.width + x / BLOCK) as usize];
        (mean.pixels[i as usize].map(f64::from), e.map(|e| f64::from(e).powi(2) * n))
    };
    Blocks::of(mean.width, mean.height, (0..mean.width * mean.height).map(pixel).collect())
}

fn scene(name: &str) -> Scene {
    Scene::load(&folder().join(name).with_extension("ron")).unwrap()
}

/// Renders a scene and compares it with the reference. A relative difference of 1e-4 is allowed,
/// for f32 sums in the reference and the resampling of environment maps.
fn compare(scene: &Scene, reference: &Blocks, samples: u32) -> BlockTest {
    let settings = Settings { samples, seed: 3, ..independent(scene) };
    let film = film(&mut cpu(scene), &settings);
    assert_eq!(film.counts().rejected, 0);
    Blocks::new(&film).compare(reference, 1e-4)
}

/// Returns whether the difference is noise.
fn agrees(test: &BlockTest) -> bool {
    test.passes()
}

/// Negative control: the name of a fault, and the function that puts it into a scene.
type Fault = (&'static str, fn(&mut Scene));

fn check(name: &str, samples: u32, faults: &[Fault]) {
    let (good, reference) = (scene(name), reference(name));
    let test = compare(&good, &reference, samples);
    eprintln!("{name}: {test:?}");
    assert!(agrees(&test), "{name}: {test:?}");
    for (fault, plant) in faults {
        let mut scene = good.clone();
        plant(&mut scene);
        let test = compare(&scene, &reference, samples);
        eprintln!("{name}, {fault}: {test:?}");
        assert!(!agrees(&test), "{name}, {fault} went unnoticed: {test:?}");
    }
}

/// Makes all light 1 % brighter.
fn brighter(scene: &mut Scene) {
    *scene = lit(scene, 1.01);
}

fn rougher(scene: &mut Scene) {
    let rough = |kind| kind == CONDUCTOR || kind == ROUGH_DIELECTRIC;
    scene.materials.iter_mut().filter(|m| rough(m.kind)).for_each(|m| m.roughness *= 1.1);
}

#[test]
fn diffuse_surfaces() {
    check("cornell_box", 256, &[("1 % brighter", brighter)]);
}

#[test]
fn lights_of_each_shape() {
    check("lights", 128, &[("1 % brighter", brighter)]);
}

#[test]
fn light_sampling_on_rough_plates() {
    check("veach_mis", 128, &[("rougher", rougher)]);
}

#[test]
fn metals() {
    let swapped: fn(&mut Scene) = |scene| {
        scene.materials.iter_mut().for_each(|m| (m.eta, m.k) = (m.k, m.eta));
    };
    check("metals", 128, &[("rougher", rougher), ("swapped index", swapped)]);
}

#[test]
fn media() {
    let even: fn(&mut Scene) = |scene| {
        scene.media.iter_mut().for_each(|medium| medium.anisotropy = 0.0);
    };
    let thinner: fn(&mut Scene) = |scene| {
        scene.media.iter_mut().for_each(|medium| medium.extinction *= 0.95);
    };
    check("media", 1024, &[("1 % brighter", brighter), ("even scattering", even), ("thinner", thinner)]);
}

#[test]
fn glass() {
    check("glass", 256, &[("rougher", rougher)]);
}
