//! The clear sky with its sun: a diffuse plane receives the irradiance of the sky.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use std::f64::consts::PI;
use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::{film, independent};
use trisect_tests::{BackendUnderTest, for_each_backend};

/// A white plane under a sky, seen from straight above.
fn plane(sky: &str) -> Scene {
    let text = format!(
        "Scene(version: 1, image: (width: 15, height: 9, samples: 64, depth: 2), sky: {sky}, \
         camera: (look_from: (0, 2, 0), look_at: (0, 0, 0), up: (0, 0, -1), vertical_fov: 20), \
         materials: {{\"white\": Lambertian(albedo: (1, 1, 1))}}, \
         objects: [Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"white\")])"
    );
    Scene::parse(&text, "plane").unwrap()
}

/// Returns the irradiance, by channel, of a surface that faces upward: the integral over the
/// texels above the horizon, each with the solid angle of its place.
fn irradiance(scene: &Scene) -> [f64; 3] {
    let environment = scene.environment.as_ref().unwrap();
    let (width, height) = (environment.width as usize, environment.height as usize);
    // Eight rows for each of texels, interpolated; sums over the centres of columns are exact.
    const PARTS: usize = 8;
    let step = PI / (PARTS * height) as f64;
    let mut sum = [0.0; 3];
    for part in 0..PARTS * height / 2 {
        let place = (part as f64 + 0.5) / PARTS as f64 - 0.5;
        let (low, t) = (place.floor(), place - place.floor());
        let row = |row: f64| (row.max(0.0) as usize) * width;
        let polar = (part as f64 + 0.5) * step;
        let weight = polar.sin() * polar.cos() * step * 2.0 * PI / width as f64;
        for x in 0..width {
            let [above, below] = [row(low), row(low + 1.0)].map(|row| environment.texels[row + x].radiance);
            for (c, sum) in sum.iter_mut().enumerate() {
                *sum += weight * (f64::from(above[c]) * (1.0 - t) + f64::from(below[c]) * t);
            }
        }
    }
    sum
}

/// Returns the largest difference of the film's mean from a radiance, relative to it, and in sigma.
fn difference(film: &Film, want: [f64; 3]) -> (f64, f64) {
    let count = film.pixels.len() as f64;
    let mut most = (0f64, 0f64);
    for (c, want) in want.into_iter().enumerate() {
        let mean = film.pixels.iter().map(|pixel| pixel.mean()[c]).sum::<f64>() / count;
        let variance = film.pixels.iter().map(|pixel| pixel.variance_of_mean()[c]).sum::<f64>();
        let off = (mean - want).abs();
        most = (most.0.max(off / want), most.1.max(off * count / variance.sqrt()));
    }
    most
}

fn a_plane_has_the_irradiance_of_the_sky(subject: BackendUnderTest) {
    for sky in [
        "Sun(elevation: 35, azimuth: 120)",
        "Sun(elevation: 90, turbidity: 2)",
        "Sun(direction: (-1, 0.1, 0.3), turbidity: 6, ground_albedo: 0)",
        "Sun(elevation: 35, sun_disc: false)",
    ] {
        let scene = plane(sky);
        let samples = if subject == BackendUnderTest::Cpu { 2048 } else { 64 };
        let settings = Settings { samples, ..independent(&scene) };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let film = film(&mut renderer, &settings);
        let radiance = irradiance(&scene).map(|irradiance| irradiance / PI);
        let (relative, sigma) = difference(&film, radiance);
        eprintln!("{sky}: {relative} {sigma}");
        assert!(sigma < 4.5 || relative < 1e-4, "{sky}: {relative} {sigma}");
        if subject == BackendUnderTest::Cpu {
            assert!(relative < 5e-3, "{sky}: {relative}");
            // Negative control: a sky that is 1 % brighter.
            let (_, sigma) = difference(&film, radiance.map(|radiance| 1.01 * radiance));
            assert!(sigma > 4.5, "{sky}: negative control not detected: {sigma}");
        }
    }
}

for_each_backend!(a_plane_has_the_irradiance_of_the_sky);

/// The place of the sun may be given by angles or by a direction, and `scale` is a factor.
#[test]
fn the_same_sky_in_other_words() {
    let texels = |sky: &str| plane(sky).environment.unwrap();
    let angles = texels("Sun(elevation: 45, azimuth: 90)");
    let direction = texels("Sun(direction: (2, 2, 0))");
    assert_eq!(angles.rotation, direction.rotation);
    let most = angles.texels.iter().zip(direction.texels.iter());
    let most = most.map(|(a, b)| (a.radiance - b.radiance).abs().max_element() / a.radiance.max_element());
    assert!(most.fold(0.0, f32::max) < 1e-3);
    let doubled = texels("Sun(elevation: 45, azimuth: 90, scale: 2)");
    for (one, two) in angles.texels.iter().zip(doubled.texels.iter()) {
        assert_eq!(two.radiance, 2.0 * one.radiance);
    }
}
