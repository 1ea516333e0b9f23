//! Spaces: other origins and units of length.

use glam::DVec3;
use std::path::{Path, PathBuf};
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::{Includes, Rebase, Scene, SceneDocument};
use trisect_tests::renders::{cpu, differing, film, independent, scene_files};
use trisect_tests::root;

fn small(scene: &Scene) -> Film {
    let settings = Settings { width: 24, height: 16, samples: 4, seed: 3, ..independent(scene) };
    film(&mut cpu(scene), &settings)
}

/// Returns the project's scene files without the large mesh, which takes seconds each time.
fn files() -> Vec<PathBuf> {
    let mut files = scene_files();
    files.retain(|path| !path.ends_with("mesh.ron"));
    files
}

fn scaled(path: &Path, exponent: i32) -> Scene {
    Scene::load_in(path, Rebase { origin: DVec3::ZERO, scale: 2f64.powi(exponent) }).unwrap()
}

/// A power of two rounds nothing: each product and sum scales with it, and each ratio stays.
#[test]
fn a_power_of_two_keeps_each_bit() {
    for path in files() {
        let want = small(&scaled(&path, 0));
        for exponent in [-20, -3, 20] {
            let got = small(&scaled(&path, exponent));
            assert_eq!(differing(&got, &want), 0, "{} times 2^{exponent}", path.display());
        }
    }
    // Negative control: another factor rounds.
    let path = root().join("scenes/cornell_box.ron");
    let third = Scene::load_in(&path, Rebase { origin: DVec3::ZERO, scale: 1.0 / 3.0 }).unwrap();
    assert!(differing(&small(&third), &small(&scaled(&path, 0))) > 0, "negative control not detected");
}

/// Returns a scene with everything that has a place, moved by `by` along x and z and by -`by` along
/// y. Each number is a sum that f64 holds exactly.
fn moved(by: i64, space: &str) -> String {
    let at =
        |x: f64, y: f64, z: f64| format!("({:?}, {:?}, {:?})", x + by as f64, y - by as f64, z + by as f64);
    format!(
        "Scene(version: 1, {space} image: (width: 8, height: 8), camera: (look_from: {}, look_at: {}, vertical_fov: 40, \
         defocus_angle: 1, focus_distance: 4),
         materials: {{ \"grey\": Lambertian(albedo: (0.5, 0.5, 0.5)), \"glass\": Dielectric(ior: 1.5), \
         \"lamp\": Emissive(radiance: (4, 4, 4)) }},
         objects: [Sphere(center: {}, radius: 0.5, material: \"glass\"), Plane(point: {}, normal: (0, 1, 0), material: \"grey\"),
             Quad(corner: {}, u: (1, 0, 0), v: (0, 0, 1), material: \"lamp\"),
             Disc(center: {}, normal: (0, 0, 1), radius: 0.75, material: \"grey\"),
             Box(min: (0, 0, 0), max: (0.5, 0.5, 0.5), transform: [RotateY(30), Translate({})], material: \"grey\"),
             Mesh(file: \"{}\", transform: [Scale(0.25), Translate({})])],
         lights: [Point(position: {}, intensity: (1, 2, 3)), Directional(direction: (0, -1, 0), irradiance: (0.5, 0.5, 0.5)),
             Spot(position: {}, direction: (0, -1, 0), intensity: (9, 9, 9))])",
        at(0.0, 1.0, 4.0), at(0.0, 0.5, 0.0), at(0.0, 0.5, 0.0), at(0.0, 0.0, 0.0), at(-0.5, 2.0, -0.5), at(0.0, 0.5, -1.0),
        at(0.75, 0.0, 0.25), root().join("scenes/gltf/features.gltf").display(), at(-1.5, 0.0, -1.0), at(1.0, 1.5, 1.0),
        at(-1.0, 2.0, 0.5),
    )
}

fn parsed(text: &str) -> Film {
    small(&parsed_in(text, Rebase::IDENTITY))
}

fn parsed_in(text: &str, space: Rebase) -> Scene {
    let described = SceneDocument::parse_including(text, "moved.ron", Includes::Anywhere).unwrap();
    described.lower(space).unwrap()
}

#[test]
fn recentring_restores_the_image() {
    let want = parsed(&moved(0, ""));
    let far = 1_000_000;
    let space = "space: (origin: (1e6, -1e6, 1e6), scale: 0.0625),";
    assert_eq!(differing(&parsed(&moved(far, space)), &want), 0);
    let by = Rebase { origin: DVec3::new(1e6, -1e6, 1e6), scale: 4.0 };
    assert_eq!(differing(&small(&parsed_in(&moved(far, ""), by)), &want), 0);
    // Negative control: without a space, rounding is visible.
    assert!(differing(&parsed(&moved(far, "")), &want) > 200);
}

/// Negative control of scaling: the intensity of a light that does not follow its distance changes
/// the image.
#[test]
fn the_intensity_of_lights_must_scale() {
    let path = trisect_tests::scene_path("light_punctual.ron");
    let want = small(&scaled(&path, 0));
    let mut wrong = scaled(&path, 3);
    assert_eq!(differing(&small(&wrong), &want), 0);
    let sum = |film: &Film| film.pixels.iter().map(|pixel| pixel.mean()[0]).sum::<f64>();
    for light in wrong.lights.iter_mut().filter(|light| light.kind == trisect_shared::light::POINT) {
        light.intensity *= 0.125;
    }
    assert!(sum(&small(&wrong)) < 0.5 * sum(&want), "negative control not detected");
}

#[test]
fn a_space_beyond_all_numbers_is_an_error() {
    let scene = || SceneDocument::hello_world().unwrap();
    for (origin, scale, word) in
        [(DVec3::NAN, 1.0, "origin"), (DVec3::ZERO, 0.0, "scale"), (DVec3::ZERO, 1e18, "1e18")]
    {
        let error = scene().lower(Rebase { origin, scale }).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("three_spheres"), "{error}");
    }
}
