//! Scenes at other scales and places (8, 29, 42).

use glam::DVec3;
use std::path::Path;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::{Scene, Space};
use trisect_shared::path::FirstHit;
use trisect_tests::renders::{differing, film, scene_files};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{Subject, for_each_backend, root};

fn is_software(subject: Subject) -> bool {
    matches!(subject, Subject::Wgpu | Subject::WgpuNaga)
}

fn scaled(path: &Path, k: i32) -> Scene {
    Scene::load_in(path, Space { origin: DVec3::ZERO, scale: 2f64.powi(k) }).unwrap()
}

/// Pixels that differ from the unscaled image, and how far the means are off relative to the greatest.
fn changes(subject: Subject, settings: &Settings, scene: &Scene, want: &Film) -> Option<usize> {
    Some(differing(&film(&mut subject.renderer(scene)?, settings), want))
}

/// A scene times 2^k has the same image, bit by bit: each operation but division's and square root's ends scales exactly.
fn t08_scaled_by_powers_of_two(subject: Subject) {
    let all: Vec<i32> = (-20..=20).filter(|&k| k != 0).collect();
    let some = [-20, -13, -7, -1, 1, 7, 13, 20];
    let mut images = 0;
    let mut faults: Vec<String> = Vec::new();
    for path in scene_files() {
        let name = path.file_name().unwrap().display().to_string();
        let cheap = ["three_spheres.ron", "furnace.ron"].contains(&name.as_str());
        let steps: &[i32] = if cheap && !is_software(subject) {
            &all
        } else if is_software(subject) && !cheap {
            &[-20, 20]
        } else {
            &some
        };
        let scene = Scene::load(&path).unwrap();
        let (width, height) = if is_software(subject) { (12, 8) } else { (32, 24) };
        let samples = if is_software(subject) { 2 } else { 8 };
        let settings = Settings { width, height, samples, seed: 8, ..scene.settings() };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let want = film(&mut renderer, &settings);
        for &k in steps {
            let changed = changes(subject, &settings, &scaled(&path, k), &want).unwrap();
            images += 1;
            if changed > 0 {
                faults.push(format!("{name} times 2^{k}: {changed} of {} pixels", want.pixels.len()));
            }
        }
    }
    for fault in &faults { eprintln!("{fault}"); }
    assert!(faults.is_empty());
    report(8, subject, Outcome::Passed, &format!("{images} images of scenes times 2^k: the same bits"));
}

for_each_backend!(t08_scaled_by_powers_of_two);
