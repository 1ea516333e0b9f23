//! The firewall: samples are finite, and those that are not are counted (3).

use glam::Vec3;
use trisect::film::FilmCounts;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::{film, independent, scene_files};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route, scene};

/// Renders a scene that `plant` has changed, and returns its counts and whether each pixel with a
/// sample is finite.
fn with_mutant(subject: BackendUnderTest, plant: impl Fn(&mut Scene)) -> Option<(FilmCounts, bool)> {
    let mut scene = scene("three_spheres.ron");
    plant(&mut scene);
    let settings = Settings { width: 12, height: 8, samples: 8, depth: 4, ..independent(&scene) };
    let film = film(&mut subject.renderer(&scene)?, &settings);
    let finite = film.pixels.iter().all(|p| p.samples == 0 || p.mean().iter().all(|m| m.is_finite()));
    Some((film.counts(), finite))
}

/// No sample of any scene is NaN or infinite before the firewall, which counts each one that is.
fn t03_nothing_is_caught(subject: BackendUnderTest) {
    let mut samples = 0;
    let files = scene_files();
    for path in &files {
        let scene = Scene::load(path).unwrap();
        let spp = if subject.is_software() { 2 } else { 64 };
        let settings = Settings { width: 16, height: 12, samples: spp, seed: 3, ..independent(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let counts = film(&mut renderer, &settings).counts();
        assert_eq!((counts.rejected, counts.unwritten), (0, 0), "{}", path.display());
        assert_eq!(counts.samples, settings.total_samples(), "{}", path.display());
        samples += counts.samples;
    }
    // Negative controls: one bad channel of a material's albedo, of the sky and of an emission.
    let bad = [f32::NAN, f32::INFINITY];
    for value in bad {
        let (counts, finite) =
            with_mutant(subject, |s| s.materials[1].albedo.y = value).expect("the backend opened before");
        assert!(counts.rejected > 0 && finite, "albedo {value}: {counts:?}");
        let (counts, finite) = with_mutant(subject, |s| s.sky.top.z = value).expect("opened before");
        assert!(counts.rejected > 0 && finite, "sky {value}: {counts:?}");
        let glow = |s: &mut Scene| s.materials[1].emission = Vec3::new(1.0, value, 1.0);
        let (counts, _) = with_mutant(subject, glow).expect("opened before");
        assert!(counts.rejected > 0, "emission {value}: {counts:?}");
    }
    let total = 12 * 8 * 8;
    // f32::MAX is finite, but its square and its sum with another are not: the sample is counted,
    // or the pixel is infinite.
    let firefly = |s: &mut Scene| s.materials[1].emission = Vec3::splat(f32::MAX);
    let (counts, finite) = with_mutant(subject, firefly).expect("opened before");
    assert!(counts.rejected > 0 || !finite, "an overflow is not detected: {counts:?}");
    let how = if counts.rejected > 0 { "counted" } else { "an infinite pixel" };
    let (counts, finite) = with_mutant(subject, |_| ()).expect("opened before");
    assert!(counts.rejected == 0 && counts.samples == total && finite);
    let figure = format!(
        "0 of {samples} samples of {} scenes; planted NaN and infinity are counted, f32::MAX is {how}",
        files.len()
    );
    report(3, subject, Outcome::Passed, &figure);
}

for_each_route!(t03_nothing_is_caught);
