//! Closed spheres that emit, seen from inside, and cameras inside and on things (2, 32, 36).

use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_shared::material::EMITS_BOTH_SIDES;
use trisect_shared::math::luminance;
use trisect_tests::renders::{film, independent, lit};
use trisect_tests::report::{Outcome, report};
use trisect_tests::statistics::Known;
use trisect_tests::{BackendUnderTest, for_each_route};

/// Returns the unit sphere around a camera at `from` that looks along -z. The wall reflects
/// `albedo` and emits `emission` on both sides.
fn enclosure(albedo: f32, emission: f32, from: &str) -> Scene {
    let text = format!(
        "Scene(version: 1, image: (width: 16, height: 16, samples: 1), \
         camera: (look_from: {from}, look_at: (0, 0, -1), vertical_fov: 60), \
         materials: {{ \"wall\": Lambertian(albedo: (0, 0, 0)) }}, \
         objects: [Sphere(center: (0, 0, 0), radius: 1, material: \"wall\")])"
    );
    let mut scene = Scene::parse(&text, "enclosure").unwrap();
    let wall = &mut scene.materials[0];
    wall.albedo = glam::Vec3::splat(albedo);
    wall.emission = glam::Vec3::splat(emission);
    wall.flags |= EMITS_BOTH_SIDES;
    wall.light_pdf = 2.0 * luminance(wall.emission);
    scene
}

/// Returns the radiance E (1 + rho + ... + rho^(D - 1)) of a path of D vertices.
fn radiance(albedo: f64, emission: f64, depth: u32) -> f64 {
    emission * (0..depth).rev().fold(0.0, |sum, _| 1.0 + albedo * sum)
}

/// The radiance inside is 1 - 0.5^D for D vertices that reflect and emit 0.5, with and without
/// light sampling.
fn t02_closed_emissive_sphere(subject: BackendUnderTest) {
    let scene = enclosure(0.5, 0.5, "(0.3, 0.2, 0.1)");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let samples = if subject.is_software() { 4 } else { 256 };
    let depths: &[u32] = if subject.is_software() { &[1, 3, 8] } else { &[1, 2, 3, 5, 8, 20] };
    let mut worst = 0.0f64;
    for &depth in depths {
        for light_sampling in [true, false] {
            let settings = Settings { samples, depth, light_sampling, seed: depth, ..independent(&scene) };
            let known = Known::of(&film(&mut renderer, &settings).pixels, radiance(0.5, 0.5, depth));
            assert!(known.holds(), "depth {depth}, light sampling {light_sampling}: {known:?}");
            worst = worst.max(known.off);
        }
    }
    // Negative control: 2 % more is reflected. Without light sampling no noise hides it.
    let mut renderer =
        subject.renderer(&enclosure(0.51, 0.5, "(0.3, 0.2, 0.1)")).expect("the backend opened before");
    for light_sampling in [true, false] {
        let samples = if subject.is_software() && light_sampling { 64 } else { samples };
        let settings = Settings { samples, depth: 8, light_sampling, ..independent(&scene) };
        let known = Known::of(&film(&mut renderer, &settings).pixels, radiance(0.5, 0.5, 8));
        assert!(!known.holds(), "negative control not detected: {known:?}");
    }
    report(
        2,
        subject,
        Outcome::Passed,
        format!("1 - 0.5^D for D in {depths:?}: {worst:.1} of 4 sigma at most"),
    );
}

/// With reflectances of 0.99 and 1, a depth of D misses rho^D of the whole radiance and nothing
/// else.
fn t36_enclosures(subject: BackendUnderTest) {
    let mut worst = 0.0f64;
    for (albedo, emission, depths) in [
        (0.99f32, 0.01f32, [1, 10, 100, 1000]),
        (1.0, 1.0 / 1024.0, [1, 32, 1024, if subject.is_software() { 2048 } else { 65_535 }]),
    ] {
        let scene = enclosure(albedo, emission, "(0.3, 0.2, 0.1)");
        let Some(mut renderer) = subject.renderer(&scene) else { return };
        for depth in depths {
            let settings = Settings {
                width: 4,
                height: 4,
                samples: 2,
                depth,
                light_sampling: false,
                ..independent(&scene)
            };
            let film = film(&mut renderer, &settings);
            assert_eq!(film.counts().segments, 2 * 16 * u64::from(depth), "a path ended early");
            let want = radiance(f64::from(albedo), f64::from(emission), depth);
            // Each path has the same sum. Its D products and D sums round by at most half an ULP
            // each, 2^-24, and no path meets the sky.
            let bound = 2.0 * f64::from(depth) / 16_777_216.0 + Known::ROUNDING;
            for pixel in &film.pixels {
                let off = (pixel.mean()[1] / want - 1.0).abs();
                assert!(off <= bound, "rho {albedo}, depth {depth}: {} for {want}", pixel.mean()[1]);
                worst = worst.max(off / bound);
            }
            // Negative control: one vertex more exceeds the bound, as long as rho^D is large
            // enough.
            let next = radiance(f64::from(albedo), f64::from(emission), depth + 1);
            assert!(depth > 100 || (next / want - 1.0).abs() > bound, "negative control not detected");
        }
    }
    report(
        36,
        subject,
        Outcome::Passed,
        format!("rho 0.99 and 1, D to 65535 (software: 2048): 1 - rho^D within {worst:.2} of D 2^-23"),
    );
}

/// Returns a scene of `objects` under a sky of 1, with the camera's position, target and field of
/// view in degrees.
fn from_within((from, to, fov): (&str, &str, u32), materials: &str, objects: &str) -> Scene {
    let text = format!(
        "Scene(version: 1, image: (width: 8, height: 8, samples: 16, depth: 200), \
         camera: (look_from: {from}, look_at: {to}, up: (0.1, 0.2, 1), vertical_fov: {fov}), \
         sky: Uniform(radiance: (1, 1, 1)), materials: {{{materials}}}, objects: [{objects}])"
    );
    Scene::parse(&text, "from within").unwrap()
}

/// A camera in glass, in a light, or on a surface sees the known constant, which is finite.
fn t32_camera_within(subject: BackendUnderTest) {
    let glass = r#""a": Dielectric(ior: 1.5)"#;
    let white = r#""a": Lambertian(albedo: (1, 1, 1))"#;
    let light = r#""a": Emissive(radiance: (3, 3, 3), two_sided: true)"#;
    let sphere = r#"Sphere(center: (0, 0, 0), radius: 1, material: "a")"#;
    let ground = r#"Plane(point: (0, 0, 0), normal: (0, 1, 0), material: "a")"#;
    // A view into glass from its wall stays within 27 degrees: beyond 42, total reflection keeps a
    // ray in the sphere for ever.
    let views = [
        ("in glass", from_within(("(0.2, 0.3, 0.1)", "(1, 0, 0)", 100), glass, sphere), 1.0),
        ("at the centre of glass", from_within(("(0, 0, 0)", "(1, 0, 0)", 100), glass, sphere), 1.0),
        ("on glass, outwards", from_within(("(0, 1, 0)", "(0, 9, 0)", 100), glass, sphere), 1.0),
        ("on glass, inwards", from_within(("(0, 1, 0)", "(0, 0, 0)", 40), glass, sphere), 1.0),
        ("on a white sphere, outwards", from_within(("(0, 1, 0)", "(0, 9, 0)", 100), white, sphere), 1.0),
        ("on the ground, upwards", from_within(("(5, 0, 3)", "(5, 9, 3)", 100), white, ground), 1.0),
        ("in a light", from_within(("(0.2, 0.3, 0.1)", "(1, 0, 0)", 100), light, sphere), 3.0),
        ("on a light, inwards", from_within(("(0, 1, 0)", "(0, 0, 0)", 100), light, sphere), 3.0),
        ("on a wall that emits, inwards", enclosure(0.5, 0.5, "(0, 0, 1)"), radiance(0.5, 0.5, 200)),
    ];
    for (name, scene, want) in &views {
        let Some(mut renderer) = subject.renderer(scene) else { return };
        let settings = Settings {
            width: 8,
            height: 8,
            samples: 16,
            depth: 200,
            light_sampling: false,
            ..independent(scene)
        };
        for pixel in &film(&mut renderer, &settings).pixels {
            assert!(
                (pixel.mean()[1] / want - 1.0).abs() <= 2.0 * Known::ROUNDING,
                "{name}: {:?}",
                pixel.mean()
            );
        }
        // Negative control: a sky, a light or a wall that is 1 % brighter.
        let faulty = lit(scene, 1.01);
        let mut renderer = subject.renderer(&faulty).expect("the backend opened before");
        let known = Known::of(&film(&mut renderer, &settings).pixels, *want);
        assert!(!known.holds(), "{name}: negative control not detected: {known:?}");
    }
    // Where rounding decides on which side of a wall the camera is, it sees one side or the other,
    // and nothing in between.
    let scene = enclosure(0.5, 0.5, "(0.6, 0, 0.8)");
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings {
        width: 8,
        height: 8,
        samples: 4,
        depth: 200,
        light_sampling: false,
        ..independent(&scene)
    };
    for pixel in &film(&mut renderer, &settings).pixels {
        let mean = pixel.mean()[1];
        let is = |want: f64| (mean / want - 1.0).abs() <= 2.0 * Known::ROUNDING;
        assert!(is(radiance(0.5, 0.5, 200)) || is(0.5), "within rounding of a wall: {mean}");
    }
    report(
        32,
        subject,
        Outcome::Passed,
        format!(
            "{} cameras in glass, in lights, on surfaces: the constant of each, in each pixel",
            views.len()
        ),
    );
}

for_each_route!(t02_closed_emissive_sphere, t32_camera_within, t36_enclosures);
