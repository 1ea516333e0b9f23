//! Media at the extremes: densities from 0 to 1e9, lights and cameras inside (48).

use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_tests::renders::film;
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

const DENSITIES: [f64; 8] = [0.0, 1e-18, 1e-6, 1.0, 1e2, 1e4, 1e6, 1e9];

/// Depth of the paths.
const DEPTH: u32 = 40;

/// Returns `objects` filled with smoke of this density and albedo, and of the density `blue` for
/// blue light, in a sky of 1. The camera is outside, or in the middle.
fn smoke(objects: &str, (density, blue): (f64, f64), albedo: f64, inside: bool) -> Scene {
    let (from, fov) = if inside { ("(0.1, 0.2, 0.15)", 50.0) } else { ("(0, 0, 1000)", 0.08) };
    let text = format!(
        "Scene(version: 1, image: (width: 8, height: 8, samples: 16, depth: {DEPTH}), \
         camera: (look_from: {from}, look_at: (0, 0, -0.5), vertical_fov: {fov}), \
         sky: Uniform(radiance: (1, 1, 1)), \
         media: {{\"smoke\": (extinction: ({density:?}, {density:?}, {blue:?}), albedo: ({albedo}, {albedo}, {albedo}), \
         anisotropy: 0.3)}}, \
         materials: {{\"edge\": Interface(medium: \"smoke\"), \"glass\": Dielectric(ior: 1.5, medium: \"smoke\"), \
         \"lamp\": Emissive(radiance: (1, 1, 1), two_sided: true)}}, objects: [{objects}])"
    );
    Scene::parse(&text, "smoke").unwrap()
}

/// Returns by how much the mean of red light exceeds 1, beyond noise and rounding, and the rays per
/// sample.
fn extremes(film: &Film) -> (f64, f64) {
    let counts = film.counts();
    assert_eq!((counts.rejected, counts.unwritten), (0, 0));
    let n = film.pixels.len() as f64;
    let mean = film.pixels.iter().map(|pixel| pixel.mean()[0]).sum::<f64>() / n;
    let error = film.pixels.iter().map(|pixel| pixel.variance_of_mean()[0]).sum::<f64>().sqrt() / n;
    let excess = mean - 1.0 - 4.5 * error - 1e-4;
    let least = film.pixels.iter().flat_map(|pixel| pixel.mean()).fold(f64::INFINITY, f64::min);
    assert!(least >= 0.0, "{least}");
    let (rays, samples) = film
        .pixels
        .iter()
        .fold((0, 0), |(rays, samples), pixel| (rays + pixel.segments, samples + pixel.samples));
    (excess, rays as f64 / samples as f64)
}

/// Smoke of each density, in a ball, a box, glass and one ball in another, around a lamp and around
/// the camera, creates no light and no NaN, and takes no more rays than its depth, its shadow rays
/// and its boundaries need. Of density 0 it cannot be seen; where it is clear to blue light alone,
/// blue light passes.
fn t48_media(subject: BackendUnderTest) {
    let ball = "Sphere(center: (0, 0, 0), radius: 1, material: \"edge\")";
    let lamp = "Sphere(center: (0.3, -0.2, 0.1), radius: 0.2, material: \"lamp\")";
    let forms = [
        ball.to_owned(),
        "Box(min: (-1, -1, -1), max: (1, 1, 1), material: \"edge\")".to_owned(),
        "Sphere(center: (0, 0, 0), radius: 1, material: \"glass\")".to_owned(),
        format!("{ball}, Sphere(center: (0, 0, 0), radius: 0.5, material: \"edge\")"),
        format!("{ball}, {lamp}"),
        format!("{ball}, {ball}"),
    ];
    let mut greatest = 0.0f64;
    for (number, form) in forms.iter().enumerate() {
        for density in DENSITIES {
            for albedo in [0.0, 1.0] {
                for inside in [false, true] {
                    // Compiling for each scene takes long where a GPU is a program.
                    let is_chosen = number % 4 == 0 && density >= 1e9 && inside;
                    if subject.is_software() && !is_chosen {
                        continue;
                    }
                    let scene = smoke(form, (density, density), albedo, inside);
                    let Some(mut renderer) = subject.renderer(&scene) else { return };
                    let film = film(&mut renderer, &Settings::of(&scene));
                    let name = format!("form {number}, density {density}, albedo {albedo}, inside {inside}");
                    let (excess, rays) = extremes(&film);
                    assert!(excess <= 0.0, "{name}: {excess}");
                    assert!(rays <= f64::from(8 * DEPTH), "{name}: {rays} rays");
                    let is_glass = number == 2;
                    if density == 0.0 && !is_glass {
                        let red = film.pixels.iter().map(|pixel| pixel.mean()[0]).fold(1.0, f64::min);
                        assert!((red - 1.0).abs() < 1e-4, "{name}: red {red}");
                    }
                    if density == 1e9 && albedo == 0.0 && !is_glass {
                        assert!(film.pixels.iter().all(|pixel| pixel.mean()[0] < 1e-6), "{name}");
                    }
                    greatest = greatest.max(rays);
                }
            }
        }
    }
    for density in [1.0, 1e4, 1e9] {
        let scene = smoke(ball, (density, 0.0), 0.0, true);
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        let film = film(&mut renderer, &Settings { samples: 256, ..Settings::of(&scene) });
        let n = film.pixels.len() as f64;
        let mean = film.pixels.iter().map(|pixel| pixel.mean()[2]).sum::<f64>() / n;
        let error = film.pixels.iter().map(|pixel| pixel.variance_of_mean()[2]).sum::<f64>().sqrt() / n;
        assert!((mean - 1.0).abs() < 4.5 * error + 1e-4, "{density}: blue {mean}, error {error}");
    }
    // Negative control: smoke that creates light.
    let mut faulty = smoke(ball, (1.0, 1.0), 1.0, false);
    faulty.media[0].albedo *= 1.02;
    let Some(mut renderer) = subject.renderer(&faulty) else { return };
    let (excess, _) = extremes(&film(&mut renderer, &Settings::of(&faulty)));
    assert!(excess > 0.0, "negative control not detected: {excess}");
    let figure = format!("{} densities from 0 to 1e9: at most {greatest:.0} rays a sample", DENSITIES.len());
    report(48, subject, Outcome::Passed, figure);
}

for_each_route!(t48_media);
