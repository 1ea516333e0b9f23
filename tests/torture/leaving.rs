//! Test 12: a ray that leaves a surface does not meet it again, whatever its size and place (after
//! pbrt's test "Reintersect").

use crate::construct::{self, EPSILON, disc, power, ray, sphere, unit, words};
use glam::{DVec3, Vec3};
use trisect::scene::description::ShapeKind;
use trisect_probes::record::{Input, Output, row, vector};
use trisect_probes::trace::{LEAVE_SURFACE, LEAVE_WITHOUT_OFFSET};
use trisect_shared::bvh::{BvhNode, Child, NO_PRIMITIVE};
use trisect_shared::math::{basis, unit_f32, unit_sphere};
use trisect_shared::planar::DISC;
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Number of objects of each kind.
const OBJECTS: u32 = 48;
/// Number of rays that leave each object.
const RAYS: u32 = 1000;

/// Returns a direction on the side of `normal`; one in four runs almost along the surface.
fn outward(normal: Vec3, i: u32, stream: u32) -> Vec3 {
    let w = words(stream, i);
    let d = unit_sphere(w.x, w.y);
    let lift = if w.z.is_multiple_of(4) { 1e-3 } else { 1.0 };
    unit(d - normal * d.dot(normal) + normal * (d.dot(normal).abs() * lift + 1e-6))
}

/// Returns spheres, quads, discs and triangles with sizes of 10⁻⁴ to 10⁴, at distances of 10⁻⁸ to
/// 10⁸ from the origin.
fn objects() -> ProbeScene {
    let (mut shapes, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..OBJECTS {
        let [w, v] = [words(1200, i), words(1201, i)];
        let size = power(-4.0, 4.0, w.x);
        let place = unit_sphere(w.y, w.z) * power(-8.0, 8.0, w.w);
        // Some flat shapes are perpendicular to an axis, so that all their points have one
        // coordinate in common.
        let axis = if i % 4 == 0 { Vec3::AXES[v.w as usize % 3] } else { unit_sphere(v.x, v.y) };
        let (a, b) = basis(axis);
        shapes.push(sphere(place, size));
        shapes.push(construct::quad(place, a * size, b * size * power(-1.0, 1.0, v.z)));
        shapes.push(disc(place, axis, size));
        triangles.push([place, place + a * size, place + (a * 0.3 + b) * size]);
    }
    ProbeScene::new(&construct::scene(shapes, &triangles))
}

/// Returns a point of a primitive for a ray to arrive at, the normal there, and the primitive's
/// size.
fn target(scene: &ProbeScene, primitive: u32, i: u32) -> (Vec3, Vec3, f32) {
    let (records, params, w) = (scene.records(), scene.params(), words(1202, i));
    let index = primitive as usize;
    let (u, v) = (unit_f32(w.x), unit_f32(w.y));
    if primitive >= params.first_triangle {
        let t = records.triangles[index - params.first_triangle as usize];
        let (ab, ac) = (t.b - t.a, t.c - t.a);
        (t.a + ab * (u * (1.0 - v)) + ac * (v * u), unit(ab.cross(ac)), ab.length())
    } else if primitive >= params.first_planar {
        let f = records.planars[index - params.first_planar as usize];
        let inside = if f.kind == DISC { 0.7 } else { 1.0 };
        (f.origin + f.edge_u * (u * inside) + f.edge_v * (v * inside), f.normal, f.edge_u.length())
    } else {
        let s = records.spheres[index];
        let normal = unit_sphere(w.x, w.y);
        (s.center + normal * s.radius, normal, s.radius)
    }
}

/// Returns rays that arrive from all directions, near and far, with the direction in which they
/// leave to either side.
fn questions(scene: &ProbeScene, primitive: u32) -> Vec<Input> {
    let question = |i: u32| {
        let i = primitive * RAYS + i;
        let w = words(1203, i);
        let (target, normal, size) = target(scene, primitive, i);
        let side = if w.x & 1 == 1 || primitive < scene.params().first_planar { normal } else { -normal };
        let origin = target + outward(side, i, 1204) * (size * power(-1.0, 2.0, w.y));
        let leaves = outward(if w.z & 1 == 1 { normal } else { -normal }, i, 1205);
        // Rounding may put the origin at the target.
        let direction = if origin == target { -side } else { unit(target - origin) };
        Input { c: row(leaves, 0), ..ray(origin, direction) }
    };
    (0..RAYS).map(question).collect()
}

/// Returns whether the second hit is of the same primitive, and is not the far side of a sphere.
///
/// From a point close to a sphere, the near root is less than half of the chord -2 f·d, and the far
/// root is more; a ray that leaves outward has no root to meet. b = -f·d takes 3 products and 2
/// sums that round by at most ε / 2 each, and f rounds once, so 4 ε |f| allow for all of it. That
/// holds on every backend, because t is b plus or minus a root.
fn meets_again(scene: &ProbeScene, input: &Input, output: &Output) -> bool {
    if output.a.w == NO_PRIMITIVE || output.a.w != output.b.z {
        return false;
    }
    if output.a.w >= scene.params().first_planar {
        return true;
    }
    let s = scene.records().spheres[output.a.w as usize];
    let f = vector(output.a).as_dvec3() - s.center.as_dvec3();
    let chord = -2.0 * f.dot(vector(input.c).as_dvec3());
    let t = f64::from(f32::from_bits(output.b.y));
    let rounding = 4.0 * EPSILON * f.length();
    t < 0.5 * chord - rounding || chord < -2.0 * rounding
}

/// No ray meets the primitive that it leaves. The primitive is excluded by its number and side, not
/// by an offset, so this holds on every backend. Each primitive is traced alone, as the root of the
/// BVH, because others would hide it.
fn t12_same_primitive(subject: BackendUnderTest) {
    let scene = objects();
    let Some(mut prober) = Prober::with_scene(subject, &scene) else { return };
    let params = scene.params();
    let kind = |primitive: u32| match primitive {
        p if p >= params.first_triangle => 3,
        p if p >= params.first_planar => {
            1 + scene.records().planars[(p - params.first_planar) as usize].kind as usize
        }
        _ => 0,
    };
    let count = params.first_triangle + scene.records().triangles.len() as u32;
    let (mut hits, mut again, mut plainly) = ([0; 4], [0; 4], [0; 4]);
    for primitive in 0..count {
        prober.render.root = Child::leaf(primitive).0;
        let questions = questions(&scene, primitive);
        let outputs = prober.ask("probe_trace", LEAVE_SURFACE, &questions);
        let of = |outputs: &[Output]| {
            questions.iter().zip(outputs).filter(|(input, output)| meets_again(&scene, input, output)).count()
        };
        hits[kind(primitive)] += outputs.iter().filter(|output| output.b.z == primitive).count();
        again[kind(primitive)] += of(&outputs);
        if primitive / 2 % 4 == 0 {
            plainly[kind(primitive)] += of(&prober.ask("probe_trace", LEAVE_WITHOUT_OFFSET, &questions));
        }
    }
    assert!(hits.iter().all(|&hits| hits > 10_000), "{hits:?}");
    assert_eq!(again, [0; 4], "of {hits:?}");
    // Negative control: rays that start at the hit as if in free space.
    assert!(plainly.iter().all(|&again| again > 100), "negative control not detected: {plainly:?}");
    report(
        12,
        subject,
        Outcome::Passed,
        format!(
            "spheres, quads, discs, triangles: of {hits:?} rays {again:?} meet what they leave; of a quarter of them, plainly, {plainly:?}"
        ),
    );
}

/// Returns the faces of `count` boxes, six for each with the top first, and the boxes' sizes.
fn boxes(count: u32) -> (ProbeScene, Vec<f32>) {
    let (mut shapes, mut sizes) = (Vec::new(), Vec::new());
    for i in 0..count {
        let [w, v] = [words(1210, i), words(1211, i)];
        let size = power(-4.0, 4.0, w.x);
        let place = unit_sphere(w.y, w.z) * (size * power(-3.0, 4.0, w.w));
        let x = if i % 2 == 0 { Vec3::X } else { unit_sphere(v.x, v.y) };
        let (y, z) = basis(x);
        let [corner, x, y, z] = [place, x * size, y * size, z * size].map(|v| v.as_dvec3());
        let face = |corner: DVec3, u, v| ShapeKind::Quad { corner, u, v };
        shapes.extend([face(corner + z, x, y), face(corner, y, x), face(corner, z, y), face(corner, x, z)]);
        shapes.extend([face(corner + x, y, z), face(corner + y, z, x)]);
        sizes.push(size);
    }
    let mut scene = ProbeScene::new(&construct::scene(shapes, &[]));
    // Each box has its own tree: a chain whose traversal tests all six faces.
    let everything = (Vec3::splat(-1e12), Vec3::splat(1e12));
    let chain = |i: u32| {
        let rest = if i % 6 == 4 { Child::leaf(i + 1) } else { Child::inner(i - i / 6 + 1) };
        BvhNode::new(Child::leaf(i), everything, rest, everything)
    };
    scene.bvh.nodes = (0..6 * count).filter(|i| i % 6 != 5).map(chain).collect();
    (scene, sizes)
}

/// Returns rays that leave the top of a box outward near its border.
fn at_borders(scene: &ProbeScene, index: u32) -> Vec<Input> {
    let top = scene.records().planars[6 * index as usize];
    let question = |i: u32| {
        let i = index * RAYS + i;
        let w = words(1212, i);
        let near = |bits: u32| {
            let share = if bits.is_multiple_of(2) { power(-8.0, -1.0, bits) } else { unit_f32(bits) };
            if bits.is_multiple_of(3) { share } else { 1.0 - share }
        };
        let target = top.origin + top.edge_u * near(w.x) + top.edge_v * near(w.y);
        let size = top.edge_u.length();
        let origin = target + outward(top.normal, i, 1213) * (size * power(-1.0, 2.0, w.z));
        Input { c: row(outward(top.normal, i, 1214), 0), ..ray(origin, unit(target - origin)) }
    };
    (0..RAYS).map(question).collect()
}

/// A ray that leaves a face outward near its border may meet the side behind the border, but no
/// farther above the face than the border's own rounding.
///
/// The offset of the ray's origin covers rounding that grows with the face's place. The rest grows
/// with the side's size s: a coordinate is a sum of three products of a difference and a dual, with
/// 5 roundings (difference, dual, product, two sums) of at most √2 s ε / 2 each, and corner and
/// edge were rounded at load by √3 s ε / 2 each. So no such hit is higher above the face than (5 √2
/// / 2 + √3) ε s.
fn t12_box_borders(subject: BackendUnderTest) {
    let (scene, sizes) = boxes(70);
    let Some(mut prober) = Prober::with_scene(subject, &scene) else { return };
    // Counts the rays, counts those that meet a face again, and finds the highest such hit in ε of
    // the size.
    let mut sweep = |operation: u32| {
        let (mut count, mut met, mut highest) = (0, 0, 0.0f64);
        for (index, &size) in (0..).zip(&sizes) {
            prober.render.root = Child::inner(5 * index).0;
            let questions = at_borders(&scene, index);
            let top = scene.records().planars[6 * index as usize];
            for (input, output) in questions.iter().zip(prober.ask("probe_trace", operation, &questions)) {
                if output.b.z != 6 * index {
                    continue; // the ray arrives at a side, or misses the box
                }
                count += 1;
                if output.a.w == NO_PRIMITIVE {
                    continue;
                }
                met += 1;
                let t = f64::from(f32::from_bits(output.b.y));
                let at = vector(output.a).as_dvec3() + vector(input.c).as_dvec3() * t;
                let height = (at - top.origin.as_dvec3()).dot(top.normal.as_dvec3());
                highest = highest.max(if output.a.w == 6 * index {
                    f64::INFINITY
                } else {
                    height / (EPSILON * f64::from(size))
                });
            }
        }
        (count, met, highest)
    };
    let (count, met, highest) = sweep(LEAVE_SURFACE);
    let twin = sweep(LEAVE_WITHOUT_OFFSET);
    let bound = 5.0 * 0.5f64.sqrt() + 3f64.sqrt();
    assert!(count > 40_000 && highest <= bound, "{met} of {count}, {highest}");
    assert!(twin.1 > 10 * met && twin.2 > bound, "negative control not detected: {twin:?}");
    let outcome = if met == 0 { Outcome::Passed } else { Outcome::Bounded };
    report(
        12,
        subject,
        outcome,
        format!(
            "{met} of {count} rays that leave a box's face near its border meet the side behind it, at most {highest:.2} eps of the size above; plainly {}",
            twin.1
        ),
    );
}

for_each_route!(t12_same_primitive, t12_box_borders);
