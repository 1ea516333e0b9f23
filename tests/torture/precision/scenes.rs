//! The supported ranges of the project's own scenes.

use super::{RELATIVE, found};
use glam::DVec3;
use trisect::precision::{Limit, Supported, check};
use trisect::render::Settings;
use trisect::scene::{Rebase, SceneDocument};
use trisect_tests::renders::{cpu, differing, film, independent, scene_files};
use trisect_tests::root;
use trisect_tests::statistics::Blocks;

#[test]
fn no_scene_of_the_project_is_outside() {
    let files = scene_files();
    assert!(files.len() >= 12);
    for path in files {
        let scene = SceneDocument::load(&path).unwrap();
        let report = check(&scene, &scene.image);
        assert!(report.findings.is_empty(), "{}: {:#?}", path.display(), report.findings);
        assert!(report.extent.radius > 0.0);
        // Negative control: scenes moved by 10⁷ times their radius are out of range.
        let far = Rebase { origin: DVec3::splat(-1e7 * report.extent.radius), scale: 1.0 };
        let moved = SceneDocument { space: far, ..scene };
        let shapes = &moved.description.shapes;
        if shapes.iter().any(|shape| !shape.kind.is_plane()) || !moved.description.instances.is_empty() {
            assert!(!found(&moved, Limit::FarFromOrigin).is_empty(), "{}", path.display());
        }
    }
}

/// In the best space each scene has the same image within noise: only few paths change, as the new
/// places round differently.
#[test]
fn the_best_space_shows_the_same() {
    for path in scene_files() {
        if path.ends_with("mesh.ron") {
            continue; // its BVH takes seconds
        }
        let scene = SceneDocument::load(&path).unwrap();
        let best = check(&scene, &scene.image).best_space;
        let render = |space| {
            let lowered = scene.clone().lower(space).unwrap();
            let settings = Settings { width: 16, height: 12, samples: 16, ..independent(&lowered) };
            film(&mut cpu(&lowered), &settings)
        };
        let (want, got) = (render(Rebase::IDENTITY), render(best));
        if best.origin == DVec3::ZERO {
            assert_eq!(differing(&got, &want), 0, "{}", path.display());
        }
        let test = Blocks::new(&got).compare(&Blocks::new(&want), 1e-5);
        assert!(test.passes(), "{}: {test:?}", path.display());
    }
}

/// A scene whose small shapes the best scale would lose keeps its own scale.
#[test]
fn a_scale_that_loses_something_is_not_the_best() {
    let spheres = |small: &str| {
        super::grey(&format!(
            "Sphere(center: (0, 0, 0), radius: 1e15, material: \"grey\"), Sphere(center: (0, 0, 0), radius: {small}, \
             material: \"grey\"), Sphere(center: (1e15, 0, 0), radius: 1e15, material: \"grey\")"
        ))
    };
    let best = |scene: &SceneDocument| check(scene, &scene.image).best_space;
    assert_eq!(best(&spheres("1e14")), Rebase { origin: DVec3::ZERO, scale: 2f64.powi(-50) });
    assert_eq!(best(&spheres("1e-6")), Rebase::IDENTITY);
}

/// The ground of the book's scene, of radius 1000 under an eye at height 2, is within the limit by
/// a factor of 30.
#[test]
fn the_books_ground_is_within() {
    let mut scene = SceneDocument::load(&root().join("scenes/rtiow_final.ron")).unwrap();
    assert_eq!(found(&scene, Limit::NearSurface), []);
    scene.description.cameras[0].1.look_from = DVec3::new(0.0, 0.05, 4.0);
    let [ground] = &found(&scene, Limit::NearSurface)[..] else { panic!() };
    assert_eq!(ground.what, "objects[0], a sphere of \"diffuse-000\"");
    let Supported::AtLeast(height) = ground.supported else { panic!() };
    assert!((height / 0.0596 - 1.0).abs() < 1e-2 && ground.predicted.value > RELATIVE, "{ground}");
}
