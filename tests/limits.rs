//! What a scene may be: other spaces show the same image, and `trisect check` says what is true.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use glam::DVec3;
use std::path::Path;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::{Scene, Space};
use trisect_tests::renders::{cpu, differing, film, scene_files};

/// Torture test 8's reading of a film: the sums alone, since a count of segments may differ where a tie of two boxes is broken.
fn small(scene: &Scene) -> Film {
    let settings = Settings { width: 24, height: 16, samples: 4, seed: 3, ..scene.settings() };
    film(&mut cpu(scene), &settings)
}

fn scaled(path: &Path, exponent: i32) -> Scene {
    Scene::load_in(path, Space { origin: DVec3::ZERO, scale: 2f64.powi(exponent) }).unwrap()
}

/// A power of two rounds nothing: every product and sum scales with it, and every ratio stays.
#[test]
fn a_power_of_two_keeps_each_bit() {
    for path in scene_files() {
        let want = small(&scaled(&path, 0));
        for exponent in [-20, -3, 20] {
            let got = small(&scaled(&path, exponent));
            assert_eq!(differing(&got, &want), 0, "{} times 2^{exponent}", path.display());
        }
    }
}
