//! Random numbers: parity (4) and extremes (5).

use crate::materials;
use crate::scattering::{answer, question, with_materials};
use glam::{UVec4, Vec3};
use trisect::render::Settings;
use trisect::scene::Scene;
use trisect_probes::record::{Input, Output, vector};
use trisect_probes::sampling::*;
use trisect_probes::scatter;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::rng::{PathKey, Words, pcg4d};
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Words and numbers of 2²⁰ tuples of seed, pixel, sample and block, small and large, have the
/// CPU's bits.
fn t04_parity(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let Some(mut cpu) = Prober::new(BackendUnderTest::Cpu) else { return };
    let questions: Vec<Input> = (0..1u32 << 20)
        .map(|i| {
            let w = pcg4d(Words { x: i, y: 4, z: 0, w: 0 });
            let a =
                if i & 1 == 0 { UVec4::new(w.x, w.y, w.z, w.w) } else { UVec4::new(1, i, i % 97, i % 13) };
            Input { a, ..Input::default() }
        })
        .collect();
    for operation in [INDEPENDENT, SEQUENCE] {
        let got = prober.ask("probe_sampling", operation, &questions);
        let want = cpu.ask("probe_sampling", operation, &questions);
        let differing = got.iter().zip(&want).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "operation {operation}");
        assert!(got.iter().all(|o| o.b.to_array().iter().all(|&b| f32::from_bits(b) < 1.0)));
        if operation == INDEPENDENT {
            // The CPU's answer is the sampler's. Negative control: numbers of all 32 bits differ.
            let first = PathKey { seed: questions[0].a.x, pixel: questions[0].a.y, sample: questions[0].a.z };
            assert_eq!(want[0].a.x, first.words(questions[0].a.w).x);
            let twin = prober.ask("probe_sampling", INDEPENDENT_TO_ONE, &questions);
            assert!(twin.iter().zip(&want).filter(|(a, b)| a.b != b.b).count() > questions.len() / 2);
        }
    }
    report(4, subject, Outcome::Passed, "2^20 tuples, both samplers: 0 words and 0 numbers differ");
}

/// Words at the ends of their range and around the sign bit.
const EXTREMES: [u32; 7] = [0, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ff7f, 0xffff_ff80, u32::MAX];

fn extreme_words() -> Vec<UVec4> {
    let mut words = Vec::new();
    for x in EXTREMES {
        for y in EXTREMES {
            for z in EXTREMES {
                words.extend(EXTREMES.map(|w| UVec4::new(x, y, z, w)));
            }
        }
    }
    words
}

/// Returns the maximum deviation of vectors from unit length; infinite if a vector is not finite.
fn off_unit<'a>(vectors: impl Iterator<Item = Vec3> + 'a) -> f64 {
    let off = |v: Vec3| (v.as_dvec3().length() - 1.0).abs();
    vectors.map(|v| if v.is_finite() { off(v) } else { f64::INFINITY }).fold(0.0, f64::max)
}

const EPSILON: f64 = f32::EPSILON as f64;

const LIT: &str = r#"Scene(version: 1, image: (width: 16, height: 9),
    camera: (look_from: (0, 1, 4), look_at: (0, 0, 0), vertical_fov: 40, defocus_angle: 2, focus_distance: 4),
    sky: Gradient(bottom: (1, 1, 1), top: (1, 1, 1)),
    materials: { "lamp": Emissive(radiance: (3, 2, 1)) },
    objects: [
        Sphere(center: (0, 2, 0), radius: 0.5, material: "lamp"),
        Quad(corner: (-1, 3, -1), u: (2, 0, 0), v: (0, 0, 2), material: "lamp"),
        Disc(center: (3, 1, 0), normal: (-1, 0, 0), radius: 0.7, material: "lamp"),
    ],
    lights: [Point(position: (1, 1, 1), intensity: (1, 1, 1)), Directional(direction: (0, -1, 0), irradiance: (1, 1, 1))],
)"#;

/// Each sampler is finite and in range at the ends of each word's range, and its directions have
/// unit length within 4 eps, or within 8 where division and square root may be off by 2.5 and 4.5
/// ULP (Vulkan specification, "Precision of Core SPIR-V Instructions").
fn t05_extremes(subject: BackendUnderTest) {
    let limit =
        if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) { 4.0 } else { 8.0 } * EPSILON;
    let extremes = extreme_words();
    let setups = [
        materials::lambertian(),
        materials::metal(1.0),
        materials::glass(1.5, true),
        materials::glass(1.5, false),
        materials::conductor(0.3),
        materials::copper(1.0),
        materials::rough_glass(1.5, 0.5, true),
        materials::rough_glass(1.5, 0.5, false),
        materials::mix(0.5, 0.6, 0.0),
        materials::mix(0.2, 0.4, 0.6),
    ];
    let Some(mut prober) = with_materials(subject, &setups) else { return };
    let mut worst = ("", 0.0f64);
    let mut check = |name: &'static str, off: f64| {
        assert!(off <= limit, "{name}: {} eps", off / EPSILON);
        worst = if off > worst.1 { (name, off) } else { worst };
    };
    for (index, setup) in setups.iter().enumerate() {
        let mut questions = Vec::new();
        for cos in [1.0, 0.7, 0.1, 1e-3] {
            let seen = setup.view(cos);
            questions
                .extend(extremes.iter().map(|&w| question(index, seen.viewer, seen.normal, setup.front, w)));
        }
        let answers: Vec<_> =
            prober.ask("probe_scatter", scatter::SAMPLE, &questions).iter().map(answer).collect();
        for (a, q) in answers.iter().zip(&questions) {
            let in_range = a.weight.is_finite() && a.weight.min_element() >= 0.0 && a.density >= 0.0;
            assert!(in_range && a.density.is_finite(), "{}: {a:?} of {q:?}", setup.name);
        }
        let alive = answers.iter().filter(|a| !a.absorbed).map(|a| a.direction);
        check("a material", off_unit(alive));
    }
    let ask = |prober: &mut Prober, operation| {
        let pixel = UVec4::new(7, 3, 0, 0);
        let questions: Vec<Input> =
            extremes.iter().map(|&a| Input { a, b: pixel, ..Input::default() }).collect();
        prober.ask("probe_sampling", operation, &questions)
    };
    let points = ask(&mut prober, UNIT_SPHERE);
    check("the unit sphere", off_unit(points.iter().map(|o| vector(o.a))));

    let scene = Scene::parse(LIT, "lit").unwrap();
    let Some(mut prober) = Prober::with_scene(subject, &ProbeScene::new(&scene)) else { return };
    let renderer = trisect_tests::renders::cpu(&scene);
    prober.render.camera = renderer.camera(&Settings::of(&scene));
    let rays = ask(&mut prober, CAMERA);
    assert!(rays.iter().all(|o| vector(o.b).is_finite()));
    check("the camera", off_unit(rays.iter().map(|o| vector(o.a))));
    let from =
        [Vec3::ZERO, Vec3::new(0.0, 1.5, 0.0), Vec3::new(1e-3, 2.999, 1e-3), Vec3::new(0.0, 0.0, -1e6)];
    for point in from {
        let a = trisect_probes::record::row(point, NO_PRIMITIVE);
        let questions: Vec<Input> = extremes.iter().map(|&b| Input { a, b, ..Input::default() }).collect();
        let outputs = prober.ask("probe_lights", 0, &questions);
        let number = |bits: u32| f32::from_bits(bits);
        let is_good = |o: &Output| {
            let (density, limit) = (number(o.a.w), number(o.b.w));
            density > 0.0 && density.is_finite() && limit > 0.0 && vector(o.b).is_finite()
        };
        assert!(outputs.iter().all(is_good), "{point}: {:?}", outputs.iter().find(|o| !is_good(o)));
        check("a light", off_unit(outputs.iter().map(|o| vector(o.a))));
    }
    // Negative controls: a last word that gives the number 1, and directions that are too long by
    // 1e-6.
    let top = |i: &u32| {
        let w = PathKey { seed: 1, pixel: *i, sample: 0 }.words(0);
        w.x.max(w.y).max(w.z).max(w.w) >= 0xffff_ff80
    };
    let pixel = (0..u32::MAX).find(top).unwrap();
    let many = [Input { a: UVec4::new(1, pixel, 0, 0), ..Input::default() }];
    let reaches_one =
        |outputs: &[Output]| outputs.iter().any(|o| o.b.to_array().iter().any(|&b| number_is_one(b)));
    assert!(
        reaches_one(&prober.ask("probe_sampling", INDEPENDENT_TO_ONE, &many)),
        "negative control not detected"
    );
    assert!(!reaches_one(&prober.ask("probe_sampling", INDEPENDENT, &many)));
    assert!(off_unit(points.iter().map(|o| vector(o.a) * (1.0 + 1e-6))) > limit, "control not detected");
    let figure = format!(
        "7^4 words through 10 materials, 5 lights, camera, sphere: length within {:.1} eps ({})",
        worst.1 / EPSILON,
        worst.0
    );
    report(5, subject, Outcome::Passed, figure);
}

fn number_is_one(bits: u32) -> bool {
    f32::from_bits(bits) >= 1.0
}

for_each_route!(t04_parity, t05_extremes);
