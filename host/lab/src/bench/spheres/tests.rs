#![allow(clippy::unwrap_used, reason = "this is how a test fails")]

use super::*;
use trisect::device::cpu::Cpu;
use trisect::render::{Renderer, Settings};
use trisect::scene::Rebase;

fn spheres(scene: &SceneDocument) -> Vec<(DVec3, f64, usize)> {
    let shapes = scene.description.shapes.iter();
    let sphere = |shape: &Shape| match shape.kind {
        ShapeKind::Sphere { center, radius } => Some((center, radius, shape.material)),
        _ => None,
    };
    shapes.filter_map(sphere).collect()
}

/// Returns the share of the book's square that small spheres cover, seen from above.
fn cover(scene: &SceneDocument) -> f64 {
    let small = spheres(scene).into_iter().filter(|(_, _, material)| *material >= 4);
    small.map(|(_, radius, _)| std::f64::consts::PI * radius * radius).sum::<f64>()
        / (2.0 * HALF_SIDE).powi(2)
}

#[test]
fn any_number_twice_the_same() {
    for count in [1, 2, 4, 5, 10, 100, 487, 1000, 10_000] {
        let (scene, again) = (sphere_scene(count).unwrap(), sphere_scene(count).unwrap());
        assert_eq!(spheres(&scene).len(), count as usize);
        assert_eq!(scene.description.shapes, again.description.shapes);
        assert_eq!(scene.description.materials, again.description.materials);
    }
    for count in [0, MAX_COUNT + 1] {
        assert!(matches!(sphere_scene(count), Err(BenchError::SphereCount { .. })));
    }
}

/// The coordinates come from integer and basic f64 operations and square roots, so they are equal
/// on all machines. The scene of a published figure can be made again.
#[test]
fn a_known_scene() {
    let scene = sphere_scene(487).unwrap();
    let mut sum = 0u64;
    for (center, radius, material) in spheres(&scene) {
        for value in [center.x, center.y, center.z, radius, material as f64] {
            sum = sum.rotate_left(5) ^ value.to_bits();
        }
    }
    assert_eq!(sum, 0xfae6_d5c2_1662_64ce, "{sum:#x}");
}

/// No sphere floats or sinks, intersects a large one, or leaves the square.
#[test]
fn they_stand_on_the_ground() {
    for count in [10, 1000] {
        let scene = sphere_scene(count).unwrap();
        let all = spheres(&scene);
        for &(center, radius, _) in &all[1..] {
            let gap = center.distance(all[0].0) - GROUND - radius;
            // f64 near 1000 has steps of 2^-44; a few roundings add up.
            assert!(gap.abs() < 1e-11, "{gap:e}");
            assert!(center.x.abs() <= HALF_SIDE && center.z.abs() <= HALF_SIDE);
        }
        for large in &all[1..4] {
            assert!(all[4..].iter().all(|small| small.0.distance(large.0) > small.1 + large.1));
        }
        // Negative control: a sphere that floats by a hundredth of its radius is found.
        let (center, radius, _) = all[4];
        assert!(((center + 0.01 * radius * DVec3::Y).distance(all[0].0) - GROUND - radius).abs() > 1e-11);
    }
}

/// Small spheres cover about the same share of the ground for each count: π 0.2² of full cells. A
/// cell in 20 may be left out, and with few spheres the large ones displace more.
#[test]
fn the_picture_stays_alike() {
    let full = std::f64::consts::PI * 0.04;
    let alike = |share: f64| share > 0.9 * full && share < 1.0001 * full;
    for count in [100, 1000, 10_000, 100_000] {
        let share = cover(&sphere_scene(count).unwrap());
        assert!(alike(share), "{count}: {share} of {full}");
    }
    // Negative control: spheres of the same size would cover ten times as much in the next scene.
    assert!(!alike(10.0 * cover(&sphere_scene(1000).unwrap())));
}

#[test]
fn they_render() {
    for count in [1, 3, 50] {
        let scene = sphere_scene(count).unwrap().lower(Rebase::IDENTITY).unwrap();
        let settings = Settings { width: 16, height: 9, samples: 1, ..Settings::of(&scene) };
        let mut renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let frame = renderer.render(&settings).unwrap();
        assert!(frame.stats.warnings().is_empty() && scene.warnings.is_empty());
        assert!(frame.film.image().pixels.iter().flatten().all(|value| (0.0..=1.0).contains(value)));
    }
}
