//! Parallel projections: what is seen has its size, whatever its distance.
#![allow(clippy::unwrap_used, clippy::panic, reason = "this is how a test fails")]

use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::{cpu, differing, film};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// Returns a black square of edge 2 before a white sky, `away` from a camera, askew.
fn scene(view: &str, away: f64) -> Scene {
    let text = format!(
        r#"Scene(version: 1, image: (width: 60, height: 40, samples: 16, depth: 2),
        camera: (look_from: (3, 4, 5), look_at: (3, 4, 0), {view}), sky: Uniform(radiance: (1, 1, 1)),
        materials: {{ "black": Lambertian(albedo: (0, 0, 0)) }},
        objects: [Quad(corner: (2.5, 3.2, {z}), u: (2, 0, 0), v: (0, 2, 0), material: "black")])"#,
        z = 5.0 - away
    );
    Scene::parse(&text, "parallel").unwrap()
}

/// A square covers its share of a view of height 4: 4 of 24 units of area, in the same pixels near
/// and far. In a perspective it does not.
fn a_square_has_its_size(subject: BackendUnderTest) {
    let near = scene("height: 4", 0.5);
    let Some(mut renderer) = subject.renderer(&near) else { return };
    let settings = Settings::of(&near);
    let got = film(&mut renderer, &settings);
    let dark = |film: &trisect::film::Film| {
        let light: f64 = film.pixels.iter().map(|pixel| pixel.mean()[0]).sum();
        1.0 - light / film.pixels.len() as f64
    };
    // Pixels of a tenth: each edge of the square lies between pixels.
    assert!((dark(&got) - 4.0 / 24.0).abs() < 1e-6, "{}", dark(&got));
    let far = film(&mut subject.renderer(&scene("height: 4", 50.0)).unwrap(), &settings);
    assert_eq!(differing(&got, &far), 0);
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        assert_eq!(differing(&got, &film(&mut cpu(&near), &settings)), 0);
    }
    // Negative control: a perspective.
    let wide = film(&mut subject.renderer(&scene("vertical_fov: 40", 50.0)).unwrap(), &settings);
    assert!((dark(&wide) - 4.0 / 24.0).abs() > 0.1, "negative control not detected");
}

for_each_backend!(a_square_has_its_size);
