//! The scene files have the content that they claim.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::render::Fresnel;
use trisect::render::Settings;
use trisect_shared::bsdf::{DIELECTRIC, LAMBERTIAN, METAL};
use trisect_tests::{root, scene};

/// `rtiow_final.ron` has exactly the spheres and the camera that the book's program printed.
#[test]
fn the_books_scene_is_the_books() {
    let text = std::fs::read_to_string(root().join("scenes/source/rtiow_final.json")).unwrap();
    let book: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let triple = |value: &serde_json::Value| [0, 1, 2].map(|i| number(&value[i]));
    let scene = scene("rtiow_final.ron");

    let spheres = book["spheres"].as_array().unwrap();
    assert_eq!((spheres.len(), scene.spheres.len()), (487, 487));
    for (want, got) in spheres.iter().zip(&scene.spheres) {
        assert_eq!(triple(&want["center"]).map(|x| x as f32), got.center.to_array());
        assert_eq!(number(&want["radius"]) as f32, got.radius);
        let material = &scene.materials[got.material as usize];
        match want["material"].as_str().unwrap() {
            "diffuse" => assert_eq!(material.kind, LAMBERTIAN),
            "metal" => assert_eq!((material.kind, material.fuzz), (METAL, number(&want["fuzz"]) as f32)),
            "dielectric" => {
                assert_eq!((material.kind, material.ior), (DIELECTRIC, number(&want["ior"]) as f32));
                assert_eq!(material.albedo, glam::Vec3::ONE);
                continue;
            }
            other => panic!("{other}"),
        }
        assert_eq!(triple(&want["albedo"]).map(|x| x as f32), material.albedo.to_array());
    }

    let (want, got) = (&book["camera"], &scene.camera);
    assert_eq!(triple(&want["lookfrom"]), got.look_from.to_array());
    assert_eq!(triple(&want["lookat"]), got.look_at.to_array());
    assert_eq!(triple(&want["vup"]), got.up.to_array());
    assert_eq!(number(&want["vfov_deg"]).to_radians(), got.vertical_fov);
    assert_eq!(number(&want["defocus_angle_deg"]).to_radians(), got.defocus_angle);
    assert_eq!(number(&want["focus_dist"]), got.focus_distance);
    let settings = Settings::of(&scene);
    assert_eq!(settings.fresnel, Fresnel::Schlick);
    assert_eq!((settings.width, settings.height, settings.depth), (400, 225, 50));
    assert_eq!(triple(&book["sky"]["bottom"]).map(|x| x as f32), scene.sky.bottom.to_array());
    assert_eq!(triple(&book["sky"]["top"]).map(|x| x as f32), scene.sky.top.to_array());
}

/// Every scene of the folder loads and renders to a finite image.
#[test]
fn every_scene_renders() {
    let mut count = 0;
    for path in trisect_tests::renders::scene_files() {
        let scene = trisect::scene::Scene::load(&path).unwrap();
        let settings = Settings { width: 32, height: 18, samples: 2, ..Settings::of(&scene) };
        let mut renderer = trisect_tests::BackendUnderTest::Cpu.renderer(&scene).unwrap();
        let film = renderer.render(&settings).unwrap().film;
        assert_eq!(film.counts().samples, 32 * 18 * 2, "{}", path.display());
        count += 1;
    }
    assert!(count >= 12);
}
