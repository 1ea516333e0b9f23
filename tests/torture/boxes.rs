//! Test 41: each node's box contains its primitives, by double precision.
//!
//! The boxes are those of the binary BVH, which the host builds, so the test needs no backend. The
//! CPU's wide BVH is made from it and is not covered here.

use crate::construct;
use crate::construct::{EPSILON, power, words};
use glam::{DVec3, Vec3, Vec4};
use trisect::bvh::{Bvh, BvhQuality};
use trisect::scene::Scene;
use trisect_shared::bvh::{BvhNode, Child};
use trisect_shared::math::{basis, unit_sphere};
use trisect_shared::planar::{DISC, Planar};
use trisect_shared::sphere::Sphere;
use trisect_shared::triangle::Triangle;
use trisect_tests::BackendUnderTest;
use trisect_tests::report::{Outcome, report};

/// Returns a scene of `count` primitives with sizes of 10⁻²⁰ to 10²⁰ at distances of 10⁻²⁰ to 10²⁰
/// from the origin, including shapes that a scene file may not hold. Vertices of triangles reach
/// 10¹² only, so that a product of three stays finite.
fn extremes(count: u32) -> Scene {
    let mut scene = construct::scene(Vec::new(), &[[Vec3::X, Vec3::Y, Vec3::Z]]);
    scene.triangles.clear();
    for i in 0..count {
        let [w, v] = [words(4100, i), words(4101, i)];
        let limit = if i % 4 == 3 { 12.0 } else { 20.0 };
        let size = power(-20.0, limit, w.x);
        let place = unit_sphere(w.y, w.z) * if w.w % 4 == 0 { 0.0 } else { power(-20.0, limit, w.w) };
        let axis = if v.z % 3 == 0 { Vec3::AXES[v.w as usize % 3] } else { unit_sphere(v.x, v.y) };
        let (x, y) = basis(axis);
        let (edge_u, edge_v) = (x * size, y * size * power(-3.0, 0.0, v.z));
        match i % 4 {
            0 => scene.spheres.push(Sphere { center: place, radius: size, material: 0, pad: [0; 3] }),
            3 => {
                let (b, c) = (place + edge_u, place + edge_v);
                scene.triangles.push(Triangle::of([place, b, c]));
            }
            kind => {
                let kind = if kind == 1 { DISC } else { 0 };
                let zero: Planar = bytemuck::Zeroable::zeroed();
                scene.flats.push(Planar { origin: place, normal: axis, kind, edge_u, edge_v, ..zero });
            }
        }
    }
    scene
}

/// Returns the box of a primitive by double precision, whose rounding error is 10⁻⁹ of f32's.
fn exact_box(scene: &Scene, primitive: usize) -> (DVec3, DVec3) {
    let of = |points: &[DVec3]| {
        let low = points.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        (low, points.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p)))
    };
    let exact = |v: Vec3| v.as_dvec3();
    let (spheres, flats) = (scene.spheres.len(), scene.flats.len());
    if primitive < spheres {
        let s = &scene.spheres[primitive];
        let (c, r) = (exact(s.center), f64::from(s.radius));
        return (c - r, c + r);
    }
    if primitive < spheres + flats {
        let f = &scene.flats[primitive - spheres];
        let (o, u, v) = (exact(f.origin), exact(f.edge_u), exact(f.edge_v));
        if f.kind == DISC {
            let reach = (u * u + v * v).map(f64::sqrt);
            return (o - reach, o + reach);
        }
        return of(&[o, o + u, o + v, o + u + v]);
    }
    let t = &scene.triangles[primitive - spheres - flats];
    of(&[exact(t.a), exact(t.b), exact(t.c)])
}

/// Returns the number of boxes that do not contain everything below them, and the narrowest margin
/// between a leaf's box and its primitive.
///
/// The margin is in ε of the primitive's farthest coordinate along the axis plus its greatest
/// extent; it is 2 before rounding.
fn loose(scene: &Scene, bvh: &Bvh) -> (usize, f64) {
    // Children come after their parents: in reverse order, the exact box below each child is known.
    let mut below = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); bvh.nodes.len()];
    let (mut wrong, mut narrowest) = (0, f64::INFINITY);
    for (index, node) in bvh.nodes.iter().enumerate().rev() {
        for (child, center, half) in [(node.first, 0, 2), (node.second, 1, 3)] {
            let child = Child(child);
            let row = |k: usize| DVec3::new(node.x[k].into(), node.y[k].into(), node.z[k].into());
            let (low, high) = (row(center) - row(half), row(center) + row(half));
            let held = if child.is_leaf() {
                exact_box(scene, child.index() as usize)
            } else {
                below[child.index() as usize]
            };
            let room = (held.0 - low).min(high - held.1);
            wrong += usize::from(room.is_nan() || room.min_element() < 0.0);
            if child.is_leaf() {
                let size = held.0.abs().max(held.1.abs()) + (held.1 - held.0).max_element();
                narrowest = narrowest.min((room / (EPSILON * size)).min_element());
            }
            below[index] = (below[index].0.min(held.0), below[index].1.max(held.1));
        }
    }
    (wrong, narrowest)
}

#[test]
fn t41_containment() {
    let (mut boxes, mut narrowest) = (0, f64::INFINITY);
    // Above 4096 primitives the builder gets shifted boxes, and the nodes get the true boxes
    // afterwards.
    for (count, quality) in [(2000, BvhQuality::High), (2000, BvhQuality::Fast), (6000, BvhQuality::Medium)] {
        let scene = extremes(count);
        let bvh = Bvh::build(&scene, Some(quality)).unwrap();
        let (wrong, room) = loose(&scene, &bvh);
        assert_eq!(wrong, 0, "{count} primitives, {quality:?}");
        boxes += 2 * bvh.nodes.len();
        narrowest = narrowest.min(room);
        // Negative controls: a leaf's box that is too small by 8 ε, and a box of the root by a
        // millionth.
        let leaf = bvh.nodes.iter().position(|node| Child(node.first).is_leaf()).unwrap();
        let shrunk = |index: usize, by: f32| {
            let mut bvh = bvh.clone();
            let node: &mut BvhNode = &mut bvh.nodes[index];
            let size = node.y.x.abs().max(node.y.z.abs()) + (node.y.z - node.y.x);
            node.y += Vec4::new(by * size, 0.0, 0.0, 0.0);
            loose(&scene, &bvh).0
        };
        assert!(shrunk(leaf, 8.0 * f32::EPSILON) == 1, "control not detected: a small leaf's box");
        assert!(shrunk(0, 1e-6) > 0, "control not detected: a small inner box");
    }
    report(
        41,
        BackendUnderTest::Cpu,
        Outcome::Passed,
        format!(
            "binary BVH, made by the host: {boxes} boxes, extents 1e-20 to 1e20, hold what is below them; at least {narrowest:.2} eps of room"
        ),
    );
}
