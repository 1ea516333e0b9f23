//! Random numbers, scenes and questions for the geometric tests.

use glam::{DAffine3, DVec3, Vec3};
use trisect::scene::Scene;
use trisect::scene::description::{Alpha, Description, Instance, Material, Mesh, Shape, ShapeKind, Surface};
use trisect_probes::record::{Input, Output, row};
use trisect_shared::math::unit_f32;
use trisect_shared::rng::{PathKey, Words};
use trisect_tests::BackendUnderTest;

/// Machine epsilon, 2⁻²³: the greatest relative distance between neighbours.
pub const EPSILON: f64 = f32::EPSILON as f64;

/// Words of one of many streams.
pub fn words(stream: u32, i: u32) -> Words {
    PathKey { seed: stream, pixel: i, sample: 0 }.words(0)
}

/// 10 to a power that is uniform between `low` and `high`.
pub fn power(low: f32, high: f32, bits: u32) -> f32 {
    10f32.powf(low + (high - low) * unit_f32(bits))
}

/// A scene as the loader makes it of a description: one grey material, triangles as one mesh, each with vertices of its own.
pub fn scene(shapes: Vec<ShapeKind>, triangles: &[[Vec3; 3]]) -> Scene {
    let grey = Material {
        name: "grey".to_owned(),
        surface: Surface::Lambertian,
        base_color: DVec3::splat(0.5),
        base_color_texture: None,
        emission: DVec3::ZERO,
        emission_texture: None,
        emits_both_sides: false,
        opacity: 1.0,
        alpha: Alpha::Opaque,
    };
    let mut model = Description {
        materials: vec![grey],
        shapes: shapes.into_iter().map(|kind| Shape { kind, material: 0 }).collect(),
        ..Description::default()
    };
    if !triangles.is_empty() {
        model.meshes.push(Mesh {
            positions: triangles.iter().flatten().map(|v| v.to_array()).collect(),
            triangles: (0u32..).take(triangles.len()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Mesh::default()
        });
        model.instances.push(Instance { mesh: 0, transform: DAffine3::IDENTITY });
    }
    Scene::from_model(model, "test").expect("a scene")
}

/// A parallelogram.
pub fn quad(corner: Vec3, u: Vec3, v: Vec3) -> ShapeKind {
    ShapeKind::Quad { corner: corner.as_dvec3(), u: u.as_dvec3(), v: v.as_dvec3() }
}

/// A disc.
pub fn disc(center: Vec3, normal: Vec3, radius: f32) -> ShapeKind {
    ShapeKind::Disc { center: center.as_dvec3(), normal: normal.as_dvec3(), radius: f64::from(radius) }
}

/// A sphere.
pub fn sphere(center: Vec3, radius: f32) -> ShapeKind {
    ShapeKind::Sphere { center: center.as_dvec3(), radius: f64::from(radius) }
}

/// A ray in free space, for the probe that traces.
pub fn ray(origin: Vec3, direction: Vec3) -> Input {
    Input { a: row(origin, u32::MAX), b: row(direction, 0), ..Input::default() }
}

/// The unit vector along a vector of any length but 0, by double precision, so that tiny components survive; signs of zeros too.
pub fn unit(v: Vec3) -> Vec3 {
    v.as_dvec3().normalize().as_vec3()
}

/// The number in the first word of an answer's first row.
pub fn first(output: &Output) -> f32 {
    f32::from_bits(output.a.x)
}

/// Whether division and square root are correctly rounded, and no operation contracted: IEEE 754 on the CPU, `.rn` without `fma` in
/// PTX. On Vulkan a division may be off by 2.5 ULP and a square root by 1 / InverseSqrt's (Vulkan specification, "Precision of Core
/// SPIR-V Instructions"), and what naga writes may be contracted.
pub fn rounds_correctly(subject: BackendUnderTest) -> bool {
    matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda)
}
