//! Transport with known answers: an emissive sphere from inside, lights over a plane, the white furnace.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "this is how a test fails")]

use trisect::film::Film;
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_shared::material::EMITS_BOTH_SIDES;
use trisect_shared::math::luminance;
use trisect_tests::renders::{film, lit};
use trisect_tests::statistics::{Blocks, GLOBAL_LIMIT};
use trisect_tests::{Subject, for_each_backend, scene};

/// Samples a pixel: the CPU can afford more, and proves that the faults are found.
fn samples(subject: Subject, cpu: u32, others: u32) -> u32 {
    if subject == Subject::Cpu { cpu } else { others }
}

/// Whether the film's mean is `want`, within 4 sigma and what 256 sums in f32 round.
fn is(film: &Film, want: f64) -> bool {
    let (mean, variance) = Blocks::new(film).whole;
    let counts = film.counts();
    assert_eq!(counts.rejected + counts.unwritten, 0);
    eprintln!("{mean:?} ± {:?} for {want}", variance.map(f64::sqrt));
    (0..3).all(|c| (mean[c] - want).abs() < GLOBAL_LIMIT * variance[c].sqrt() + 1e-5 * want)
}

/// A sphere of reflectance and emission 0.5 around the camera.
fn closed_sphere(albedo: f32) -> Scene {
    let text = r#"Scene(
        version: 1,
        image: (width: 16, height: 16, samples: 1),
        camera: (look_from: (0.3, 0.2, 0.1), look_at: (0, 0, -1), vertical_fov: 60),
        materials: { "wall": Lambertian(albedo: (0.5, 0.5, 0.5)) },
        objects: [Sphere(center: (0, 0, 0), radius: 1, material: "wall")],
    )"#;
    let mut scene = Scene::parse(text, "closed sphere").unwrap();
    let wall = &mut scene.materials[0];
    wall.albedo = glam::Vec3::splat(albedo);
    wall.emission = glam::Vec3::splat(0.5);
    wall.flags |= EMITS_BOTH_SIDES;
    wall.light_density = 2.0 * luminance(wall.emission);
    scene
}

/// Torture test 2: 1 - 0.5^D for D vertices that emit, with and without light sampling.
fn inside_an_emissive_sphere(subject: Subject) {
    let scene = closed_sphere(0.5);
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let samples = samples(subject, 256, 8);
    let depths: &[u32] = if subject == Subject::Cpu { &[1, 2, 5, 20] } else { &[5] };
    for &depth in depths {
        for light_sampling in [true, false] {
            let settings = Settings { samples, depth, light_sampling, seed: depth, ..scene.settings() };
            let want = 1.0 - 0.5f64.powi(depth as i32);
            assert!(is(&film(&mut renderer, &settings), want), "depth {depth}, sampling {light_sampling}");
        }
    }
    if subject == Subject::Cpu {
        let mut renderer = subject.renderer(&closed_sphere(0.51)).unwrap();
        for light_sampling in [true, false] {
            let settings = Settings { samples, depth: 20, light_sampling, ..scene.settings() };
            assert!(!is(&film(&mut renderer, &settings), 1.0), "a comparison that cannot fail");
        }
    }
}

/// The scenes whose files derive their answer.
fn irradiance_is_known(subject: Subject) {
    let cases = [
        ("light_disc.ron", 0.4),
        ("light_sphere.ron", 0.375),
        ("light_quad.ron", 0.554_126_4),
        ("light_punctual.ron", 0.557_042_3),
    ];
    for (name, want) in cases {
        let scene = scene(name);
        // Which of three lights is chosen is noise, too.
        let many = if name == "light_punctual.ron" { 4096 } else { 512 };
        let settings = Settings { samples: samples(subject, many, 8), ..scene.settings() };
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        assert!(is(&film(&mut renderer, &settings), want), "{name}");
        if subject == Subject::Cpu {
            let mut renderer = subject.renderer(&lit(&scene, 1.01)).unwrap();
            assert!(!is(&film(&mut renderer, &settings), want), "{name}: a comparison that cannot fail");
        }
    }
}

/// Whether pixel `index` shows the sphere around (`x`, `y`) in the plane z = 0 of furnace.ron, up to `reach` of its radius.
fn shows(settings: &Settings, index: usize, (x, y): (f64, f64), reach: f64) -> bool {
    let (width, height) = (f64::from(settings.width), f64::from(settings.height));
    let size = 2.0 * 20.0 * 7f64.to_radians().tan() / height; // of a pixel in that plane
    let (column, row) = (index as f64 % width, (index as f64 / width).floor());
    let (dx, dy) = ((column + 0.5 - width / 2.0) * size - x, (height / 2.0 - row - 0.5) * size - y);
    (dx * dx + dy * dy).sqrt() < 0.65 * reach
}

/// Nothing is brighter than the furnace; what absorbs nothing cannot be seen; the rough metals lose what GGX's single scattering does.
fn the_white_furnace(subject: Subject) {
    let good = scene("furnace.ron");
    let Some(mut renderer) = subject.renderer(&good) else { return };
    let (width, height) = if subject == Subject::Cpu { (96, 48) } else { (32, 16) };
    let settings = Settings { width, height, samples: samples(subject, 256, 4), ..good.settings() };
    // Blocks that are brighter than the furnace by more than noise.
    let above = |film: &Film| {
        let brighter = |m: f64, v: f64| m > 1.0 + 4.5 * v.sqrt() + 1e-4;
        let blocks = Blocks::new(film).blocks;
        blocks.iter().filter(|(mean, variance)| brighter(mean[1], variance[1])).count()
    };
    let got = film(&mut renderer, &settings);
    assert_eq!(above(&got), 0);
    // Without neighbours that absorb.
    let mut whole = good.clone();
    whole.spheres.retain(|s| s.center.y > 0.0 && [-3.75, -2.25, 0.75].contains(&s.center.x));
    assert_eq!(whole.spheres.len(), 3);
    let vanished = film(&mut subject.renderer(&whole).unwrap(), &settings);
    for (i, p) in vanished.pixels.iter().enumerate() {
        assert!((p.mean()[1] - 1.0).abs() < 1e-5, "pixel {i}: {:?}", p.mean());
    }
    if subject != Subject::Cpu {
        return;
    }
    for (x, want) in [(-3.75, 0.9999), (-2.25, 0.9158), (-0.75, 0.3069)] {
        let middle = got.pixels.iter().enumerate().filter(|(i, _)| shows(&settings, *i, (x, -1.5), 0.15));
        let (mut sum, mut variance, mut n) = (0.0, 0.0, 0.0);
        for (_, p) in middle {
            (sum, variance, n) = (sum + p.mean()[1], variance + p.variance_of_mean()[1], n + 1.0);
        }
        // 0.005: the middle reaches 9 degrees from normal incidence.
        let off = (sum / n - want).abs();
        assert!(off < 4.0 * variance.sqrt() / n + 0.005, "{x}: {} for {want}", sum / n);
    }
    // The twin.
    let mut faulty = good.clone();
    faulty.materials.iter_mut().for_each(|material| material.albedo *= 1.01);
    let found = above(&film(&mut subject.renderer(&faulty).unwrap(), &settings));
    assert!(found > 0, "a comparison that cannot fail");
}

for_each_backend!(inside_an_emissive_sphere, irradiance_is_known, the_white_furnace);
