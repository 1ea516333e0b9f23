//! Rounding errors of camera rays.

use super::{Random, described, found, spread};
use glam::DVec3;
use trisect::precision::Limit;
use trisect::render::Settings;
use trisect::scene::{CameraPose, Rebase, SceneDocument};
use trisect_shared::math::{unit_circle, unit_f32};
use trisect_shared::rng::PathKey;
use trisect_tests::renders::cpu;

/// Returns the errors of camera rays in pixels: of their directions, and of their origins across
/// the view.
fn ray_errors(scene: &SceneDocument) -> (f64, f64) {
    let pose: CameraPose = scene.description.cameras[0].1;
    let lowered = scene.clone().lower(Rebase::IDENTITY).unwrap();
    let settings = Settings::from(scene.image);
    let camera = cpu(&lowered).camera(&settings);
    let back = (pose.look_from - pose.look_at).normalize();
    let right = pose.up.cross(back).normalize();
    let up = back.cross(right);
    let focus = if pose.defocus_angle > 0.0 { pose.focus_distance } else { 1.0 };
    let (width, height) = (f64::from(settings.width), f64::from(settings.height));
    let pixel = 2.0 * (0.5 * pose.vertical_fov).tan() * focus / height;
    let lens = (0.5 * pose.defocus_angle).tan() * focus;
    let mut random = Random(6);
    let mut at = |size: u32| ((random.number() * f64::from(size)) as u32).min(size - 1);
    let (mut directions, mut origins) = (Vec::new(), Vec::new());
    for sample in 0..2000 {
        let (x, y) = (at(settings.width), at(settings.height));
        let words = PathKey { seed: 1, pixel: 0, sample }.words(0);
        let ray = camera.ray(x, y, words);
        let (cosine, sine) = unit_circle(words.w);
        let on_lens =
            (right * f64::from(cosine) + up * f64::from(sine)) * (lens * f64::from(unit_f32(words.z)).sqrt());
        let across = f64::from(x) + f64::from(unit_f32(words.x)) - 0.5 * width;
        let down = f64::from(y) + f64::from(unit_f32(words.y)) - 0.5 * height;
        let exact = (right * (across * pixel) - up * (down * pixel) - back * focus - on_lens).normalize();
        directions.push((ray.direction.as_dvec3() - exact).length() * focus / pixel);
        let aside = ray.origin.as_dvec3() - pose.look_from - on_lens;
        origins.push((aside - back * aside.dot(back)).length() / pixel);
    }
    (spread(directions).0, spread(origins).0)
}

fn view(camera: &str, height: u32) -> SceneDocument {
    let mut scene = described(&format!("camera: ({camera}), materials: {{}}, objects: []"));
    (scene.image.width, scene.image.height) = (height, height);
    scene
}

#[test]
fn pixels_narrower_than_directions() {
    for (fov, height, beyond) in
        [(40.0, 1080, false), (0.1, 1080, false), (0.01, 1080, true), (0.001, 1080, true)]
    {
        // The view is along no axis, because directions along one are finer than others.
        let scene =
            view(&format!("look_from: (1, 2, 3), look_at: (0.1, 0.3, 0.2), vertical_fov: {fov}"), height);
        let (measured, _) = ray_errors(&scene);
        match &found(&scene, Limit::NarrowView)[..] {
            [] => assert!(!beyond && measured < 0.1, "{fov}: {measured}"),
            [one] => {
                assert!(
                    beyond && (0.25..=4.0).contains(&(measured / one.predicted.value)),
                    "{measured} for {one}"
                );
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_lens_far_from_the_origin() {
    for (far, beyond) in [(10.0, false), (1e3, false), (1e5, true), (1e6, true)] {
        let eye = DVec3::new(far, 0.7 * far, 0.9 * far);
        let at = eye - DVec3::new(0.9, 1.7, 2.8);
        let [eye, at] = [eye, at].map(|v| (v.x, v.y, v.z));
        let camera = format!(
            "look_from: {eye:?}, look_at: {at:?}, vertical_fov: 40, defocus_angle: 1, focus_distance: 10"
        );
        let mut scene = view(&camera, 1080);
        let (_, measured) = ray_errors(&scene);
        match &found(&scene, Limit::FarLens)[..] {
            [] => assert!(!beyond && measured < 0.1, "{far}: {measured}"),
            [one] => {
                assert!(
                    beyond && (0.25..=4.0).contains(&(measured / one.predicted.value)),
                    "{measured} for {one}"
                );
            }
            other => panic!("{other:?}"),
        }
        // The remedy has no finding, and neither does a pinhole camera.
        scene.space.origin = DVec3::from(eye);
        assert_eq!(found(&scene, Limit::FarLens), []);
        assert_eq!(
            found(&view(&camera.replace("defocus_angle: 1", "defocus_angle: 0"), 1080), Limit::FarLens),
            []
        );
    }
}
