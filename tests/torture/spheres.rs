//! Single spheres: far away (11), edge cases (26), and as a ground (30).

use crate::construct::{EPSILON, first, power, rounds_correctly, unit, words};
use crate::exact;
use glam::Vec3;
use trisect::scene::Scene;
use trisect_probes::record::{Input, Output, row, vector};
use trisect_probes::shapes::{NAIVE_SPHERE, PLANAR, PROJECT, SPHERE};
use trisect_shared::math::{unit_f32, unit_sphere};
use trisect_shared::sphere::{MISS, Sphere};
use trisect_tests::probe::Prober;
use trisect_tests::report::{Outcome, report};
use trisect_tests::ulp::{error, ulp};
use trisect_tests::{BackendUnderTest, for_each_route};

/// A sphere, and a ray that starts in free space.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub sphere: Sphere,
    pub origin: Vec3,
    pub direction: Vec3,
}

impl Case {
    pub fn new(center: Vec3, radius: f32, origin: Vec3, direction: Vec3) -> Self {
        Self { sphere: Sphere { center, radius, material: 0, pad: [0; 3] }, origin, direction }
    }

    pub fn exactly(&self) -> exact::Meeting {
        exact::sphere(&self.sphere, self.origin, self.direction)
    }

    /// Returns the question for [`SPHERE`]. With `departs` the ray leaves the sphere itself, inward
    /// if true and outward if false.
    fn question(&self, departs: Option<bool>) -> Input {
        Input {
            a: row(self.sphere.center, self.sphere.radius.to_bits()),
            b: row(self.origin, 0),
            c: row(self.direction, 0),
            d: [u32::from(departs.is_some()), u32::from(departs == Some(true)), 0, 0].into(),
            ..Input::default()
        }
    }
}

/// Runs a sphere operation of the probe on all cases.
pub fn ask(prober: &mut Prober, operation: u32, cases: &[Case]) -> Vec<Output> {
    let questions: Vec<Input> = cases.iter().map(|case| case.question(None)).collect();
    prober.ask("probe_shapes", operation, &questions)
}

/// Returns spheres of radius 1 at distances of 10² to 10⁵. The ray's origin or the sphere's centre
/// is 0, so that their difference is exact: rounding in it would move the sphere itself, and no
/// intersection could correct that.
fn far_spheres() -> Vec<Case> {
    let case = |i: u32| {
        let w = words(1100, i);
        let axis = unit_sphere(w.x, w.y);
        let side = unit(axis.cross(Vec3::new(0.36, 0.48, 0.8)));
        let to_center = axis * power(2.0, 5.0, w.z) + side * unit_f32(w.w);
        let case = if i & 1 == 0 {
            Case::new(to_center, 1.0, Vec3::ZERO, axis)
        } else {
            Case::new(Vec3::ZERO, 1.0, -to_center, axis)
        };
        // Both are exact for the rounded numbers.
        (case.exactly().distance.is_finite() && case.exactly().margin > 0.005).then_some(case)
    };
    (0..1 << 17).filter_map(case).collect()
}

/// Returns the number of misses, and the maximum error of a hit in ULP of the distance D to the
/// centre.
fn far_errors(cases: &[Case], outputs: &[Output]) -> (u32, f64) {
    let (mut misses, mut worst) = (0, 0.0f64);
    for (case, output) in cases.iter().zip(outputs) {
        let (t, want) = (first(output), case.exactly().distance);
        let distance = (case.sphere.center.as_dvec3() - case.origin.as_dvec3()).length();
        if t < MISS {
            worst = worst.max((f64::from(t) - want).abs() / ulp(distance));
        } else {
            misses += 1;
        }
    }
    (misses, worst)
}

/// No far sphere is missed, and the error of t is at most 16 ULP of D on every backend. c and q
/// take about 10 roundings of half a unit. Vulkan's division adds 2.5 ULP of the quotient, and its
/// square root's error is that of a number as large as the radius.
fn t11_far_spheres(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let cases = far_spheres();
    let (misses, worst) = far_errors(&cases, &ask(&mut prober, SPHERE, &cases));
    assert!(misses == 0 && worst <= 16.0, "{misses} misses, {worst} ulp");
    let (naive, _) = far_errors(&cases, &ask(&mut prober, NAIVE_SPHERE, &cases));
    assert!(naive > 0, "the test does not reach the naive form's failure");
    report(
        11,
        subject,
        Outcome::Passed,
        format!(
            "{misses} of {} missed, error of t at most {worst:.1} ulp(D); naive form: {naive} missed",
            cases.len()
        ),
    );
}

/// Returns by how much an answer lies off the sphere, or by how much a miss should have been a hit,
/// in units of ε (R + |O - C|); infinite unless the answer is a number in front of the ray.
pub fn residual(case: &Case, t: f32) -> f64 {
    let f = case.origin.as_dvec3() - case.sphere.center.as_dvec3();
    let (d, radius) = (case.direction.as_dvec3(), f64::from(case.sphere.radius));
    let unit = EPSILON * (radius + f.length());
    if t == MISS {
        let exactly = case.exactly();
        return if exactly.distance.is_finite() { exactly.margin / unit } else { 0.0 };
    }
    if t > 0.0 && t < MISS { ((f + d * f64::from(t)).length() - radius).abs() / unit } else { f64::INFINITY }
}

/// Returns rays from the centre; from the surface inward, outward and along it; and past the sphere
/// at its radius, one ULP less and one ULP more.
fn edge_cases(prober: &mut Prober) -> Vec<Case> {
    let mut cases = Vec::new();
    for i in 0..1 << 14 {
        let (w, v) = (words(2600, i), words(2601, i));
        let center = unit_sphere(w.x, w.y) * power(-3.0, 3.0, w.z) * (i & 1) as f32;
        let radius = power(-3.0, 3.0, w.w);
        let direction = unit_sphere(v.x, v.y);
        cases.push(Case::new(center, radius, center, direction));
        // Exactly on the surface: along an axis of a sphere around 0.
        let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z][i as usize % 3];
        for way in [-axis, axis, unit(axis.cross(direction)), direction] {
            cases.push(Case::new(Vec3::ZERO, radius, axis * radius, way));
        }
        let side = Vec3::new(axis.y, axis.z, axis.x).abs();
        for impact in [radius.next_down(), radius, radius.next_up()] {
            let back = axis * -(radius * power(-2.0, 2.0, v.z));
            cases.push(Case::new(Vec3::ZERO, radius, back + side * impact, axis));
        }
    }
    // On the surface, as the path tracer projects hits.
    let project: Vec<Input> = (0..1 << 14)
        .map(|i| {
            let (w, v) = (words(2602, i), words(2603, i));
            let center = unit_sphere(w.x, w.y) * power(-3.0, 3.0, w.z);
            let radius = power(-3.0, 3.0, w.w);
            let near = center + unit_sphere(v.x, v.y) * radius;
            Input {
                a: row(center, radius.to_bits()),
                b: row(near, 0),
                c: row(Vec3::X, 0),
                ..Input::default()
            }
        })
        .collect();
    for (i, (input, output)) in (0..).zip(project.iter().zip(prober.ask("probe_shapes", PROJECT, &project))) {
        let w = words(2604, i);
        let (center, point) = (vector(input.a), vector(output.b));
        cases.push(Case::new(center, f32::from_bits(input.a.w), point, unit_sphere(w.x, w.y)));
    }
    cases
}

/// Returns how many rays that start exactly on the sphere and go inward do not leave it on the
/// opposite side.
fn not_inside(cases: &[Case], outputs: &[Output]) -> usize {
    let wrong = |case: &Case, t: f32| {
        let f = case.origin.as_dvec3() - case.sphere.center.as_dvec3();
        let (b, radius) = (-f.dot(case.direction.as_dvec3()), f64::from(case.sphere.radius));
        f.length() == radius && b > 0.01 * radius && (f64::from(t) - 2.0 * b).abs() > 0.01 * radius
    };
    cases.iter().zip(outputs).filter(|(case, output)| wrong(case, first(output))).count()
}

/// The answer is the documented root, a number in front of the ray that lies on the sphere, or
/// [`MISS`] where no ray within rounding hits. An origin on the surface counts as inside.
///
/// The roundings of b, the offset and c amount to 8 units. Vulkan's division and square root add
/// 2.5 and 4.5 ULP of t, which is at most twice as large as a unit. Where a compiler may contract,
/// c = f² - R² need not vanish on the surface.
fn t26_edges_of_spheres(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let cases = edge_cases(&mut prober);
    let worst = |outputs: &[Output]| {
        let residuals = cases.iter().zip(outputs).map(|(case, output)| residual(case, first(output)));
        residuals.fold(0.0, f64::max)
    };
    let outputs = ask(&mut prober, SPHERE, &cases);
    let (robust, outside) = (worst(&outputs), not_inside(&cases, &outputs));
    let bound = if rounds_correctly(subject) { 8.0 } else { 8.0 + 14.0 };
    assert!(robust <= bound, "{robust}");
    assert!(outside == 0 || subject == BackendUnderTest::WgpuNaga, "{outside} do not count as inside");
    // Negative control: the naive form finds the near root where it is 0, or behind the origin.
    let outputs = ask(&mut prober, NAIVE_SPHERE, &cases);
    assert!(worst(&outputs) > bound, "negative control not detected: the naive form");
    assert!(
        not_inside(&cases, &outputs) == 0 || subject == BackendUnderTest::WgpuNaga,
        "the negative control fails in another way"
    );
    let outcome = if outside == 0 { Outcome::Passed } else { Outcome::Bounded };
    let count = cases.len();
    report(
        26,
        subject,
        outcome,
        format!(
            "{count} rays: each root at most {robust:.2} eps (R + |O - C|) off the sphere; {outside} from the surface do not count as inside"
        ),
    );
}

/// Returns rays that look down at various angles from 1 above the ground, a sphere of radius
/// `radius` below 0, within `around` of its top.
fn grounds(radius: f32, around: f32) -> Vec<Case> {
    let case = |i: u32| {
        let (w, v) = (words(3000, i), words(3001, i));
        let [x, z] = [w.x, w.y].map(|bits| around * (2.0 * unit_f32(bits) - 1.0));
        let r = f64::from(radius);
        let ground = (r * r - f64::from(x * x + z * z)).sqrt() - r;
        let down = unit_sphere(v.x, v.y);
        let down = unit(Vec3::new(down.x, -down.y.abs() - 0.3, down.z));
        Case::new(Vec3::new(0.0, -radius, 0.0), radius, Vec3::new(x, (ground + 1.0) as f32, z), down)
    };
    (0..1 << 14).map(case).collect()
}

/// The error of t from an eye at height 1 is at most 2 ε R over a spherical ground of radius R, and
/// that of one quotient over a plane.
///
/// The sphere's c = f² - R² is about 2 R. Its 4 roundings of R² (ε / 2 each) give an error of ε R
/// relative to t. The rounding of O - C, half an ULP of R, gives ε R / 2 of the height. Division
/// and square root, on Vulkan too, add a few ε. The plane's t is the quotient of the eye's height
/// and the direction's y: correctly rounded, or within 2.5 ULP on Vulkan.
fn t30_ground(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let plane = {
        let text = "Scene(version: 1, image: (width: 1, height: 1), materials: {\"a\": Lambertian(albedo: (1, 1, 1))},
            objects: [Plane(point: (0, 0, 0), normal: (0, 1, 0), material: \"a\")],
            camera: (look_from: (0, 1, 3), look_at: (0, 1, 0), vertical_fov: 60))";
        Scene::parse(text, "plane.ron").expect("a plane").flats[0]
    };
    let mut figures = Vec::new();
    for radius in [1e3f32, 1e4, 1e5, 1e6] {
        let cases = grounds(radius, 50.0);
        let spheres = ask(&mut prober, SPHERE, &cases);
        let relative = |cases: &[Case], outputs: &[Output]| {
            let error = |case: &Case, t: f32| (f64::from(t) / case.exactly().distance - 1.0).abs();
            cases.iter().zip(outputs).map(|(case, output)| error(case, first(output))).fold(0.0, f64::max)
        };
        let worst = relative(&cases, &spheres);
        assert!(worst <= 2.0 * EPSILON * f64::from(radius), "R = {radius:e}: {worst:e}");
        let top = grounds(radius, 0.0);
        let top = relative(&top, &ask(&mut prober, SPHERE, &top));
        let planes: Vec<Input> = cases
            .iter()
            .map(|case| Input {
                a: row(plane.origin, plane.kind),
                b: row(plane.normal, 0),
                c: row(plane.dual_u, 0),
                d: row(plane.dual_v, 0),
                e: row(Vec3::new(case.origin.x, 1.0, case.origin.z), 0),
                f: row(case.direction, 0),
                ..Input::default()
            })
            .collect();
        let ulps = |t: f32, case: &Case| error(t, 1.0 / f64::from(-case.direction.y));
        let planes = prober.ask("probe_shapes", PLANAR, &planes);
        let flat =
            planes.iter().zip(&cases).map(|(output, case)| ulps(first(output), case)).fold(0.0, f64::max);
        let bound = if rounds_correctly(subject) { 0.5 } else { 2.5 };
        assert!(flat <= bound, "plane: {flat} ulp");
        // Negative control: the sphere is no substitute for a plane.
        let bent =
            spheres.iter().zip(&cases).map(|(output, case)| error(first(output), case.exactly().distance));
        assert!(bent.fold(0.0, f64::max) > 100.0, "R = {radius:e}: control not detected");
        figures.push(format!(
            "R = {radius:.0e}: {top:.1e} at its top, {worst:.1e} within 50, plane {flat:.2} ulp"
        ));
    }
    report(30, subject, Outcome::Passed, format!("relative error of t at most, {}", figures.join("; ")));
}

for_each_route!(t11_far_spheres, t26_edges_of_spheres, t30_ground);
