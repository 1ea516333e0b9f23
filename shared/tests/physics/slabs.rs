//! Traversal enters each box that a ray passes through in double precision (torture tests 9, 24,
//! 25).

use crate::materials::NO_SCENE;
use crate::statistics::{samples, words};
use bytemuck::Zeroable;
use glam::Vec3;
use trisect_shared::bvh::{BvhNode, Child, RayQuery};
use trisect_shared::features::FeatureSet;
use trisect_shared::math::{normalize, unit_f32, unit_sphere};
use trisect_shared::params::RenderParams;
use trisect_shared::ray::{OriginPrimitive, Ray};
use trisect_shared::scene::Scene;
use trisect_shared::sphere::Sphere;
use trisect_shared::traversal::closest_hit;

type Box3 = (Vec3, Vec3);

/// Returns whether traversal enters the box as first child and as second. Its content is a sphere
/// around everything, which every ray hits.
fn visits_box((low, high): Box3, origin: Vec3, direction: Vec3) -> [bool; 2] {
    let around = Sphere { center: Vec3::ZERO, radius: 1e12, material: 0, pad: [0; 3] };
    let nowhere = (Vec3::splat(1e30), Vec3::splat(1e30));
    let (inside, elsewhere) = (Child::leaf(0), Child::leaf(1));
    [
        BvhNode::new(inside, (low, high), elsewhere, nowhere),
        BvhNode::new(elsewhere, nowhere, inside, (low, high)),
    ]
    .map(|node| {
        let scene = Scene { spheres: &[around, around], nodes: &[node], ..NO_SCENE };
        let mut params = RenderParams::zeroed();
        params.root = Child::inner(0).0;
        let ray = Ray::in_world(origin, direction, OriginPrimitive::NONE);
        // SAFETY: one node, two spheres.
        unsafe { closest_hit(FeatureSet::<0>::ALL, &params, scene, ray, RayQuery::CLOSEST) }.primitive == 0
    })
}

/// Returns whether the ray passes through the box beyond doubt: not along a face, and by more than
/// the rounding of double precision.
fn passes((low, high): Box3, origin: Vec3, direction: Vec3) -> bool {
    let [low, high, origin, direction] = [low, high, origin, direction].map(|v| v.as_dvec3());
    let (mut enters, mut leaves) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (l, h) = (low[axis] - origin[axis], high[axis] - origin[axis]);
        if direction[axis] == 0.0 {
            if l >= 0.0 || h <= 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (l / direction[axis], h / direction[axis]);
        (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
    }
    enters * (1.0 + 1e-12) < leaves
}

/// Returns the number of rays that `enters` rejects, and of all rays, that pass through the box.
fn missed(
    rays: impl Iterator<Item = (Box3, Vec3, Vec3)>,
    enters: impl Fn(Box3, Vec3, Vec3) -> bool,
) -> (u32, u32) {
    rays.filter(|&(within, origin, direction)| passes(within, origin, direction)).fold(
        (0, 0),
        |(missed, count), (within, origin, direction)| {
            (missed + u32::from(!enters(within, origin, direction)), count + 1)
        },
    )
}

/// Returns rays towards corners and edges of boxes of unequal sides, from distance `far`.
fn grazing(far: f32) -> impl Iterator<Item = (Box3, Vec3, Vec3)> {
    (0..samples(500_000)).map(move |i| {
        let (w, v) = (words(30, i), words(31, i));
        let low = unit_sphere(w.x, w.y);
        let high = low + Vec3::new(unit_f32(w.z), unit_f32(w.w), unit_f32(w.x ^ w.z)) * 0.5;
        let origin = unit_sphere(v.x, v.y) * far;
        let pick = |axis: usize| if v.z >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let mut target = Vec3::new(pick(0), pick(1), pick(2));
        if v.z & 8 == 0 {
            target.x = low.x + (high.x - low.x) * unit_f32(v.w);
        }
        ((low, high), origin, normalize(target - origin))
    })
}

/// Tests a box without padding for rounding.
fn tight((low, high): Box3, origin: Vec3, direction: Vec3) -> bool {
    let (a, b) = ((low - origin) / direction, (high - origin) / direction);
    a.min(b).max_element().max(0.0) <= a.max(b).min_element()
}

/// Boxes as tight as possible: the factor on the exit (Ize, 2013) makes up for the roundings of
/// both ends of the interval.
#[test]
fn rounding_loses_no_box() {
    for far in [0.1, 1.0, 100.0, 1e4] {
        let (lost, of) = missed(grazing(far), |b, o, d| visits_box(b, o, d) == [true, true]);
        println!("from {far}: {lost} of {of} boxes missed");
        assert!(lost == 0 && of > 10_000, "from {far}: {lost} of {of}");
        // Negative control: the tight test misses more than one in a hundred.
        let (lost, of) = missed(grazing(far), tight);
        assert!(lost * 100 > of, "from {far}: {lost} of {of}");
    }
}

/// Rays along thin slabs and far through them, with components that are zero, tiny or denormal, of
/// either sign.
#[test]
fn odd_directions_lose_no_box() {
    const ODD: [f32; 12] = [0.0, -0.0, 1e-45, -1e-45, 1e-38, 1e-37, 1e-20, -1e-20, 1e-8, -1e-8, 1e-7, 2e-7];
    let rays = || {
        (0..samples(400_000)).map(|i| {
            let (w, v) = (words(32, i), words(33, i));
            let along = ((w.x >> 8) % 3) as usize;
            let sign = if w.x & 1 == 0 { 1.0 } else { -1.0 };
            let mut direction = Vec3::ZERO;
            direction[(along + 1) % 3] = ODD[(w.y >> 8) as usize % ODD.len()];
            direction[(along + 2) % 3] = ODD[(w.z >> 8) as usize % ODD.len()];
            direction[along] = sign;
            // Thin across; the near end at up to 1000 times the size of the origin.
            let thin = 10f32.powf(-7.0 + 4.0 * unit_f32(w.w));
            let near = 10f32.powf(-2.0 + 5.0 * unit_f32(v.x));
            let (mut low, mut high) = (Vec3::splat(-thin), Vec3::splat(thin));
            (low[along], high[along]) = if sign > 0.0 { (near, 2.0 * near) } else { (-2.0 * near, -near) };
            let mut origin = Vec3::ZERO;
            origin[(along + 1) % 3] = thin * (1.9 * unit_f32(v.y) - 0.95);
            ((low, high), origin, direction)
        })
    };
    let (lost, of) = missed(rays(), |b, o, d| visits_box(b, o, d) == [true, true]);
    println!("odd directions: {lost} of {of} boxes missed");
    assert!(lost == 0 && of > 10_000, "{lost} of {of}");
    // Negative control: the reciprocal of zero as some libraries have it (torture test 24).
    let small = |b, o, d: Vec3| {
        let d = Vec3::from_array(d.to_array().map(|x| if x.abs() > 1.2e-7 { x } else { 1.2e-7 }));
        tight(b, o, d)
    };
    assert!(missed(rays(), small).0 > 0);
}
