//! Test 27: spheres of impossible radius, in files and on the device.

use crate::construct::{self, first, power, ray, rounds_correctly, sphere, unit, words};
use crate::spheres::{Case, ask, residual};
use glam::Vec3;
use trisect::scene::Scene;
use trisect_probes::record::{Input, Output};
use trisect_probes::shapes::{NAIVE_SPHERE, SPHERE};
use trisect_probes::trace::CLOSEST;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::math::unit_sphere;
use trisect_shared::sphere::MISS;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Parses a scene file that has a sphere of this radius.
fn load(radius: &str) -> Result<Scene, String> {
    let text = format!(
        "Scene(version: 1, image: (width: 1, height: 1), materials: {{\"a\": Lambertian(albedo: (1, 1, 1))}},
objects: [Sphere(center: (0, 0, 0), radius: {radius}, material: \"a\")],
camera: (look_from: (0, 0, 3), look_at: (0, 0, 0), vertical_fov: 60))"
    );
    Scene::parse(&text, "sphere.ron").map_err(|error| error.to_string())
}

/// Returns whether an answer is a distance or a miss: [`MISS`] or beyond, which no traversal
/// accepts as a hit.
fn is_defined(t: f32) -> bool {
    t > 0.0
}

/// Returns rays around a sphere at 0; a quarter of them start at its centre.
fn about(radius: f32) -> Vec<Case> {
    let case = |i: u32| {
        let (w, v) = (words(2700, i), words(2701, i));
        let origin = unit_sphere(w.x, w.y) * if i.is_multiple_of(4) { 0.0 } else { power(-3.0, 3.0, w.z) };
        let at = unit_sphere(v.x, v.y);
        let direction = if i % 4 == 1 { unit(-origin) } else { at };
        Case::new(Vec3::ZERO, radius, origin, direction)
    };
    (0..4096).map(case).collect()
}

/// A file with an impossible radius is refused with the reason, and a device that gets such a
/// record gives defined answers.
///
/// A device uses the square of the radius. A negative radius therefore acts as its absolute value,
/// and a radius whose square underflows to 0 is met only by rays through the centre. Vulkan without
/// `SignedZeroInfNanPreserve` lets a compiler assume that NaN and infinity do not occur ("SPIR-V
/// Environment"). There, a radius without a finite square may give any answer; [`t27_bad_records`]
/// shows that its traversal ends.
fn t27_radii(subject: BackendUnderTest) {
    for (radius, reason) in [
        ("0", "0 is not a positive finite length between 1e-18 and 1e18"),
        ("-1", "-1 is not a positive"),
        ("NaN", "NaN is not a positive"),
        ("inf", "inf is not a positive"),
        ("1e30", "is not a positive finite length between 1e-18 and 1e18"),
        ("1e-30", "is not a positive finite length between 1e-18 and 1e18"),
    ] {
        let error = load(radius).expect_err(radius);
        assert!(error.contains(reason) && error.contains("sphere.ron:2:"), "{radius}: {error}");
    }
    // Negative control: the ends of the range are accepted.
    assert!(load("1e-18").is_ok() && load("1e18").is_ok());

    let Some(mut prober) = Prober::new(subject) else { return };
    let (mut asked, mut undefined) = (0, 0);
    for radius in [0.0, 1e-40, 1e-30, -1e-30, -1.0, 1e30, -1e30, f32::MAX, f32::INFINITY, f32::NAN] {
        let cases = about(radius);
        let outputs = ask(&mut prober, SPHERE, &cases);
        let wrong = outputs.iter().filter(|output| !is_defined(first(output))).count();
        asked += outputs.len();
        undefined += wrong;
        let finite = (radius * radius).is_finite();
        assert!(wrong == 0 || !finite && !rounds_correctly(subject), "{radius}: {wrong} undefined answers");
        let positive = ask(&mut prober, SPHERE, &about(radius.abs()));
        assert!(!finite || outputs == positive, "{radius} is not its opposite");
        for (case, output) in cases.iter().zip(&outputs).filter(|_| radius.abs() < 1e-20) {
            let t = first(output);
            assert!(t >= MISS || residual(case, t) <= 22.0, "{radius}: {case:?} {t}");
        }
    }
    let outputs = ask(&mut prober, NAIVE_SPHERE, &about(f32::NAN));
    assert!(
        !rounds_correctly(subject) || outputs.iter().all(|output| !is_defined(first(output))),
        "negative control not detected: the naive form"
    );
    let outcome = if rounds_correctly(subject) { Outcome::Passed } else { Outcome::Bounded };
    report(
        27,
        subject,
        outcome,
        format!(
            "6 radii refused at load; on the device {undefined} of {asked} answers for 10 such radii are neither a distance nor a miss"
        ),
    );
}

/// With impossible records in a scene, each ray ends, and no distance is NaN.
fn t27_bad_records(subject: BackendUnderTest) {
    let place = |i: u32| sphere(unit_sphere(words(2702, i).x, words(2702, i).y) * 10.0, 1.0);
    let mut scene = ProbeScene::new(&construct::scene((0..64).map(place).collect(), &[]));
    let bad = [0.0, -1.0, 1e-40, 1e30, f32::INFINITY, f32::NAN];
    for (sphere, radius) in scene.scene.spheres.iter_mut().zip(bad.into_iter().cycle().take(32)) {
        sphere.radius = radius;
    }
    let Some(mut prober) = Prober::with_scene(subject, &scene) else { return };
    let rays: Vec<Input> = about(1.0).iter().map(|case| ray(case.origin, case.direction)).collect();
    let outputs = prober.ask("probe_trace", CLOSEST, &rays);
    let wrong = |outputs: &[Output]| {
        let distances = outputs.iter().map(|output| f32::from_bits(output.b.x));
        distances.filter(|&t| !(is_defined(t) && t <= MISS)).count()
    };
    assert!(wrong(&outputs) == 0 || !rounds_correctly(subject), "{}", wrong(&outputs));
    let mut broken = outputs.clone();
    broken[7].b.x = f32::NAN.to_bits();
    assert!(wrong(&broken) > wrong(&outputs), "negative control not detected: a NaN");
    let hits = outputs.iter().filter(|output| output.a.w != NO_PRIMITIVE).count();
    assert!(hits > 100, "{hits}");
    let outcome = if rounds_correctly(subject) { Outcome::Passed } else { Outcome::Bounded };
    let text = format!(
        "64 spheres, half of them with radii 0, -1, 1e-40, 1e30, inf, NaN: all {} rays end",
        rays.len()
    );
    report(27, subject, outcome, text);
}

for_each_route!(t27_radii, t27_bad_records);
