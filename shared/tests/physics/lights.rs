//! Next-event estimation towards one light of each shape: points lie on it, and the pdf integrates
//! to its solid angle.

use crate::materials::NO_SCENE;
use crate::statistics::{Mean, samples, words};
use bytemuck::Zeroable;
use core::f64::consts::PI;
use glam::{DVec3, Vec3};
use trisect_shared::attributes::MeshVertex;
use trisect_shared::bsdf::LAMBERTIAN;
use trisect_shared::bvh::NO_PRIMITIVE;
use trisect_shared::features::{EMITTERS, FeatureSet, Features, SHAPES};
use trisect_shared::light::{Light, LightSample, ReferencePoint, pdf, sample};
use trisect_shared::material::{EMITS_BOTH_SIDES, Material};
use trisect_shared::params::RenderParams;
use trisect_shared::planar::{DISC, Planar, QUAD};
use trisect_shared::ray::OriginPrimitive;
use trisect_shared::scene::Scene;
use trisect_shared::sphere::{MISS, Sphere};
use trisect_shared::triangle::Triangle;

const F: Features = EMITTERS | SHAPES;

/// The only light of a scene.
#[derive(Clone, Copy)]
enum Shape {
    Sphere(Sphere),
    Planar(Planar),
    Triangle(Triangle),
}

impl Shape {
    fn area(&self) -> f64 {
        match self {
            Self::Sphere(s) => 4.0 * PI * f64::from(s.radius).powi(2),
            Self::Planar(f) => f64::from(f.area),
            Self::Triangle(t) => 0.5 * (t.b - t.a).as_dvec3().cross((t.c - t.a).as_dvec3()).length(),
        }
    }

    /// Returns the distance of `p` from the shape, relative to its size.
    fn distance(&self, p: Vec3) -> f32 {
        match self {
            Self::Sphere(s) => ((p - s.center).length() / s.radius - 1.0).abs(),
            Self::Planar(f) => {
                let (u, v) = f.coordinates(p);
                let beyond = if f.kind == DISC {
                    (u * u + v * v - 1.0).max(0.0)
                } else {
                    (-u).max(u - 1.0).max(-v).max(v - 1.0).max(0.0)
                };
                beyond.max((p - f.origin).dot(f.normal).abs() / f.area.sqrt())
            }
            Self::Triangle(t) => {
                let n = (t.b - t.a).cross(t.c - t.a);
                let inside = |a: Vec3, b: Vec3| -(b - a).cross(p - a).dot(n) / n.dot(n);
                let beyond = inside(t.a, t.b).max(inside(t.b, t.c)).max(inside(t.c, t.a)).max(0.0);
                beyond.max((p - t.a).dot(n).abs() / n.dot(n).powf(0.75))
            }
        }
    }
}

/// Samples `shape` from a vertex and calls `each` with the sample, its pdf computed again, and the
/// distance. The light's pdf is that of an area larger by `factor`.
fn draw(shape: Shape, from: ReferencePoint, factor: f32, mut each: impl FnMut(&LightSample, f32, f32)) {
    let point = from.point;
    let mut params = RenderParams::zeroed();
    params.light_count = 1;
    let (spheres, flats, triangles): (&[Sphere], &[Planar], &[Triangle]) = match &shape {
        Shape::Sphere(s) => (core::slice::from_ref(s), &[], &[]),
        Shape::Planar(f) => (&[], core::slice::from_ref(f), &[]),
        Shape::Triangle(t) => (&[], &[], core::slice::from_ref(t)),
    };
    params.first_planar = spheres.len() as u32;
    params.first_triangle = params.first_planar + flats.len() as u32;
    let light_pdf = 1.0 / (shape.area() as f32 * factor);
    let mut material = Material::new(LAMBERTIAN, Vec3::ZERO);
    (material.emission, material.light_pdf, material.flags) = (Vec3::ONE, light_pdf, EMITS_BOTH_SIDES);
    let mut light = Light::zeroed();
    light.threshold = u32::MAX;
    let vertices = [MeshVertex::zeroed()];
    let (materials, lights) = ([material], [light]);
    let scene = Scene {
        spheres,
        planars: flats,
        triangles,
        vertices: &vertices,
        materials: &materials,
        lights: &lights,
        ..NO_SCENE
    };
    for i in 0..samples(200_000) {
        // SAFETY: the scene has one light, on primitive 0.
        let s = unsafe { sample(FeatureSet::<F>::ALL, &params, scene, from, words(8, i), words(9, i)) };
        if s.radiance == Vec3::ZERO {
            continue; // seen edge-on
        }
        assert!(!s.is_delta && s.primitive != NO_PRIMITIVE);
        assert!((s.direction.length() - 1.0).abs() < 1e-6);
        let distance = match &shape {
            Shape::Sphere(sphere) if from.primitive != 0 => {
                sphere.distance(point, s.direction, false, OriginPrimitive::NONE)
            }
            _ => s.t_max / 1.001,
        };
        if distance == MISS {
            continue; // by rounding, at the rim
        }
        let normal = match &shape {
            Shape::Sphere(sphere) => (point + s.direction * distance - sphere.center) / sphere.radius,
            Shape::Planar(f) => f.normal,
            Shape::Triangle(t) => t.normal().normalize(),
        };
        let cos = match shape {
            Shape::Sphere(_) if from.primitive != 0 => -s.direction.dot(normal).abs(), // at the rim, either side
            _ => s.direction.dot(normal),
        };
        // SAFETY: as above.
        let again = unsafe { pdf(FeatureSet::<F>::ALL, &params, scene, 0, light_pdf, from, distance, cos) };
        each(&s, again, distance);
    }
}

/// Returns the mean of 1 / pdf over samples: the solid angle, if each direction to the light is
/// found.
fn solid_angle(name: &str, shape: Shape, point: Vec3, factor: f32) -> Mean {
    let mut mean = Mean::default();
    draw(
        shape,
        ReferencePoint { point, primitive: NO_PRIMITIVE, normal: Vec3::ZERO },
        factor,
        |s, again, distance| {
            let p = point + s.direction * distance;
            // A few roundings of coordinates, and of a distance some times larger than the light.
            let rounding = 2e-6 * (1.0 + (p.length() + s.t_max) / (shape.area() as f32).sqrt());
            let off = shape.distance(p);
            assert!(off < rounding, "{name}: {p} is off by {off}");
            assert!((again / s.pdf - 1.0).abs() < 1e-2, "{name}: {again} for {}", s.pdf);
            mean.add(1.0 / f64::from(s.pdf));
        },
    );
    mean
}

/// Returns the solid angle of a triangle (Van Oosterom and Strackee, IEEE Transactions on
/// Biomedical Engineering 30(2), 1983).
fn of_triangle(point: Vec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let [a, b, c] = [a, b, c].map(|v| (v - point.as_dvec3()).normalize());
    let above = a.dot(b.cross(c)).abs();
    2.0 * above.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

fn check(name: &str, shape: Shape, point: Vec3, want: f64) {
    let mean = solid_angle(name, shape, point, 1.0);
    println!("{name}: {} ± {} for {want}", mean.value(), mean.error());
    assert!(mean.is(want, 1e-4 * want), "{name}: {mean:?} for {want}");
    // Negative control: an area 5 % larger than the light's.
    let mean = solid_angle(name, shape, point, 1.05);
    assert!(!mean.is(want, 1e-4 * want), "{name}: {mean:?} for {want}");
}

#[test]
fn spheres() {
    let sphere = Sphere { center: Vec3::new(1.0, 2.0, -3.0), radius: 0.5, material: 0, pad: [0; 3] };
    for (name, distance) in [("near", 0.501f64), ("middle", 1.0), ("far", 50.0), ("remote", 5000.0)] {
        let point = sphere.center + Vec3::new(0.6, -0.64, 0.48) * distance as f32;
        let cone = (0.5 / f64::from((point - sphere.center).length())).powi(2);
        let want = 2.0 * PI * cone / (1.0 + (1.0 - cone).sqrt());
        check(name, Shape::Sphere(sphere), point, want);
    }
    check("inside", Shape::Sphere(sphere), sphere.center + Vec3::new(0.1, 0.2, 0.1), 4.0 * PI);
    check("centre", Shape::Sphere(sphere), sphere.center, 4.0 * PI);
}

/// From points of the sphere's own surface, as paths inside it have them: samples cover the inner
/// half of all directions, and no other.
#[test]
fn own_surfaces() {
    let sphere = Sphere { center: Vec3::new(0.1, -0.2, 0.3), radius: 1.0, material: 0, pad: [0; 3] };
    let mut inward = Mean::default();
    for i in 0..40 {
        let w = words(9, i);
        let (normal, point) =
            sphere.project(sphere.center + trisect_shared::math::unit_sphere(w.x, w.y), Vec3::X);
        let mut sum = 0.0;
        draw(
            Shape::Sphere(sphere),
            ReferencePoint { point, primitive: 0, normal: Vec3::ZERO },
            1.0,
            |s, _, _| {
                assert!(s.direction.dot(normal) < 1e-3, "{} leaves the sphere at {normal}", s.direction);
                sum += 1.0 / f64::from(s.pdf);
            },
        );
        inward.add(sum / f64::from(samples(200_000)));
    }
    println!("own surface: {inward:?}");
    assert!(inward.is(2.0 * PI, 1e-3), "{inward:?}");
}

fn planar(kind: u32) -> Planar {
    let (edge_u, edge_v) = (Vec3::new(2.0, 0.3, 0.0), Vec3::new(0.2, 1.0, 0.5));
    // A disc's axes are perpendicular and of equal length.
    let edge_v = if kind == DISC { edge_u.cross(Vec3::Z).normalize() * edge_u.length() } else { edge_v };
    let cross = edge_u.cross(edge_v);
    let (normal, square) = (cross.normalize(), cross.dot(cross));
    Planar {
        origin: Vec3::new(0.5, -1.0, 2.0),
        normal,
        kind,
        dual_u: edge_v.cross(cross) / square,
        dual_v: cross.cross(edge_u) / square,
        edge_u,
        edge_v,
        area: if kind == DISC { PI as f32 * edge_u.dot(edge_u) } else { cross.length() },
        ..Planar::zeroed()
    }
}

const POINTS: [Vec3; 4] = [
    Vec3::new(1.0, -0.5, 0.0),
    Vec3::new(1.0, -0.5, 3.5),
    Vec3::new(-3.0, 4.0, -1.0),
    Vec3::new(40.0, 10.0, -30.0),
];

#[test]
fn quads() {
    let f = planar(QUAD);
    let [o, u, v] = [f.origin, f.edge_u, f.edge_v].map(|x| x.as_dvec3());
    for point in POINTS {
        let want = of_triangle(point, [o, o + u, o + v]) + of_triangle(point, [o + u + v, o + u, o + v]);
        check(&format!("quad from {point}"), Shape::Planar(f), point, want);
    }
}

#[test]
fn discs() {
    let f = planar(DISC);
    let [o, u, v] = [f.origin, f.edge_u, f.edge_v].map(|x| x.as_dvec3());
    let rim = |i: u32| {
        let (s, c) = (PI * f64::from(i) / 5000.0).sin_cos();
        o + u * c + v * s
    };
    for point in POINTS {
        let want = (0..10_000).map(|i| of_triangle(point, [o, rim(i), rim(i + 1)])).sum();
        check(&format!("disc from {point}"), Shape::Planar(f), point, want);
    }
}

#[test]
fn triangles() {
    let [a, b, c] = [Vec3::new(0.0, 1.0, 2.0), Vec3::new(1.5, 0.0, 2.5), Vec3::new(0.5, -1.0, 1.0)];
    let t = Triangle::of([a, b, c]);
    for point in POINTS {
        let want = of_triangle(point, [a, b, c].map(|v| v.as_dvec3()));
        check(&format!("triangle from {point}"), Shape::Triangle(t), point, want);
    }
}
