//! Random numbers, scenes and questions of the geometric tests.

use glam::{DAffine3, DVec3, Vec3};
use trisect::scene::Scene;
use trisect::scene::description::{Description, Instance, Lambertian, Material, Mesh, Shape, ShapeKind, Sky};
use trisect_probes::record::{Input, Output, row};
use trisect_shared::math::unit_f32;
use trisect_shared::rng::{PathKey, Words};
use trisect_tests::BackendUnderTest;

/// Machine epsilon, 2⁻²³: the maximum relative distance between neighbouring f32 numbers.
pub const EPSILON: f64 = f32::EPSILON as f64;

/// Returns the four random words at index `i` of a stream. There are 2³² streams.
pub fn words(stream: u32, i: u32) -> Words {
    PathKey { seed: stream, pixel: i, sample: 0 }.words(0)
}

/// Returns 10 to a power that is uniform between `low` and `high`.
pub fn power(low: f32, high: f32, bits: u32) -> f32 {
    10f32.powf(low + (high - low) * unit_f32(bits))
}

/// Builds a scene as the loader does from a description: one grey material, and triangles as one
/// mesh, each with its own vertices.
pub fn scene(shapes: Vec<ShapeKind>, triangles: &[[Vec3; 3]]) -> Scene {
    let grey = Material::from(Lambertian::rgb(0.5, 0.5, 0.5)).named("grey");
    let mut model = Description {
        materials: vec![grey],
        shapes: shapes.into_iter().map(|kind| Shape { kind, material: 0 }).collect(),
        // With a sky of its own, a model gets no ground.
        sky: Some(Sky::Gradient { bottom: DVec3::ONE, top: DVec3::ONE }),
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

/// Returns a parallelogram.
pub fn quad(corner: Vec3, u: Vec3, v: Vec3) -> ShapeKind {
    ShapeKind::Quad { corner: corner.as_dvec3(), u: u.as_dvec3(), v: v.as_dvec3() }
}

/// Returns a disc.
pub fn disc(center: Vec3, normal: Vec3, radius: f32) -> ShapeKind {
    ShapeKind::Disc { center: center.as_dvec3(), normal: normal.as_dvec3(), radius: f64::from(radius) }
}

/// Returns a sphere.
pub fn sphere(center: Vec3, radius: f32) -> ShapeKind {
    ShapeKind::Sphere { center: center.as_dvec3(), radius: f64::from(radius) }
}

/// Returns a ray in free space, for the trace probe.
pub fn ray(origin: Vec3, direction: Vec3) -> Input {
    Input { a: row(origin, u32::MAX), b: row(direction, 0), ..Input::default() }
}

/// Returns the unit vector along a vector of any length but 0. Double precision keeps tiny
/// components and the signs of zeros.
pub fn unit(v: Vec3) -> Vec3 {
    v.as_dvec3().normalize().as_vec3()
}

/// Returns the number in the first word of an answer's first row.
pub fn first(output: &Output) -> f32 {
    f32::from_bits(output.a.x)
}

/// Returns whether division and square root are correctly rounded and no operation is contracted.
///
/// The CPU follows IEEE 754, and PTX has `.rn` without `fma`. On Vulkan a division may be off by
/// 2.5 ULP and a square root by as much as 1 / InverseSqrt (Vulkan specification, "Precision of
/// Core SPIR-V Instructions"), and naga's output may be contracted.
pub fn rounds_correctly(subject: BackendUnderTest) -> bool {
    matches!(subject, BackendUnderTest::Cpu | BackendUnderTest::Cuda)
}
