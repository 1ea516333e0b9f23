//! Radiance against the film's range, in tiny renders.

use super::{Random, described, found};
use glam::DVec3;
use trisect::film::PixelTotals;
use trisect::precision::{Limit, Unit};
use trisect::render::Settings;
use trisect::scene::{Rebase, SceneDocument};
use trisect_tests::renders::{cpu, film, independent, lit};

/// Renders a pixel that sees nothing but a light, with `samples` samples. A light that is too
/// bright for a scene is made so in the records.
fn pixel(scene: &SceneDocument, samples: u32) -> PixelTotals {
    let mut scene = scene.clone();
    let is_beyond = scene.description.materials[0].emission.max_element() > 1e18;
    let factor = if is_beyond { 100f32.exp2() } else { 1.0 };
    scene.description.materials[0].emission /= f64::from(factor);
    let lowered = lit(&scene.lower(Rebase::IDENTITY).unwrap(), factor);
    let settings = Settings { width: 1, height: 1, samples, ..independent(&lowered) };
    film(&mut cpu(&lowered), &settings).pixels.exact()[0]
}

/// Returns a view of a light of some radiance. It is not set in the file, where radiance is at most
/// 1e18.
fn lamp(radiance: f64) -> SceneDocument {
    let mut scene = described(
        "materials: { \"lamp\": Emissive(radiance: (1, 1, 1)) },
         objects: [Quad(corner: (-9, -9, 0), u: (18, 0, 0), v: (0, 18, 0), material: \"lamp\")]",
    );
    scene.description.materials[0].emission = DVec3::splat(radiance);
    scene
}

/// Returns the relative deviation of a constant pixel's mean square from its squared mean: 0 within
/// rounding.
fn deviation(pixel: &PixelTotals) -> f64 {
    let n = pixel.samples as f64;
    let mean = pixel.mean()[0];
    (pixel.squares[0].value() / n / (mean * mean) - 1.0).abs()
}

#[test]
fn squares_and_sums_overflow() {
    for radiance in [1.0, 1e18, 1.1e18] {
        let scene = lamp(radiance);
        assert_eq!(found(&scene, Limit::TooBright), []);
        let pixel = pixel(&scene, 256);
        assert!(deviation(&pixel) < 1e-4, "{radiance}: {pixel:?}");
    }
    for (radiance, unit) in
        [(1.3e18, Unit::Variance), (1e30, Unit::Variance), (2e36, Unit::Mean), (1e39, Unit::Mean)]
    {
        let scene = lamp(radiance);
        let found = found(&scene, Limit::TooBright);
        assert_eq!((found.len(), found[0].predicted.of), (1, unit), "{radiance}");
        assert_eq!(found[0].what, "material \"lamp\"");
        let pixel = pixel(&scene, 256);
        assert!(!pixel.squares[0].value().is_finite() || pixel.samples == 0, "{radiance}: {pixel:?}");
        // A sample that a chunk's sum cannot hold is left out and counted.
        assert_eq!(pixel.rejected == 0, unit == Unit::Variance, "{radiance}: {pixel:?}");
    }
}

#[test]
fn squares_underflow() {
    for radiance in [1e-18, 2e-19] {
        let scene = lamp(radiance);
        assert_eq!(found(&scene, Limit::TooDim), []);
        assert!(deviation(&pixel(&scene, 64)) < 1e-4);
    }
    let mut random = Random(9);
    for exponent in [-20, -21, -22, -23, -24] {
        let radiance = (1.0 + random.number()) * 10f64.powi(exponent);
        let scene = lamp(radiance);
        let [one] = &found(&scene, Limit::TooDim)[..] else { panic!("{radiance}") };
        let measured = deviation(&pixel(&scene, 64));
        // A single rounding has any error up to its bound, so this is no root mean square.
        assert!(measured <= 1.01 * one.predicted.value + 1e-4, "{measured} for {one}");
        assert!(exponent > -23 || measured > 0.99, "{radiance}: {measured}");
    }
    // Beside any other light it does no harm.
    let mut lit = lamp(1e-24);
    lit.description.sky =
        Some(trisect::scene::description::Sky::Gradient { bottom: DVec3::ONE, top: DVec3::ONE });
    assert_eq!(found(&lit, Limit::TooDim), []);
}

#[test]
fn a_point_light_near_a_surface() {
    for (intensity, height, beyond) in
        [(1e18, 1.0, false), (1e18, 0.1, true), (1e10, 1.0, false), (1e10, 1e-5, true)]
    {
        let scene = described(&format!(
            "camera: (look_from: (0, {0}, 0), look_at: (0, 0, 0), up: (0, 0, 1), vertical_fov: 1),
             materials: {{ \"white\": Lambertian(albedo: (1, 1, 1)) }},
             objects: [Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"white\")],
             lights: [Point(position: (0, {height:?}, 0), intensity: ({intensity:?}, 0, 0))]",
            0.5 * height
        ));
        let found = found(&scene, Limit::TooBright);
        let pixel = pixel(&scene, 256);
        assert_eq!(
            (found.len(), pixel.squares[0].value().is_finite()),
            (usize::from(beyond), !beyond),
            "{pixel:?}"
        );
        if let [one] = &found[..] {
            assert_eq!(one.what, "lights[0]");
            assert!((pixel.mean()[0] / one.measured - 1.0).abs() < 0.01, "{pixel:?} for {one}");
        }
    }
}
