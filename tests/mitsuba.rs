//! Images agree with those of an independent program, Mitsuba 3 (`tests/reference/mitsuba`), by
//! blocks of pixels and as a whole.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::path::PathBuf;
use trisect::image::Image;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_shared::material::{CONDUCTOR, ROUGH_DIELECTRIC};
use trisect_tests::renders::{cpu, film, lit};
use trisect_tests::statistics::{BLOCK, BlockTest, Blocks};

fn folder() -> PathBuf {
    let root = trisect_tests::root();
    let folders = [root.join("tests/reference/mitsuba"), root.join("reference/mitsuba")]; // the second in a bundle
    folders.into_iter().find(|folder| folder.exists()).expect("tests/reference/mitsuba")
}

/// Returns the reference's blocks. The pixels share the variance of their block evenly, which gives
/// the stored variance of the block and of the whole.
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

fn compare(scene: &Scene, reference: &Blocks, samples: u32) -> BlockTest {
    let settings = Settings { samples, seed: 3, ..scene.settings() };
    let film = film(&mut cpu(scene), &settings);
    assert_eq!(film.counts().rejected, 0);
    Blocks::new(&film).compare(reference, 1e-4)
}

/// Returns whether the difference is noise. `compare` allows a rounding of 1e-4: of f32 in the
/// reference's sums, and of the environment map's resampling.
fn agrees(test: &BlockTest) -> bool {
    test.passes()
}

/// A mutant of a scene, with its name.
type Mutant = (&'static str, fn(&mut Scene));

fn check(name: &str, samples: u32, faults: &[Mutant]) {
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
fn glass() {
    check("glass", 256, &[("rougher", rougher)]);
}
