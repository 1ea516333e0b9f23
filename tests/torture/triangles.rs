//! Triangles: closed meshes have no holes (13), and degenerate triangles do no harm (28).

use crate::construct::{self, EPSILON, power, ray, rounds_correctly, unit, words};
use crate::mesh::{Mesh, crystal, rays};
use glam::{DVec3, Vec3};
use trisect_probes::record::{Input, Output, floats, row, vector};
use trisect_probes::shapes::{LEAKY_TRIANGLE, TRIANGLE};
use trisect_probes::trace::CLOSEST;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::sphere::MISS;
use trisect_shared::triangle::Triangle;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Returns a rugged rock of 2048 triangles.
fn rock() -> Mesh {
    let mut mesh = Mesh::octahedron();
    for _ in 0..4 {
        mesh = mesh.divided(normalize);
    }
    for v in &mut mesh.vertices {
        let w = words(1300, v.x.to_bits() ^ v.y.to_bits().rotate_left(11) ^ v.z.to_bits().rotate_left(22));
        *v *= 0.9 + 0.2 * unit_f32(w.x);
    }
    mesh
}

fn question(t: &Triangle, origin: Vec3, direction: Vec3) -> Input {
    Input {
        a: row(t.a, 0),
        b: row(t.b, 0),
        c: row(t.c, 0),
        d: row(origin, 0),
        e: row(direction, 0),
        ..Input::default()
    }
}

/// Returns how many rays meet none of the triangles by an operation on single triangles. Only
/// triangles near a ray are asked about; the ray misses the others by far.
fn leaks(prober: &mut Prober, operation: u32, mesh: &Mesh, rays: &[(Vec3, Vec3)]) -> usize {
    let triangles = mesh.triangles();
    let around = |t: &Triangle| {
        let middle = (t.a + t.b + t.c) / 3.0;
        let far = |v: Vec3| (v - middle).length();
        (middle, 1.01 * far(t.a).max(far(t.b)).max(far(t.c)))
    };
    let spheres: Vec<(Vec3, f32)> = triangles.iter().map(around).collect();
    let near = |o: Vec3, d: Vec3, (c, r): (Vec3, f32)| {
        let (f, d) = (c - o, normalize(d));
        let b = f.dot(d);
        b > -r && (f - d * b).length_squared() < r * r
    };
    let (mut questions, mut of) = (Vec::new(), Vec::new());
    for (i, &(o, d)) in rays.iter().enumerate() {
        for (t, &sphere) in triangles.iter().zip(&spheres) {
            if near(o, d, sphere) {
                questions.push(question(t, o, d));
                of.push(i);
            }
        }
    }
    let mut met = vec![false; rays.len()];
    for (output, i) in prober.ask("probe_shapes", operation, &questions).iter().zip(of) {
        met[i] |= floats(output.a).x < MISS;
    }
    met.iter().filter(|&&met| !met).count()
}

/// No ray from inside a closed mesh leaves it, neither by the BVH nor by each triangle.
///
/// The products whose order decides on which side of an edge a ray passes are correctly rounded on
/// every backend (Vulkan: "Precision of Core SPIR-V Instructions"), and neighbours shear a common
/// vertex by the same instructions, whatever the shear's quotient is. So the rule for edges holds
/// without correct division and under contraction. A box's exit is moved out by 8 ε, of which
/// Vulkan's division may take 7 (`EXIT_SCALE` of the shared crate's `slabs`), so the boxes lose
/// nothing either.
fn t13_closed_meshes(subject: BackendUnderTest) {
    let (rock, crystal) = (rock(), crystal());
    let mut of = 0;
    // `inside` is the radius of a ball inside the rock, or inside the crystal |x| + |y| + |z| < 1.
    for (name, mesh, inside) in [("rock", &rock, 0.5), ("crystal", &crystal, 0.57)] {
        let triangles: Vec<[Vec3; 3]> = mesh.triangles().iter().map(|t| [t.a, t.b, t.c]).collect();
        let scene = ProbeScene::new(&construct::scene(Vec::new(), &triangles));
        let Some(mut prober) = Prober::with_scene(subject, &scene) else { return };
        let rays = rays(mesh, inside, 100_000, 1);
        let questions: Vec<Input> = rays.iter().map(|&(o, d)| ray(o, d)).collect();
        let outputs = prober.ask("probe_trace", CLOSEST, &questions);
        let found = outputs.iter().filter(|output| output.a.w == NO_PRIMITIVE).count();
        assert_eq!(found, 0, "{name}: leaks through the BVH");
        of += rays.len();
    }
    let Some(mut prober) = Prober::new(subject) else { return };
    let rays = rays(&rock, 0.5, 0, 4);
    let found = leaks(&mut prober, TRIANGLE, &rock, &rays);
    assert_eq!(found, 0, "leaks between triangles");
    let twin = leaks(&mut prober, LEAKY_TRIANGLE, &rock, &rays);
    assert!(twin > 0, "negative control not detected: the form without a rule for edges");
    report(
        13,
        subject,
        Outcome::Passed,
        format!(
            "0 leaks of {of} rays; at vertices and edges 0 of {}, without a rule for edges {twin}",
            rays.len()
        ),
    );
}

/// Returns the distance between a ray's line and a segment, and between the ray's line and the
/// segment's line.
fn between(origin: DVec3, direction: DVec3, a: DVec3, b: DVec3) -> [f64; 2] {
    let seen = |v: DVec3| v - direction * (v.dot(direction) / direction.length_squared());
    let (from, along) = (seen(a - origin), seen(b - a));
    let square = along.length_squared();
    let share = if square > 0.0 { -from.dot(along) / square } else { 0.0 };
    [share.clamp(0.0, 1.0), share].map(|share| (from + along * share).length())
}

/// Returns triangles that are collinear, have a doubled vertex, or are needles of 10⁶ : 1.
fn degenerate() -> Vec<[Vec3; 3]> {
    let (p, q) = (Vec3::new(0.3, -0.7, 2.1), Vec3::new(1.9, 0.4, 2.9));
    let side = unit((q - p).cross(Vec3::X)) * ((q - p).length() * 1e-6);
    let (r, s) = (Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, 1.0, 4.0)); // exactly collinear with their middle
    vec![
        [p, p, p],
        [p, p, q],
        [p, q, q],
        [p, q, p],
        [p, q, (p + q) * 0.5],
        [p, q, p + (q - p) * 2.0],
        [r, s, (r + s) * 0.5],
        [p, q, p + (q - p) * 0.5 + side],
        [p, q, p + side],
    ]
}

/// Returns rays at a degenerate triangle's line; half of them pass it at a hundredth.
fn at_degenerate(corners: &[Vec3; 3], salt: u32) -> Vec<(Vec3, Vec3)> {
    let ray = |k: u32| {
        let (w, v) = (words(2800 + salt, k), words(2850 + salt, k));
        let origin = unit_sphere(w.x, w.y);
        let (from, to) = (corners[v.x as usize % 3], corners[v.x as usize / 3 % 3]);
        let on = from + (to - from) * (2.0 * unit_f32(w.z) - 0.5);
        let beside = on + unit_sphere(v.z, v.w) * if k.is_multiple_of(2) { 0.01 } else { 0.0 };
        (origin, normalize(beside - origin))
    };
    (0..20_000).map(ray).collect()
}

/// Counts of wrong answers about a degenerate triangle.
#[derive(Debug, Default)]
struct False {
    /// Number of answers that are not finite or not positive.
    undefined: usize,
    hits: usize,
    /// Maximum distance of a hit from the nearest line of an edge, in ε of the largest coordinate
    /// of a vertex relative to the origin.
    from_line: f64,
    /// Number of hits that are beyond the ends of the edges by more than the bound.
    beyond: usize,
}

fn false_hits(questions: &[Input], outputs: &[Output], bound: f64) -> False {
    let mut found = False::default();
    for (input, output) in questions.iter().zip(outputs) {
        let hit = floats(output.a);
        found.undefined += usize::from(!hit.is_finite() || hit.x <= 0.0);
        if hit.x == MISS {
            continue;
        }
        found.hits += 1;
        let (o, d) = (vector(input.d).as_dvec3(), vector(input.e).as_dvec3());
        let [a, b, c] = [input.a, input.b, input.c].map(|row| vector(row).as_dvec3());
        let reach = [a, b, c].map(|v| (v - o).abs().max_element()).into_iter().fold(0.0, f64::max);
        let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| between(o, d, from, to));
        let nearest =
            |which: usize| edges.iter().map(|e| e[which]).fold(f64::MAX, f64::min) / (EPSILON * reach);
        found.from_line = found.from_line.max(nearest(1));
        // Needles are a dozen ε thick, so that an edge is within that distance inside of one.
        found.beyond += usize::from(nearest(0) > bound);
    }
    found
}

/// Each answer is a number, and no hit is farther beside the triangle than rounding explains.
///
/// A sheared coordinate is the difference of a vertex (1 rounding) and a product of the shear (3:
/// quotient, product, and the depth's own), rounded: 5 roundings of ε / 2 in x and y each, which is
/// √2 · 2.5 ε of the largest distance. On Vulkan the quotient is off by 2.5 ULP, 2 more: √2 · 4.5.
/// A triangle with a doubled vertex is never met where nothing is contracted, because its edge
/// functions are opposite to the bit.
///
/// One outcome is only bounded. Products of an edge function that round to the same number count as
/// on the edge. Where that is so for all three, because the triangle is a line or is seen edge-on
/// and the ray passes through that line, the ray may meet the triangle beyond its ends. Woop et al.
/// use double precision there, which is optional on Vulkan.
fn t28_degenerate_triangles(subject: BackendUnderTest) {
    let Some(mut prober) = Prober::new(subject) else { return };
    let bound = 2f64.sqrt() * if rounds_correctly(subject) { 2.5 } else { 4.5 };
    let (mut all, mut of, mut twin) = (False::default(), 0, 0.0f64);
    for (salt, corners) in (0..).zip(degenerate()) {
        let [a, b, c] = corners;
        let t = Triangle::of([a, b, c]);
        let rays = at_degenerate(&corners, salt);
        let questions: Vec<Input> = rays.iter().map(|&(o, d)| question(&t, o, d)).collect();
        let outputs = prober.ask("probe_shapes", TRIANGLE, &questions);
        let found = false_hits(&questions, &outputs, bound);
        assert!(found.undefined == 0 && found.from_line <= bound, "{corners:?}: {found:?}");
        assert!(
            salt > 3 || found.hits == 0 || subject == BackendUnderTest::WgpuNaga,
            "{corners:?}: {found:?}"
        );
        (all.hits, of, all.beyond) = (all.hits + found.hits, of + questions.len(), all.beyond + found.beyond);
        all.from_line = all.from_line.max(found.from_line);
        // Negative control: a triangle that is wider by a thousandth.
        let c = c + unit((b - a).cross(Vec3::X) + Vec3::Y * 1e-3) * 1e-3;
        let wider: Vec<Input> = rays.iter().map(|&(o, d)| question(&Triangle { c, ..t }, o, d)).collect();
        let outputs = prober.ask("probe_shapes", TRIANGLE, &wider);
        twin = twin.max(false_hits(&questions, &outputs, bound).from_line);
    }
    assert!(twin > bound, "negative control not detected: a wider triangle, {twin}");
    let outcome = if all.beyond == 0 { Outcome::Passed } else { Outcome::Bounded };
    let False { hits, from_line, beyond, .. } = all;
    report(
        28,
        subject,
        outcome,
        format!(
            "{hits} of {of} rays meet one, at most {from_line:.1} eps beside its line, {beyond} of them beyond its ends; no NaN"
        ),
    );
}

/// Returns triangles of every size that have almost no area: collinear within rounding, needles,
/// and triangles whose normal's square is near the smallest normal number.
fn slivers() -> Vec<[Vec3; 3]> {
    let sliver = |i: u32| {
        let (w, v) = (words(2870, i), words(2871, i));
        let size = if i.is_multiple_of(4) { power(-9.8, -9.0, w.x) } else { power(-6.0, 2.0, w.x) };
        let a = unit_sphere(w.y, w.z) * size;
        let b = unit_sphere(v.x, v.y) * size;
        let share = unit_f32(v.z);
        let beside = if i.is_multiple_of(4) { 1.0 } else { [0.0, 0.0, 1e-7, 1e-6][v.w as usize % 4] };
        [a, b, a + (b - a) * share + unit_sphere(w.w, v.w) * (size * beside)]
    };
    (0..4096).map(sliver).collect()
}

/// No NaN normal reaches shading. Triangles without area in single precision are dropped at load
/// with a warning, and all others have a unit normal wherever they are met. Where a backend flushes
/// denormals, as Vulkan allows, a sum of three squares just above the smallest normal number may
/// vanish.
fn t28_normals(subject: BackendUnderTest) {
    let slivers = slivers();
    let loaded = construct::scene(Vec::new(), &slivers);
    let dropped = slivers.len() - loaded.triangles.len();
    assert!(dropped > 100 && loaded.triangles.len() > 1000, "{dropped} dropped");
    let warning = format!("{dropped} triangles have no area");
    assert!(loaded.warnings.iter().any(|text| text.contains(&warning)), "{:?}", loaded.warnings);
    // Negative control: no triangle is dropped.
    let mut all = loaded.clone();
    all.triangles = slivers.iter().map(|corners| Triangle::of(*corners)).collect();
    // Traces one ray at each triangle.
    let bad_normals = |scene: &trisect::scene::Scene| -> Option<(usize, usize)> {
        let scene = ProbeScene::new(scene);
        let triangles = &scene.scene.triangles;
        let mut prober = Prober::with_scene(subject, &scene)?;
        let (mut bad, mut hits) = (0, 0);
        let mut questions = Vec::new();
        for (i, t) in (0..).zip(triangles) {
            let w = words(2872, i);
            let (along, size) = (unit_f32(w.x), (t.b - t.a).length());
            let target = t.a + (t.b - t.a) * along;
            let target = target + (t.c - target) * [0.0, 0.01, 0.3][w.y as usize % 3];
            let origin = target + unit_sphere(w.z, w.w) * size;
            questions.push(ray(origin, unit(target - origin)));
        }
        for output in prober.ask("probe_trace", CLOSEST, &questions) {
            if output.a.w == NO_PRIMITIVE {
                continue;
            }
            hits += 1;
            let square = triangles[output.a.w as usize].normal().length_squared();
            let t = &triangles[output.a.w as usize];
            let extent = (t.b - t.a).abs().max_element().max((t.c - t.a).abs().max_element());
            // Edges that are denormal, or whose reciprocal is infinite, where a device may flush
            // denormals.
            let may_flush = !rounds_correctly(subject) && extent < 1e-30
                || !rounds_correctly(subject) && square < Triangle::MIN_SQUARE && square > 0.0;
            let length = vector(output.a).as_dvec3().length();
            bad += usize::from((length.is_nan() || (length - 1.0).abs() > 1e-6) && !may_flush);
        }
        Some((bad, hits))
    };
    let Some((bad, hits)) = bad_normals(&loaded) else { return };
    assert!(bad == 0 && hits > 500, "{bad} normals of {hits}");
    let (bad, _) = bad_normals(&all).unwrap_or_default();
    // Where a compiler may contract, the product of parallel edges is a rounding error instead of
    // zero.
    assert!(bad > 0 || subject == BackendUnderTest::WgpuNaga, "negative control not detected");
    report(
        28,
        subject,
        Outcome::Passed,
        format!(
            "{dropped} of {} slivers dropped at load; unit normals at {hits} hits of the others; kept, {bad} hits have none",
            slivers.len()
        ),
    );
}

for_each_route!(t13_closed_meshes, t28_degenerate_triangles, t28_normals);
