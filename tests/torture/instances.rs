//! Test 46: instances of meshes under extreme maps: scaled by 2^-20 to 2^20, mirrored, stretched,
//! and nested eight deep.

use crate::construct::{EPSILON, power, ray, unit, words};
use crate::mesh::Mesh as Ball;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use trisect::render::{Settings, Traversal};
use trisect::scene::builder::{Camera, Gradient, Lambertian, SceneBuilder};
use trisect::scene::description::Mesh;
use trisect::scene::{Scene, Sharing};
use trisect_probes::record::{Input, Output, row, vector};
use trisect_probes::trace::{CLOSEST, LEAVE_SURFACE, LEAVE_WITHOUT_OFFSET};
use trisect_shared::bvh::{Child, NO_PRIMITIVE};
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_tests::probe::{ProbeScene, Prober};
use trisect_tests::renders::{cpu, differing, film, independent};
use trisect_tests::report::{Outcome, report};
use trisect_tests::{BackendUnderTest, for_each_route};

/// Number of instances.
const INSTANCES: u32 = 64;
/// Number of rays for each instance.
const RAYS: u32 = 1000;

/// Returns a unit quaternion.
fn turn(bits: u32) -> DQuat {
    let axis = unit_sphere(bits, bits.rotate_left(13)).as_dvec3().normalize();
    DQuat::from_axis_angle(axis, 7.0 * f64::from(unit_f32(bits.rotate_left(7))))
}

/// Returns the map of instance `i`: scales from 2^-20 to 2^20 in all, in one step or eight nested
/// ones; of four, one is mirrored and one stretched by up to 30.
fn map(i: u32) -> DAffine3 {
    let w = words(4600, i);
    let exponent = f64::from(i % 41) - 20.0;
    let levels = if i.is_multiple_of(2) { 1 } else { 8 };
    let mut map = DAffine3::IDENTITY;
    for level in 0..levels {
        let v = words(4601 + level, i);
        let step = DVec3::splat((exponent / f64::from(levels)).exp2());
        let stretch = if i % 4 == 2 && level == 0 { f64::from(power(0.0, 1.5, v.x)) } else { 1.0 };
        let mirror = if i % 4 == 3 && level == 0 { -1.0 } else { 1.0 };
        let scale = step * DVec3::new(stretch * mirror, 1.0, 1.0);
        map *= DAffine3::from_scale_rotation_translation(scale, turn(v.y), DVec3::ZERO);
    }
    // Near and far, beside its size.
    let far = exponent.exp2() * f64::from(power(-2.0, 3.0, w.x));
    DAffine3::from_translation(unit_sphere(w.y, w.z).as_dvec3() * far) * map
}

/// Returns a convex ball of 128 triangles that instances share.
fn balls() -> Scene {
    let ball = Ball::octahedron().divided(normalize).divided(normalize);
    let mesh = Mesh {
        positions: ball.vertices.iter().map(|v| v.to_array()).collect(),
        triangles: ball.faces.iter().map(|f| f.map(|i| i as u32)).collect(),
        ..Mesh::default()
    };
    let mut scene = SceneBuilder::new();
    let grey = scene.material(Lambertian::rgb(0.5, 0.5, 0.5));
    let mesh = scene.mesh(mesh, grey);
    for i in 0..INSTANCES {
        scene.instance(mesh, map(i));
    }
    scene.sky(Gradient::new([1.0; 3], [1.0; 3]));
    scene.camera(Camera::look_at([0.0, 0.0, 9.0], [0.0; 3]));
    let scene = scene.sharing(Sharing::Always).build().unwrap();
    assert_eq!((scene.shared.instances.len(), scene.triangles.len()), (INSTANCES as usize, 0));
    scene
}

/// A point of an instance in the world, with its normal and the size of the instance's triangle.
struct Target {
    point: DVec3,
    normal: DVec3,
    size: f64,
}

fn target(scene: &ProbeScene, instance: u32, i: u32) -> Target {
    let triangles = scene.records().triangles;
    let w = words(4620, i);
    let t = triangles[w.x as usize % triangles.len()];
    let map = scene.scene.shared.instances[instance as usize].map();
    let [a, b, c] = [t.a, t.b, t.c].map(|v| map.transform_point3(v.as_dvec3()));
    let (u, v) = (f64::from(unit_f32(w.y)), f64::from(unit_f32(w.z)));
    let normal = (b - a).cross(c - a).normalize();
    // A mirroring map turns the triangle round.
    let normal = if map.matrix3.determinant() < 0.0 { -normal } else { normal };
    Target { point: a + (b - a) * (u * (1.0 - v)) + (c - a) * (v * u), normal, size: (b - a).length() }
}

/// Returns a direction on the side of `normal`; one in four runs almost along the surface.
fn beside(normal: Vec3, i: u32, stream: u32) -> Vec3 {
    let w = words(stream, i);
    let d = unit_sphere(w.x, w.y);
    let lift = if w.z.is_multiple_of(4) { 1e-3 } else { 1.0 };
    unit(d - normal * d.dot(normal) + normal * (d.dot(normal).abs() * lift + 1e-6))
}

/// Returns rays that arrive at an instance from outside, and leave it outwards or inwards.
fn questions(scene: &ProbeScene, instance: u32) -> Vec<Input> {
    let question = |i: u32| {
        let i = instance * RAYS + i;
        let w = words(4621, i);
        let Target { point, normal, size } = target(scene, instance, i);
        let normal = normal.as_vec3();
        let way = beside(normal, i, 4622).as_dvec3() * (size * f64::from(power(-1.0, 2.0, w.y)));
        let origin = (point + way).as_vec3();
        let leaves = beside(if w.z & 1 == 1 { normal } else { -normal }, i, 4623);
        Input { c: row(leaves, 0), ..ray(origin, (point - origin.as_dvec3()).normalize().as_vec3()) }
    };
    (0..RAYS).map(question).collect()
}

/// Rays that leave a convex body, by how they end.
#[derive(Debug, Default)]
struct Found {
    outward: usize,
    /// Outward rays that meet the body, which they cannot.
    again: usize,
    inward: usize,
    /// Inward rays that do not meet the body, which they must.
    through: usize,
}

fn leaving(scene: &ProbeScene, prober: &mut Prober, operation: u32) -> Found {
    let mut found = Found::default();
    let first = scene.bvh.first_leaf_of_instances();
    for instance in 0..INSTANCES {
        // Alone, because others might hide it.
        prober.render.root = Child::leaf(first + instance).0;
        let questions = questions(scene, instance);
        let normals = prober.ask("probe_trace", CLOSEST, &questions);
        let outputs = prober.ask("probe_trace", operation, &questions);
        for ((input, hit), output) in questions.iter().zip(&normals).zip(&outputs) {
            if hit.a.w == NO_PRIMITIVE {
                continue;
            }
            let meets = output.a.w != NO_PRIMITIVE;
            if vector(input.c).dot(vector(hit.a)) > 0.0 {
                found.outward += 1;
                found.again += usize::from(meets);
            } else {
                found.inward += 1;
                found.through += usize::from(!meets);
            }
        }
    }
    found
}

/// A ray that leaves a convex instance outward does not meet it again, and one that leaves inward
/// meets its far side, whatever the map: the offset of its origin covers the rounding of the way
/// into the world and back.
fn t46_leaving_instances(subject: BackendUnderTest) {
    let scene = ProbeScene::new(&balls());
    let Some(mut prober) = Prober::with_scene(subject, &scene) else { return };
    let found = leaving(&scene, &mut prober, LEAVE_SURFACE);
    assert!(found.outward > 10_000 && found.inward > 10_000, "{found:?}");
    assert_eq!((found.again, found.through), (0, 0), "{found:?}");
    // Negative control: rays that start at the hit as if in free space.
    let plainly = leaving(&scene, &mut prober, LEAVE_WITHOUT_OFFSET);
    assert!(plainly.again > 1000, "negative control not detected: {plainly:?}");
    let figure = format!(
        "of {} rays out of {INSTANCES} convex instances {} meet them, of {} inward {} do not; plainly {} and {}",
        found.outward, found.again, found.inward, found.through, plainly.again, plainly.through
    );
    report(46, subject, Outcome::Passed, figure);
}

/// Returns the greatest distance of a hit from the point that the ray aims at, along the normal, in
/// ε of the numbers that take part; and the number of hits with another normal.
fn farthest(scene: &ProbeScene, instance: u32, questions: &[Input], outputs: &[Output]) -> (f64, usize) {
    let (mut worst, mut turned) = (0.0f64, 0);
    for (k, (input, output)) in questions.iter().zip(outputs).enumerate() {
        if output.a.w == NO_PRIMITIVE {
            continue;
        }
        let aimed = target(scene, instance, instance * RAYS + k as u32);
        let (origin, direction) = (vector(input.a).as_dvec3(), vector(input.b).as_dvec3());
        let distance = f64::from(f32::from_bits(output.b.x));
        // Rays along the surface arrive at another triangle.
        if direction.dot(aimed.normal).abs() < 0.2 {
            continue;
        }
        turned += usize::from(vector(output.a).as_dvec3().dot(aimed.normal) < 1.0 - 1e-5);
        let height = ((origin + direction * distance) - aimed.point).dot(aimed.normal).abs();
        let map = scene.scene.shared.instances[instance as usize].map();
        let condition = norm(&map) * norm(&map.inverse());
        let numbers = origin.length() + distance + map.translation.length() + aimed.point.length();
        worst = worst.max(height / (EPSILON * numbers * condition));
    }
    (worst, turned)
}

/// Returns the root of the sum of squares of a map's linear part.
fn norm(map: &DAffine3) -> f64 {
    let m = map.matrix3;
    [m.x_axis, m.y_axis, m.z_axis].iter().map(|v| v.length_squared()).sum::<f64>().sqrt()
}

/// Hits are where the triangle is, computed in f64 in the world, within a few roundings of the
/// coordinates times the condition of the map; and have its normal, except at edges, where rounding
/// decides.
fn t46_hits_of_instances(subject: BackendUnderTest) {
    /// 10 roundings of half an ε on the way in, one of the direction, 10 of the triangle's own
    /// test, at a cosine of 0.2.
    const LIMIT: f64 = 21.0 * 0.5 / 0.2;
    let scene = ProbeScene::new(&balls());
    let Some(mut prober) = Prober::with_scene(subject, &scene) else { return };
    let first = scene.bvh.first_leaf_of_instances();
    let (mut worst, mut hits, mut turned, mut control) = (0.0f64, 0, 0, 0.0f64);
    for instance in 0..INSTANCES {
        prober.render.root = Child::leaf(first + instance).0;
        let questions = questions(&scene, instance);
        let outputs = prober.ask("probe_trace", CLOSEST, &questions);
        hits += outputs.iter().filter(|output| output.a.w != NO_PRIMITIVE).count();
        let found = farthest(&scene, instance, &questions, &outputs);
        (worst, turned) = (worst.max(found.0), turned + found.1);
        // Negative control: a thousandth of the way less.
        let shorter: Vec<Output> = outputs
            .iter()
            .map(|output| {
                let mut output = *output;
                output.b.x = (f32::from_bits(output.b.x) * 0.999).to_bits();
                output
            })
            .collect();
        control = control.max(farthest(&scene, instance, &questions, &shorter).0);
    }
    assert!(hits > 50_000 && worst <= LIMIT && turned * 1000 < hits, "{worst}, {turned} of {hits}");
    assert!(control > LIMIT, "negative control not detected: {control}");
    report(46, subject, Outcome::Passed, format!("{hits} hits within {worst:.1} eps of the coordinates"));
}

/// Returns a heap of shared balls and loose triangles, some of which coincide, under a small sky.
fn heap(sharing: Sharing) -> Scene {
    let ball = Ball::octahedron().divided(normalize).divided(normalize);
    let positions: Vec<[f32; 3]> = ball.vertices.iter().map(|v| v.to_array()).collect();
    let mesh = |normals: Vec<[f32; 3]>| Mesh {
        normals,
        positions: positions.clone(),
        triangles: ball.faces.iter().map(|f| f.map(|i| i as u32)).collect(),
        ..Mesh::default()
    };
    let mut scene = SceneBuilder::new();
    let grey = scene.material(Lambertian::rgb(0.7, 0.6, 0.5));
    let (flat, smooth) = (scene.mesh(mesh(Vec::new()), grey), scene.mesh(mesh(positions.clone()), grey));
    for i in 0..24 {
        let (w, v) = (words(4630, i / 2), words(4631, i / 2));
        let (x, y, z) = (unit_f32(w.x), unit_f32(w.y), unit_f32(w.z));
        let place = (Vec3::new(x, y, z) * 2.0 - 1.0) * 3.0;
        // Uniform scales keep interpolated normals; every second instance coincides with another.
        let mirror = if i % 4 < 2 { 1.0 } else { -1.0 };
        let scale = DVec3::new(mirror, 1.0, 1.0) * f64::from(power(-0.5, 0.2, w.w));
        let map = DAffine3::from_scale_rotation_translation(scale, turn(v.x), place.as_dvec3());
        scene.instance(if i / 2 % 2 == 0 { flat } else { smooth }, map);
    }
    scene.sphere([0.0, -103.0, 0.0], 100.0, grey);
    scene.sky(Gradient::new([0.2, 0.3, 0.4], [1.0, 1.0, 1.0]));
    scene.camera(Camera::look_at([0.0, 2.0, 11.0], [0.0; 3]));
    scene.sharing(sharing).build().unwrap()
}

/// An image of instances is that of copies, but for rounding; each traversal has the same bits; and
/// CUDA has those of the CPU.
fn t46_images_of_instances(subject: BackendUnderTest) {
    let shared = heap(Sharing::Always);
    assert!(shared.triangles.is_empty());
    let Some(mut renderer) = subject.renderer(&shared) else { return };
    let settings = Settings { width: 96, height: 65, samples: 16, depth: 6, ..independent(&shared) };
    let got = film(&mut renderer, &settings);
    let want = film(&mut cpu(&shared), &settings);
    // A test of each triangle takes long on a software device.
    let few = Settings { width: 24, height: 16, samples: 2, ..settings };
    let linear = Settings { traversal: Some(Traversal::Linear), ..few };
    assert_eq!(differing(&film(&mut renderer, &linear), &film(&mut renderer, &few)), 0, "without a tree");
    if matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda) {
        assert_eq!(differing(&got, &want), 0);
    }
    // Equal random numbers give almost the same paths; a few differ at an edge after an ULP of
    // difference.
    let copies = film(&mut cpu(&heap(Sharing::Never)), &settings);
    let near = |scene: &trisect::film::Film| {
        let same = |(a, b): &(trisect::film::PixelTotals, trisect::film::PixelTotals)| {
            (0..3).all(|c| (a.mean()[c] - b.mean()[c]).abs() < 1e-3)
        };
        let count = scene.pixels.iter().zip(&copies.pixels).filter(same).count();
        count as f64 / copies.pixels.len() as f64
    };
    let share = near(&got);
    assert!(share >= 0.97, "{share}");
    // Negative control: instances smaller by a tenth.
    let mut faulty = shared.clone();
    for instance in &mut faulty.shared.instances {
        instance.to_world[..9].iter_mut().for_each(|x| *x *= 0.9);
    }
    let faulty = near(&film(&mut subject.renderer(&faulty).expect("it opened before"), &settings));
    assert!(faulty < 0.97, "negative control not detected: {faulty}");
    report(46, subject, Outcome::Passed, format!("{:.1} % of pixels as with copies", 100.0 * share));
}

/// Returns a room of six instances of a square, in which a ray meets the triangle of its own number
/// on every wall; `open` leaves one out.
fn room(open: bool) -> Scene {
    let square = Mesh {
        positions: vec![[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
        ..Mesh::default()
    };
    let mut scene = SceneBuilder::new();
    let white = scene.material(Lambertian::rgb(0.9, 0.9, 0.9));
    let square = scene.mesh(square, white);
    // Turns by right angles, without rounding.
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let walls = [[x, y, z], [-x, y, -z], [-z, y, x], [z, y, -x], [x, -z, y], [x, z, -y]];
    for columns in &walls[usize::from(open)..] {
        let turn = glam::DMat3::from_cols_slice(&columns.map(|v| v.to_array()).concat());
        scene.instance(square, DAffine3::from_mat3_translation(turn * 4.0, DVec3::new(0.5, 8.0, -16.0)));
    }
    scene.sky(Gradient::new([1.0; 3], [1.0; 3]));
    scene.camera(Camera::look_at([1.5, 7.0, -13.0], [0.0, 8.0, -17.0]).fov_degrees(90.0));
    scene.sharing(Sharing::Always).build().unwrap()
}

/// No ray leaves a closed room of instances: the triangle that it departs from is one of a wall,
/// not of all of them. A vertex of a path within rounding of an edge may lie behind the other wall,
/// with copies as with instances: about one of 2 · 10⁷, and this image has 3 · 10⁶.
fn t46_closed_rooms(subject: BackendUnderTest) {
    let scene = room(false);
    let Some(mut renderer) = subject.renderer(&scene) else { return };
    let settings = Settings { width: 61, height: 43, samples: 32, depth: 40, ..independent(&scene) };
    let lit = |film: &trisect::film::Film| film.pixels.iter().filter(|pixel| pixel.mean()[0] > 0.0).count();
    let dark = lit(&film(&mut renderer, &settings));
    assert!(dark <= 2, "{dark} pixels see the sky");
    // Negative control: a wall is missing.
    let mut renderer = subject.renderer(&room(true)).expect("it opened before");
    let open = lit(&film(&mut renderer, &settings));
    assert!(open > 2000, "negative control not detected: {open}");
    report(46, subject, Outcome::Passed, "a closed room of instances is dark");
}

for_each_route!(t46_leaving_instances, t46_hits_of_instances, t46_images_of_instances, t46_closed_rooms);
