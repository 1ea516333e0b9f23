//! Pieces of smooth glass through which lights without extent may shine.

use super::members::{bounds_of, bounds_of_flat};
use glam::{DVec3, Vec3};
use trisect_scene::Scene;
use trisect_shared::bsdf::DIELECTRIC;
use trisect_shared::light::Light;
use trisect_shared::light::glass::GLASS;
use trisect_shared::material::{BLENDED, MASKED, Material};

/// Maximum radius of a ball, so that its square is a number of 32 bits.
const MAX_RADIUS: f64 = 1e15;

/// Run of consecutive primitives of one object.
struct Run {
    first: u32,
    count: u32,
    /// Material and object, which the primitives of one run have in common.
    of: (u32, u32),
    low: DVec3,
    high: DVec3,
}

/// Returns the pieces of smooth glass of the scene: spheres, runs of quads and discs of one
/// material, meshes, and instances of shared meshes.
pub(super) fn pieces(scene: &Scene) -> Vec<Light> {
    let is_glass = |material: u32| scene.materials.get(material as usize).is_some_and(is_smooth_glass);
    let mut pieces = Vec::new();
    for (index, sphere) in scene.spheres.iter().enumerate() {
        if is_glass(sphere.material) {
            pieces.push(record(index as u32, 1, sphere.center, sphere.radius));
        }
    }
    let mut runs: Vec<Run> = Vec::new();
    let mut add = |number: usize, of: (u32, u32), low: DVec3, high: DVec3| {
        let number = number as u32;
        match runs.last_mut() {
            Some(run) if run.of == of && run.first + run.count == number => {
                run.count += 1;
                (run.low, run.high) = (run.low.min(low), run.high.max(high));
            }
            _ => runs.push(Run { first: number, count: 1, of, low, high }),
        }
    };
    let first_flat = scene.spheres.len();
    for (number, flat) in (first_flat..).zip(&scene.flats) {
        if is_glass(flat.material) {
            let (low, high) = bounds_of_flat(flat);
            add(number, (flat.material, u32::MAX), low, high);
        }
    }
    for (number, triangle) in (first_flat + scene.flats.len()..).zip(scene.triangles.iter()) {
        let vertex = &scene.vertices[triangle.vertex_a as usize];
        if is_glass(vertex.material) {
            let (low, high) = bounds_of(&[triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3));
            add(number, (vertex.material, vertex.instance), low, high);
        }
    }
    let of_run = |run: Run| {
        let (center, radius) = ball((run.low, run.high));
        record(run.first, run.count, center, radius)
    };
    pieces.extend(runs.into_iter().map(of_run));
    let starts = scene.shared.starts();
    // Instances are named behind all primitives.
    let first_instance = scene.primitives() as u32;
    for (number, instance) in (first_instance..).zip(&scene.shared.instances) {
        let start = starts.get(instance.mesh as usize);
        let triangle = start.and_then(|&start| scene.shared.triangles.get(start));
        if triangle.is_some_and(|triangle| is_glass(scene.vertices[triangle.vertex_a as usize].material)) {
            let corners: Vec<DVec3> = scene.shared.corners(instance).collect();
            let (center, radius) = ball(bounds_of(&corners));
            pieces.push(record(number, 1, center, radius));
        }
    }
    pieces
}

/// Returns whether light is refracted by surfaces of the material, and not scattered.
fn is_smooth_glass(material: &Material) -> bool {
    material.kind == DIELECTRIC && material.flags & (MASKED | BLENDED) == 0
}

/// Returns middle and radius of the ball around a box.
fn ball((low, high): (DVec3, DVec3)) -> (Vec3, f32) {
    let radius = (0.5 * (high - low).length()).min(MAX_RADIUS);
    ((0.5 * (low + high)).as_vec3(), radius as f32)
}

/// Returns the record of a piece in a ball.
fn record(first: u32, count: u32, center: Vec3, radius: f32) -> Light {
    let mut light: Light = bytemuck::Zeroable::zeroed();
    (light.kind, light.primitive, light.alias) = (GLASS, first, count);
    (light.position, light.probability) = (center, radius.max(f32::MIN_POSITIVE));
    light
}
