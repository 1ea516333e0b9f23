//! What is true of the project's own scenes.

use super::{RELATIVE, found};
use glam::DVec3;
use trisect::limits::{Limit, Supported, check};
use trisect::scene::{Described, Space};
use trisect_tests::renders::scene_files;
use trisect_tests::root;

#[test]
fn no_scene_of_the_project_is_outside() {
    let files = scene_files();
    assert!(files.len() >= 12);
    for path in files {
        let scene = Described::load(&path).unwrap();
        let report = check(&scene, &scene.settings());
        assert!(report.findings.is_empty(), "{}: {:#?}", path.display(), report.findings);
        assert!(report.extent.radius > 0.0 && report.summary().is_empty());
        // The twin: a millionfold of itself away, all of it is.
        let far = Space { origin: DVec3::splat(-1e7 * report.extent.radius), scale: 1.0 };
        let moved = Described { space: far, ..scene };
        let shapes = &moved.description.shapes;
        if shapes.iter().any(|shape| !shape.kind.is_plane()) || !moved.description.instances.is_empty() {
            assert!(!found(&moved, Limit::FarFromOrigin).is_empty(), "{}", path.display());
        }
    }
}

/// The ground of the book's scene, radius 1000 under an eye at height 2, is within the limit, by a factor of 30.
#[test]
fn the_books_ground_is_within() {
    let mut scene = Described::load(&root().join("scenes/rtiow_final.ron")).unwrap();
    assert_eq!(found(&scene, Limit::NearSurface), []);
    scene.description.cameras[0].1.look_from = DVec3::new(0.0, 0.05, 4.0);
    let [ground] = &found(&scene, Limit::NearSurface)[..] else { panic!() };
    assert_eq!(ground.what, "objects[0], a sphere of \"ground\"");
    let Supported::AtLeast(height) = ground.supported else { panic!() };
    assert!((height / 0.0596 - 1.0).abs() < 1e-2 && ground.predicted.value > RELATIVE, "{ground}");
}
