//! Scattered directions (33, 34), and probes of materials for other tests.

use crate::chart::{CELLS, Chart};
use crate::materials::{self, Setup};
use crate::statistics::{chi_square, sidak};
use glam::{UVec4, Vec3};
use rayon::prelude::*;
use trisect::scene::Scene;
use trisect_probes::record::{Input, Output, row, vector};
use trisect_probes::scatter::SAMPLE;
use trisect_shared::bsdf::ROUGH_DIELECTRIC;
use trisect_shared::fresnel::refracted_cos2;
use trisect_shared::math::{normalize, unit_sphere};
use trisect_shared::rng::PathKey;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Opens a prober for a scene with these materials.
pub fn with_materials(subject: BackendUnderTest, setups: &[Setup]) -> Option<Prober> {
    let mut scene = Scene::parse(
        "Scene(version: 1, image: (width: 1, height: 1), materials: {}, objects: [],
            camera: (look_from: (0, 0, 0), look_at: (0, 0, -1), vertical_fov: 60))",
        "materials",
    )
    .unwrap();
    scene.materials = setups.iter().map(|setup| setup.material).collect();
    Prober::with_scene(subject, &ProbeScene::new(&scene))
}

/// Returns the question how material `index` scatters light towards `viewer`.
pub fn question(index: usize, viewer: Vec3, normal: Vec3, front: bool, words: UVec4) -> Input {
    Input { a: row(-viewer, index as u32), b: row(normal, u32::from(front)), c: words, ..Input::default() }
}

/// Answer to a [`question`].
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub direction: Vec3,
    pub transmitted: bool,
    pub absorbed: bool,
    pub weight: Vec3,
    pub density: f32,
}

pub fn answer(output: &Output) -> Answer {
    Answer {
        direction: vector(output.a),
        transmitted: output.a.w & 1 != 0,
        absorbed: output.a.w & 2 != 0,
        weight: vector(output.b),
        density: f32::from_bits(output.b.w),
    }
}

fn words(stream: u32, i: u32) -> UVec4 {
    let w = PathKey { seed: stream, pixel: i, sample: 0 }.words(0);
    UVec4::new(w.x, w.y, w.z, w.w)
}

/// Quadrature points per cell in each direction. With 12 of them, the error at the horizon of a
/// roughness of 1 is significant at 2²⁰ samples.
const POINTS: usize = 40;

/// Returns p of Pearson's chi-square test: directions that a device drew for `of` (`outputs`)
/// against the CPU's pdf of `by`.
fn compare(outputs: &[Output], of: &Setup, by: &Setup, cos: f32) -> f64 {
    let (seen, density) = (of.view(cos), by.view(cos));
    let eta = match (of.material.kind == ROUGH_DIELECTRIC, of.front) {
        (false, _) => 1.0,
        (true, true) => 1.0 / of.material.ior,
        (true, false) => of.material.ior,
    };
    let cos2 = refracted_cos2(cos, eta);
    let mirrored = seen.mirrored();
    let through = if eta == 1.0 || cos2 <= 0.0 {
        mirrored - seen.normal * (2.0 * mirrored.dot(seen.normal))
    } else {
        seen.normal * (eta * cos - cos2.sqrt()) - seen.viewer * eta
    };
    let charts = [mirrored, through].map(|axis| Chart::new(axis.normalize()));
    let mut observed = vec![0.0; 2 * CELLS];
    let mut counted = 0.0;
    for sample in outputs.iter().map(answer).filter(|s| !s.absorbed && s.density > 0.0) {
        let below = usize::from(sample.transmitted);
        observed[below * CELLS + charts[below].cell(sample.direction)] += 1.0;
        counted += 1.0;
    }
    let mut expected: Vec<f64> = (0..2 * CELLS)
        .into_par_iter()
        .map(|cell| {
            let below = cell / CELLS == 1;
            charts[usize::from(below)].integral(cell % CELLS, POINTS, |d| {
                let is_here = (d.dot(density.normal) < 0.0) == below;
                if is_here { f64::from(density.evaluate(d).pdf) } else { 0.0 }
            })
        })
        .collect();
    let total: f64 = expected.iter().sum();
    expected.iter_mut().for_each(|e| *e *= counted / total);
    chi_square(&observed, &expected)
}

/// 2²⁰ samples of each distribution follow its pdf: p > 0.0025 over all of them, by Šidák's
/// correction.
fn t34_chi_square(subject: BackendUnderTest) {
    const SAMPLES: u32 = 1 << 20;
    const COS: f32 = 0.6;
    let setups = [
        materials::lambertian(),
        materials::metal(0.5),
        materials::metal(1.0),
        materials::conductor(0.2),
        materials::conductor(1.0),
        materials::rough_glass(1.5, 0.5, true),
        materials::rough_glass(1.5, 0.5, false),
        materials::mix(0.5, 0.6, 0.0),
        materials::mix(0.2, 0.4, 0.6),
    ];
    let Some(mut prober) = with_materials(subject, &setups) else { return };
    let least = sidak(setups.len());
    let mut lowest = 1.0f64;
    for (index, setup) in setups.iter().enumerate() {
        let seen = setup.view(COS);
        let questions: Vec<Input> = (0..SAMPLES)
            .map(|i| question(index, seen.viewer, seen.normal, setup.front, words(index as u32, i)))
            .collect();
        let outputs = prober.ask("probe_scatter", SAMPLE, &questions);
        let p = compare(&outputs, setup, setup, COS);
        assert!(p > least, "{}: p {p}", setup.name);
        lowest = lowest.min(p);
        if index == 3 {
            // Negative control: a lobe that is wider by a tenth.
            let p = compare(&outputs, setup, &setup.with_alpha(1.1), COS);
            assert!(p < 1e-9, "negative control not detected: {p}");
        }
    }
    let figure = format!("9 distributions, 2^20 samples each: least p {lowest:.3}, {least:.1e} wanted");
    report(34, subject, Outcome::Passed, figure);
}

/// No scattered direction is zero, for diffuse points opposite the normal and for a metal of fuzz 1
/// at grazing incidence; the metal absorbs the expected share.
fn t33_no_zero_direction(subject: BackendUnderTest) {
    let setups = [materials::lambertian(), materials::metal(1.0)];
    let Some(mut prober) = with_materials(subject, &setups) else { return };
    let mut questions = Vec::new();
    // The normal is opposite to the point on the sphere that the words give.
    for i in 0..4096 {
        let w = if i < 4 { UVec4::new([0, u32::MAX][i as usize & 1], i, 0, 0) } else { words(33, i) };
        let normal = -normalize(unit_sphere(w.x, w.y));
        questions.push(question(0, normal, normal, true, w));
    }
    let least = |outputs: &[Output]| {
        let lengths = outputs.iter().map(|output| answer(output).direction.length());
        lengths.fold(f32::INFINITY, |a, b| if b >= a { a } else { b })
    };
    let outputs = prober.ask("probe_scatter", SAMPLE, &questions);
    let shortest = least(&outputs);
    assert!((shortest - 1.0).abs() < 1e-6, "{shortest}");
    // Negative control: the plain sum of normal and point, which is 0 or a rounding error.
    let sums = questions.iter().map(|q| vector(q.b) + unit_sphere(q.c.x, q.c.y));
    let sums: Vec<Output> = sums.map(|sum| Output { a: row(sum, 0), b: UVec4::ZERO }).collect();
    assert!(least(&sums) < 1e-6, "negative control not detected");

    // Of the ball around a mirrored direction of height c, (2 - 3 c + c^3) / 4 of the volume is
    // below the surface and absorbed.
    let mut worst = 0.0f64;
    let count = 1u32 << 17;
    let mut shares = Vec::new();
    for cos in [1e-3f32, 0.1, 0.5] {
        let seen = setups[1].view(cos);
        let questions: Vec<Input> =
            (0..count).map(|i| question(1, seen.viewer, seen.normal, true, words(34, i))).collect();
        let outputs = prober.ask("probe_scatter", SAMPLE, &questions);
        assert!((least(&outputs) - 1.0).abs() < 1e-6);
        let absorbed = outputs.iter().filter(|output| answer(output).absorbed).count() as f64;
        let share = absorbed / f64::from(count);
        let c = f64::from(cos);
        let want = (2.0 - 3.0 * c + c.powi(3)) / 4.0;
        let sigma = (want * (1.0 - want) / f64::from(count)).sqrt();
        worst = worst.max((share - want).abs() / sigma);
        shares.push(format!("{share:.4}"));
    }
    assert!(worst < 4.5, "{worst} sigma");
    let figure = format!(
        "4,096 opposite points: none is zero; fuzz 1 absorbs {} at cosines 0.001, 0.1, 0.5, {worst:.1} sigma from the ball's share",
        shares.join(", ")
    );
    report(33, subject, Outcome::Passed, figure);
}

for_each_route!(t33_no_zero_direction, t34_chi_square);
