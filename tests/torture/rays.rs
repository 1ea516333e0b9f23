//! Rays through the BVH, compared with a test of each primitive: adversarial rays (9), rays through
//! thin slabs (24), and rays with tiny components (25).

use crate::construct::{self, EPSILON, disc, power, quad, ray, rounds_correctly, sphere, unit, words};
use crate::exact::{self, Meeting};
use glam::{Vec3, Vec4};
use trisect_probes::record::{Input, Output, vector};
use trisect_probes::trace::{CLOSEST, LINEAR};
use trisect_shared::bvh::{BvhNode, Child, NO_PRIMITIVE};
use trisect_shared::math::{basis, unit_f32, unit_sphere};
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::ulp::error;
use trisect_tests::{BackendUnderTest, for_each_route, for_each_translation};

/// Returns a number from -1 to 1.
fn signed(bits: u32) -> f32 {
    2.0 * unit_f32(bits) - 1.0
}

/// Returns 20 primitives of each kind within 8 of the origin, with sizes from 0.003 to 3. Half of
/// them are random. The others are on a grid and along axes, so that faces, edges and boxes
/// coincide. A quarter occurs twice at the same place.
fn mixed() -> ProbeScene {
    let (mut shapes, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..16 {
        let [w, v, x, y] = [0, 1, 2, 3].map(|k| words(900 + k, i));
        let place = |w: trisect_shared::rng::Words| {
            let place = Vec3::new(signed(w.x), signed(w.y), signed(w.z)) * 8.0;
            if i % 2 == 0 { place } else { place.round() }
        };
        let size = |bits: u32| if i % 2 == 0 { power(-2.5, 0.5, bits) } else { 1.0 };
        let axis =
            |bits: u32| if i % 2 == 0 { unit_sphere(bits, !bits) } else { Vec3::AXES[bits as usize % 3] };
        for _ in 0..if i % 8 < 2 { 2 } else { 1 } {
            shapes.push(sphere(place(w), size(w.w)));
            let (a, b) = basis(axis(v.w));
            shapes.push(quad(place(v), a * size(w.x), b * size(w.y)));
            shapes.push(disc(place(x), axis(x.w), size(v.x)));
            let (a, b) = basis(axis(y.w));
            triangles.push([place(y), place(y) + a * size(v.y), place(y) + b * size(v.z)]);
        }
    }
    ProbeScene::new(&construct::scene(shapes, &triangles))
}

/// Returns the box of a node's first or second child.
fn child_box(node: &BvhNode, second: bool) -> (Vec3, Vec3) {
    node.boxes()[usize::from(second)]
}

/// Returns rays that start on faces of boxes, one in four on an edge. Their directions have
/// components from `components` and are normalised.
fn adversarial(scene: &ProbeScene, count: u32, components: &[f32], stream: u32) -> Vec<Input> {
    let question = |i: u32| {
        let (w, v) = (words(stream, i), words(stream + 1, i));
        let node = &scene.bvh.nodes[w.x as usize % scene.bvh.nodes.len()];
        let (low, high) = child_box(node, w.y & 1 == 1);
        let side = |k: u32| if v.x >> k & 1 == 1 { low } else { high };
        let share = Vec3::new(unit_f32(v.y), unit_f32(v.z), unit_f32(v.w));
        let mut origin = low + (high - low) * share;
        let axis = (w.y >> 1) as usize % 3;
        origin[axis] = side(0)[axis];
        if w.y >> 8 & 3 == 0 {
            origin[(axis + 1) % 3] = side(1)[(axis + 1) % 3];
        }
        let component = |shift: u32| components[(w.z >> shift & 0xff) as usize % components.len()];
        let mut direction = Vec3::new(component(0), component(8), component(16));
        if direction.abs().max_element() < 1e-9 {
            direction[w.w as usize % 3] = if w.w >> 31 == 1 { 1.0 } else { -1.0 };
        }
        ray(origin, unit(direction))
    };
    (0..count).map(question).collect()
}

/// Intersects a ray with a primitive by double precision.
fn exactly(scene: &ProbeScene, primitive: u32, input: &Input) -> Meeting {
    let (origin, direction) = (vector(input.a), vector(input.b));
    let (records, params) = (scene.records(), scene.params());
    let index = primitive as usize;
    if primitive >= params.first_triangle {
        exact::triangle(&records.triangles[index - params.first_triangle as usize], origin, direction)
    } else if primitive >= params.first_planar {
        exact::flat(&records.planars[index - params.first_planar as usize], origin, direction)
    } else {
        exact::sphere(&records.spheres[index], origin, direction)
    }
}

/// Counts of differences between the BVH's answers and those of a test of each primitive.
#[derive(Clone, Copy, Debug, Default)]
struct Comparison {
    hits: usize,
    /// Another primitive at the same distance, bit by bit.
    ties: usize,
    /// Another answer, where rounding may decide: the ray passes the border of a primitive that one
    /// of them names, or starts at it, within 16 ε of the coordinates, or the distances differ by
    /// less than that.
    borders: usize,
    /// Any other difference.
    wrong: usize,
}

fn compare(scene: &ProbeScene, questions: &[Input], closest: &[Output], every: &[Output]) -> Comparison {
    let mut found = Comparison::default();
    for ((input, a), b) in questions.iter().zip(closest).zip(every) {
        found.hits += usize::from(b.a.w != NO_PRIMITIVE);
        if a.b.x == b.b.x {
            found.ties += usize::from(a.a.w != b.a.w);
            continue;
        }
        let distances = [a.b.x, b.b.x].map(f32::from_bits);
        // The distance of a miss is too large for this.
        let reach = vector(input.a).abs().max_element().max(8.0) + distances[0].min(distances[1]);
        let near = 16.0 * EPSILON * f64::from(reach);
        let named = [a.a.w, b.a.w].into_iter().filter(|&primitive| primitive != NO_PRIMITIVE);
        let at_border = named.into_iter().any(|primitive| exactly(scene, primitive, input).margin < near)
            || f64::from((distances[0] - distances[1]).abs()) < near;
        *(if at_border { &mut found.borders } else { &mut found.wrong }) += 1;
    }
    found
}

/// Asks for closest hits with and without the BVH; `None` if the backend is missing.
fn both(subject: BackendUnderTest, scene: &ProbeScene, questions: &[Input]) -> Option<Comparison> {
    let mut prober = Prober::with_scene(subject, scene)?;
    let closest = prober.ask("probe_trace", CLOSEST, questions);
    let every = prober.ask("probe_trace", LINEAR, questions);
    Some(compare(scene, questions, &closest, &every))
}

/// Compares rays with and without the BVH, and asserts that CPU and CUDA have the same answers, bit
/// by bit.
///
/// On Vulkan a quotient is off by up to 2.5 ULP, and naga's code may be contracted in one loop and
/// not in the other. There, a ray that passes a border within rounding may have either answer; no
/// other may differ.
fn same_as_brute_force(
    subject: BackendUnderTest,
    scene: &ProbeScene,
    questions: &[Input],
) -> Option<Comparison> {
    let found = both(subject, scene, questions)?;
    assert!(found.hits > questions.len() / 10, "the rays miss everything: {found:?}");
    assert!(found.wrong == 0 && (found.borders == 0 || !rounds_correctly(subject)), "{found:?}");
    Some(found)
}

fn tell(number: u32, subject: BackendUnderTest, questions: &[Input], found: Comparison) {
    let Comparison { hits, ties, borders, .. } = found;
    let outcome = if borders == 0 { Outcome::Passed } else { Outcome::Bounded };
    report(
        number,
        subject,
        outcome,
        format!(
            "{} rays, {hits} hits: t and primitive as without the BVH; {ties} name another primitive at the same t, {borders} differ at a border",
            questions.len()
        ),
    );
}

/// A million adversarial rays have the hits that a test of each primitive finds.
fn t09_brute_force(subject: BackendUnderTest) {
    let scene = mixed();
    let questions = adversarial(&scene, 1_000_000, &[0.0, -0.0, 1e-8, 1e-38, 1.0, -1.0], 910);
    let Some(found) = same_as_brute_force(subject, &scene, &questions) else { return };
    // Negative controls: a leaf is lost; the root's boxes lose half. (A ray that is perpendicular
    // to an axis does not notice what is cut along it.)
    let few = &questions[..20_000];
    let mut lost = scene.clone();
    let leaf = Child::leaf(scene.params().first_planar - 1).0; // a sphere without a copy
    for node in &mut lost.bvh.nodes {
        if node.first == leaf {
            node.first = node.second;
        } else if node.second == leaf {
            node.second = node.first;
        }
    }
    let mut cut = scene.clone();
    let node = &mut cut.bvh.nodes[0];
    halve(node);
    for (name, broken) in [("a leaf", lost), ("half of each box", cut)] {
        let twin = both(subject, &broken, few).unwrap_or_default();
        assert!(twin.wrong > 0, "without {name}: {twin:?}");
    }
    tell(9, subject, &questions, found);
}

/// Removes the upper half along each axis from both boxes.
fn halve(node: &mut BvhNode) {
    for row in [&mut node.x, &mut node.y, &mut node.z] {
        *row = Vec4::new(row.x - 0.5 * row.z, row.y - 0.5 * row.w, 0.5 * row.z, 0.5 * row.w);
    }
}

/// Rays with zero, denormal or tiny direction components have the hits that a test of each
/// primitive finds.
fn t25_tiny_components(subject: BackendUnderTest) {
    let scene = mixed();
    let components = [0.0, -0.0, 1e-45, -1e-45, 1e-20, -1e-20, 1.0, -0.6];
    let questions = adversarial(&scene, 100_000, &components, 920);
    let Some(found) = same_as_brute_force(subject, &scene, &questions) else { return };
    // Negative control: the boxes of the root's children without the upper half along each axis.
    let mut cut = scene.clone();
    let node = &mut cut.bvh.nodes[0];
    halve(node);
    let twin = both(subject, &cut, &questions[..20_000]).unwrap_or_default();
    assert!(twin.wrong > 0, "without half of the boxes: {twin:?}");
    tell(25, subject, &questions, found);
}

/// Returns a vector by its components along the flight, across the slab, and along the slab; the
/// flight is along axis `axis`.
fn turned(axis: usize, flight: f32, across: f32, along: f32) -> Vec3 {
    let mut v = Vec3::ZERO;
    (v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]) = (flight, across, along);
    v
}

/// Returns one primitive of each kind at 100 along each axis, which extends by `half` to either
/// side across.
fn slabs(half: f32) -> ProbeScene {
    let (mut shapes, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        let at = |across: f32, along: f32| turned(axis, 100.0, across, along);
        shapes.push(sphere(at(0.0, 0.0), half));
        shapes.push(quad(at(-half, 9.0), turned(axis, 0.0, 2.0 * half, 0.0), turned(axis, 0.0, 0.0, 2.0)));
        shapes.push(disc(at(0.0, 20.0), turned(axis, 1.0, 0.0, 0.0), half));
        triangles.push([at(-half, 29.0), at(half, 29.0), at(0.0, 31.0)]);
    }
    ProbeScene::new(&construct::scene(shapes, &triangles))
}

/// A ray along an axis, inside a slab of 2e-6 or less, meets what stands in the slab at 100. A
/// reciprocal of zero that is only as large as 8.4e6 would end it at 8.4. Each kind's distance has
/// few roundings, so 16 ULP are allowed as for far spheres.
fn t24_thin_slabs(subject: BackendUnderTest) {
    let (mut count, mut lost) = (0, 0);
    for half in [1e-6f32, 1e-12, 1e-14] {
        let mut questions = Vec::new();
        for i in 0..3 * 4 * 4 * 16u32 {
            let (axis, kind) = (i as usize % 3, i / 3 % 4);
            let zero = |bit: u32| if (i / 12) >> bit & 1 == 1 { -0.0 } else { 0.0 };
            let across = 0.4 * half * signed(words(930, i).x);
            let origin = turned(axis, 0.0, across, 10.0 * kind as f32);
            questions.push(ray(origin, turned(axis, 1.0, zero(0), zero(1))));
        }
        let misses = |scene: &ProbeScene| -> Option<usize> {
            let outputs = Prober::with_scene(subject, scene)?.ask("probe_trace", CLOSEST, &questions);
            let is_hit = |output: &&Output| error(f32::from_bits(output.b.x), 100.0) <= 16.0;
            Some(questions.len() - outputs.iter().filter(is_hit).count())
        };
        let mut scene = slabs(half);
        let Some(missed) = misses(&scene) else { return };
        assert_eq!(missed, 0, "half thickness {half:e}");
        count += questions.len();
        // Negative control: each primitive's box is behind the rays.
        for node in &mut scene.bvh.nodes {
            let [first, second] = [node.first, node.second].map(|child| Child(child).is_leaf());
            for row in [&mut node.x, &mut node.y, &mut node.z] {
                row.x = if first { -row.x } else { row.x };
                row.y = if second { -row.y } else { row.y };
            }
        }
        lost += misses(&scene).unwrap_or_default();
    }
    assert!(lost > count / 4, "boxes behind are entered: {lost} of {count}");
    report(
        24,
        subject,
        Outcome::Passed,
        format!("{count} rays hit at 100, in slabs of 2e-6, 2e-12 and 2e-14; boxes behind: {lost} miss"),
    );
}

for_each_translation!(t09_brute_force);
for_each_route!(t24_thin_slabs, t25_tiny_components);
