//! Portals: sampled directions go through one, their pdf integrates to 1, and samples find the
//! whole solid angle that a point sees.

use crate::materials::NO_SCENE;
use crate::statistics::{Mean, SLOW, samples, words};
use bytemuck::Zeroable;
use core::f64::consts::{PI, TAU};
use glam::{DVec3, Vec3};
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::environment::EnvironmentSample;
use trisect_shared::features::{FeatureSet, Features, NEE, PORTALS};
use trisect_shared::light::{ReferencePoint, sample, sky};
use trisect_shared::params::RenderParams;
use trisect_shared::planar::{Planar, QUAD};
use trisect_shared::scene::Scene;
use trisect_shared::sky::Sky;
use trisect_shared::sphere::MISS;

const F: Features = NEE | PORTALS;

fn portal(corner: DVec3, u: DVec3, v: DVec3) -> Planar {
    let normal = u.cross(v);
    let square = normal.length_squared();
    Planar {
        origin: corner.as_vec3(),
        normal: normal.normalize().as_vec3(),
        kind: QUAD,
        dual_u: (v.cross(normal) / square).as_vec3(),
        dual_v: (normal.cross(u) / square).as_vec3(),
        edge_u: u.as_vec3(),
        edge_v: v.as_vec3(),
        area: square.sqrt() as f32,
        ..Planar::zeroed()
    }
}

/// Windows of a room: two in the wall at x = -1, of which one is oblique, one in the ceiling, and
/// one that faces away from all points.
fn portals(scale: f64) -> [Planar; 4] {
    let quad = |corner: [f64; 3], u: [f64; 3], v: [f64; 3]| {
        portal(DVec3::from(corner) * scale, DVec3::from(u) * scale, DVec3::from(v) * scale)
    };
    [
        quad([-1.0, 0.2, -0.5], [0.0, 0.6, 0.0], [0.0, 0.0, 0.4]),
        quad([-1.0, 0.2, 0.1], [0.0, 0.5, 0.2], [0.0, 0.0, 0.7]),
        quad([-0.3, 1.0, -0.3], [0.9, 0.0, 0.0], [0.0, 0.0, 0.2]),
        quad([2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
    ]
}

fn params(count: usize) -> RenderParams {
    RenderParams {
        portal_count: count as u32,
        environment_probability: 1.0,
        sky: Sky { bottom: Vec3::ONE, top: Vec3::ONE, ..Sky::zeroed() },
        ..RenderParams::zeroed()
    }
}

fn reference(point: Vec3, normal: Vec3) -> ReferencePoint {
    ReferencePoint { point, primitive: NO_PRIMITIVE, normal }
}

/// Points in the middle, near a window, beside its frame, on a wall, and in its plane.
fn points() -> [ReferencePoint; 6] {
    [
        reference(Vec3::new(0.1, 0.4, 0.2), Vec3::ZERO),
        reference(Vec3::new(0.1, 0.0, 0.2), Vec3::Y),
        reference(Vec3::new(-0.97, 0.5, -0.3), Vec3::ZERO),
        reference(Vec3::new(-0.9, 0.15, 0.4), Vec3::NEG_X),
        reference(Vec3::new(0.9, 0.9, 0.9), Vec3::NEG_X),
        reference(Vec3::new(-1.0, 0.5, -0.9), Vec3::X),
    ]
}

/// Returns the pdf of a direction.
fn pdf(portals: &[Planar], from: &ReferencePoint, direction: Vec3) -> f64 {
    let sky = EnvironmentSample { direction, radiance: Vec3::ONE, pdf: 0.0 };
    let scene = Scene { planars: portals, ..NO_SCENE };
    // SAFETY: the parameters have the number of the portals.
    f64::from(unsafe { sky::pdf(FeatureSet::<F>::ALL, &params(portals.len()), scene, from, &sky) })
}

/// Returns whether a direction leads through a portal, from its front.
fn passes(portals: &[Planar], from: &ReferencePoint, direction: Vec3) -> bool {
    let through =
        |p: &Planar| (from.point - p.origin).dot(p.normal) > 0.0 && p.distance(from.point, direction) < MISS;
    portals.iter().any(through)
}

/// Calls `each` with the middle of each cell of a grid over the sphere, and its solid angle. The
/// cells are finer towards -x, where windows are near.
fn directions(mut each: impl FnMut(Vec3, f64)) {
    let rows = if SLOW { 400 } else { 1600 };
    for row in 0..rows {
        let z = -1.0 + 2.0 * (f64::from(row) + 0.5) / f64::from(rows);
        for column in 0..2 * rows {
            let angle = TAU * (f64::from(column) + 0.5) / f64::from(2 * rows);
            let radius = (1.0 - z * z).sqrt();
            let direction = DVec3::new(z, radius * angle.cos(), radius * angle.sin());
            each(direction.as_vec3(), 4.0 * PI / f64::from(rows) / f64::from(2 * rows));
        }
    }
}

/// The pdf integrates to 1 over the sphere, at every point that is in front of a portal. (The grid
/// of directions is 1 % off where a portal is seen obliquely.)
#[test]
fn the_pdf_integrates_to_1() {
    let portals = portals(1.0);
    for from in points() {
        let mut sum = 0.0;
        directions(|direction, angle| sum += pdf(&portals, &from, direction) * angle);
        assert!((sum - 1.0).abs() < 0.02, "{from:?}: {sum}");
    }
    // Negative control: a portal that is 5 % larger than it says.
    let mut wrong = portals;
    wrong.iter_mut().for_each(|portal| portal.area /= 1.05);
    let (from, mut sum) = (points()[0], 0.0);
    directions(|direction, angle| sum += pdf(&wrong, &from, direction) * angle);
    assert!((sum - 1.0).abs() > 0.04, "{sum}");
}

/// Samples lead through a portal, have the pdf that is asked for, and find the whole solid angle.
#[test]
fn samples_find_all_that_is_seen() {
    for scale in [1e-12, 1.0, 1e12] {
        let portals = portals(scale);
        let params = params(portals.len());
        let scene = Scene { planars: &portals, ..NO_SCENE };
        for at in points() {
            let from = ReferencePoint { point: at.point * scale as f32, ..at };
            let mut solid_angle = 0.0;
            directions(|d, angle| solid_angle += if passes(&portals, &from, d) { angle } else { 0.0 });
            let mut mean = Mean::default();
            for i in 0..samples(400_000) {
                // SAFETY: the parameters have the number of the portals.
                let light =
                    unsafe { sample(FeatureSet::<F>::ALL, &params, scene, from, words(31, i), words(32, i)) };
                let missed = light.radiance == Vec3::ZERO; // by rounding, at an edge
                if !missed {
                    assert!(!light.is_delta && light.primitive == NO_PRIMITIVE && light.t_max == MISS);
                    assert!((light.direction.length() - 1.0).abs() < 1e-6);
                    assert!(passes(&portals, &from, light.direction));
                    assert_eq!(f64::from(light.pdf), pdf(&portals, &from, light.direction));
                }
                mean.add(if missed { 0.0 } else { 1.0 / f64::from(light.pdf) });
            }
            assert!(mean.is(solid_angle, 0.01 * solid_angle), "{scale} {from:?}: {mean:?}, {solid_angle}");
            assert!(
                SLOW || !mean.is(1.1 * solid_angle, 0.01 * solid_angle),
                "a test that cannot fail: {mean:?}"
            );
        }
    }
}

/// A point behind all portals, in the plane of one, and at its corner chooses no direction that is
/// not finite.
#[test]
fn points_without_a_view_choose_nothing() {
    let portals = portals(1.0);
    for (count, point) in [(1, Vec3::new(-2.0, 0.3, 0.0)), (1, portals[0].origin), (4, portals[2].origin)] {
        let scene = Scene { planars: &portals[..count], ..NO_SCENE };
        let from = reference(point, Vec3::ZERO);
        for i in 0..1000 {
            // SAFETY: there are at least that many portals.
            let light = unsafe {
                sample(FeatureSet::<F>::ALL, &params(count), scene, from, words(33, i), words(34, i))
            };
            assert!(light.direction.is_finite() && light.pdf.is_finite() && light.pdf > 0.0, "{light:?}");
            assert!(count == 4 || light.radiance == Vec3::ZERO, "{light:?}");
        }
    }
}
