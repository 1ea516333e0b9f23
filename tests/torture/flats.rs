//! Test 23: axis-aligned parallelograms; rays exactly along axes, and rays in their planes.

use crate::construct::{self, first, power, quad, ray, rounds_correctly, unit, words};
use glam::{Vec3, Vec4};
use trisect_probes::record::{Input, Output, row, vector};
use trisect_probes::shapes::PLANAR;
use trisect_probes::trace::CLOSEST;
use trisect_shared::planar::Planar;
use trisect_shared::sphere::MISS;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::ulp::error;
use trisect_tests::{BackendUnderTest, for_each_route};

const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// Returns quads with edges of 2 and 4, two perpendicular to each axis with opposite fronts. All
/// their numbers, and those derived from them, are exact. Each stands in its own column along every
/// axis. `scale`, a power of two, multiplies all lengths.
fn quads(scale: f32) -> Vec<Planar> {
    let shapes = (0..6u8).map(|i| {
        let (u, v) = (AXES[(usize::from(i) + 1) % 3] * 2.0, AXES[(usize::from(i) + 2) % 3] * 4.0);
        let (u, v) = if i < 3 { (u, v) } else { (v, -u) };
        let corner = Vec3::splat(64.0 * (f32::from(i) - 2.0));
        quad(corner * scale, u * scale, v * scale)
    });
    construct::scene(shapes.collect(), &[]).flats
}

/// Returns rays along the normal, from either side, at the corners, the border and the inside, as
/// origin, direction and true distance.
fn perpendicular(flat: &Planar) -> Vec<(Vec3, Vec3, f32)> {
    let mut rays = Vec::new();
    let size = flat.edge_u.abs().max_element();
    for i in 0..5 * 5 * 12 {
        let at = |k: u32| (k % 5) as f32 * 0.25;
        let point = flat.origin + flat.edge_u * at(i) + flat.edge_v * at(i / 5);
        let (k, front) = (i / 25 % 6, i % 2 == 0);
        let height = size * [0.0625, 0.5, 1.0, 2.0, 4.0, 8.0][k as usize];
        // The second half has zeros of the other sign.
        let sign = if i / 150 == 0 { 0.0 } else { -0.0 };
        let out = if front { flat.normal } else { -flat.normal };
        let direction = Vec3::from_array((-out).to_array().map(|x| if x == 0.0 { sign } else { x }));
        rays.push((point + out * height, direction, height));
    }
    rays
}

/// Returns rays in the plane or out of it by next to nothing, as origin and direction: from inside
/// the quad, its border and beside it, and some from a little above.
fn along(flat: &Planar, stream: u32) -> Vec<(Vec3, Vec3)> {
    let size = flat.edge_u.abs().max_element();
    let ray = |i: u32| {
        let w = words(2300 + stream, i);
        let at = |bits: u32| (bits % 9) as f32 * 0.25 - 0.5;
        let height = if i.is_multiple_of(3) { size * power(-6.0, 1.0, w.z) } else { 0.0 };
        let origin = flat.origin + flat.edge_u * at(w.x) + flat.edge_v * at(w.y) + flat.normal * height;
        let side = [-1.0, -0.0, 0.0, 1.0][w.z as usize % 4];
        let mut direction = flat.edge_u / size * side + flat.edge_v / size * [1.0, -0.5][w.w as usize % 2];
        direction = unit(direction) + flat.normal * [0.0, -0.0, 1e-45, -1e-38, 1e-20][w.w as usize / 2 % 5];
        (origin, direction)
    };
    (0..2000).map(ray).collect()
}

fn question(flat: &Planar, origin: Vec3, direction: Vec3) -> Input {
    Input {
        a: row(flat.origin, flat.kind),
        b: row(flat.normal, 0),
        c: row(flat.dual_u, 0),
        d: row(flat.dual_v, 0),
        e: row(origin, 0),
        f: row(direction, 0),
        ..Input::default()
    }
}

/// Counts of wrong answers.
#[derive(Debug, Default, PartialEq)]
struct Failures {
    /// Number of perpendicular rays that miss.
    misses: u32,
    /// Maximum error of a hit's distance, in ULP.
    ulps: f64,
    /// Number of answers to rays in or along the plane that are neither a distance nor a miss.
    undefined: u32,
    /// Number of those where the ray is parallel to the plane, or meets it at a distance below
    /// 1e30.
    undefined_numbers: u32,
    /// Number of rays exactly in or parallel to the plane that hit.
    hits: u32,
}

/// Asks about the six quads at a scale, after `spoil` has changed them.
fn failures(prober: &mut Prober, scale: f32, spoil: impl Fn(&mut Planar)) -> Failures {
    let mut faults = Failures::default();
    for (stream, mut flat) in (0..).zip(quads(scale)) {
        let (across, within) = (perpendicular(&flat), along(&flat, stream));
        spoil(&mut flat);
        let mut questions: Vec<Input> = across.iter().map(|&(o, d, _)| question(&flat, o, d)).collect();
        questions.extend(within.iter().map(|&(o, d)| question(&flat, o, d)));
        let answers: Vec<f32> = prober.ask("probe_shapes", PLANAR, &questions).iter().map(first).collect();
        let (perpendicular, parallel) = answers.split_at(across.len());
        for (&t, &(_, _, want)) in perpendicular.iter().zip(&across) {
            if t == MISS {
                faults.misses += 1;
            } else {
                faults.ulps = faults.ulps.max(error(t, f64::from(want)));
            }
        }
        for (&t, &(origin, direction)) in parallel.iter().zip(&within) {
            let (height, approach) = ((flat.origin - origin).dot(flat.normal), direction.dot(flat.normal));
            let undefined = !(t > 0.0 && t <= MISS);
            faults.undefined += u32::from(undefined);
            let plain = approach == 0.0 || (height / approach).abs() < 1e30;
            faults.undefined_numbers += u32::from(undefined && plain);
            faults.hits += u32::from(approach == 0.0 && t < MISS);
        }
    }
    faults
}

/// Perpendicular rays hit, corners and borders included, and no ray in or along the plane gives a
/// NaN.
///
/// A direction that leaves the plane by 1e-38 meets it at a distance beyond the range of f32. By
/// IEEE 754, infinity times zero is then a NaN that no comparison accepts. Vulkan without
/// `SignedZeroInfNanPreserve` defines neither, so there such answers are counted, and all others
/// must hold.
fn t23_axis_aligned_quads(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let mut undefined = 0;
    let mut worst = 0.0f64;
    for k in [-20, 0, 20] {
        let found = failures(&mut prober, (k as f32).exp2(), |_| {});
        undefined += found.undefined;
        worst = worst.max(found.ulps);
        // The distance is the quotient of the height and ±1.
        let bound = if rounds_correctly(subject) { 0.0 } else { 2.5 };
        assert!(found.misses == 0 && found.ulps <= bound && found.hits == 0, "2^{k}: {found:?}");
        assert!(found.undefined_numbers == 0, "2^{k}: {found:?}");
        assert!(found.undefined == 0 || !rounds_correctly(subject), "2^{k}: {found:?}");
        // Negative controls: a quad that is too small by a millionth, and a quad without a normal.
        let small = failures(&mut prober, (k as f32).exp2(), |flat| flat.dual_u *= 1.000_001);
        assert!(small.misses > 0, "2^{k}: negative control not detected: a smaller quad");
        let broken = failures(&mut prober, (k as f32).exp2(), |flat| flat.normal = Vec3::ZERO);
        assert!(broken.misses > 0, "2^{k}: negative control not detected: no normal");
    }
    let outcome = if undefined == 0 { Outcome::Passed } else { Outcome::Bounded };
    report(
        23,
        subject,
        outcome,
        format!(
            "5400 perpendicular rays hit, within {worst} ulp; of 36000 in or along the plane {undefined} give a NaN"
        ),
    );
}

/// Perpendicular rays hit through the BVH, whose boxes are as flat as the quads except for their
/// padding.
fn t23_flat_boxes(subject: BackendUnderTest) {
    let flats = quads(1.0);
    let rays: Vec<(Vec3, Vec3, f32)> = flats.iter().flat_map(perpendicular).collect();
    let questions: Vec<Input> = rays.iter().map(|&(o, d, _)| ray(o, d)).collect();
    let shapes = flats.iter().map(|f| quad(f.origin, f.edge_u, f.edge_v)).collect();
    let mut scene = ProbeScene::new(&construct::scene(shapes, &[]));
    let wrong = |scene: &ProbeScene| -> Option<usize> {
        let outputs = Prober::with_scene(subject, scene)?.ask("probe_trace", CLOSEST, &questions);
        let is_wrong = |(output, (_, direction, want)): &(&Output, &(Vec3, Vec3, f32))| {
            let t = f32::from_bits(output.b.x);
            error(t, f64::from(*want)) > 2.5 || vector(output.a).dot(*direction).abs() != 1.0
        };
        Some(outputs.iter().zip(&rays).filter(is_wrong).count())
    };
    let Some(found) = wrong(&scene) else { return };
    assert_eq!(found, 0);
    // Negative control: boxes without their first tenth along y.
    for node in &mut scene.bvh.nodes {
        let size = node.y.w - node.y.y;
        node.y += Vec4::new(0.0, 0.1 * size, 0.0, 0.0);
    }
    let lost = wrong(&scene).unwrap_or_default();
    assert!(lost > 0, "negative control not detected: boxes are too small");
    report(
        23,
        subject,
        Outcome::Passed,
        format!("{} perpendicular rays through the BVH hit; boxes cut: {lost} miss", rays.len()),
    );
}

for_each_route!(t23_axis_aligned_quads, t23_flat_boxes);
