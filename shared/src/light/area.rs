//! Lights that are emitting primitives: spheres, planar shapes and triangles.

use super::{Light, LightSample, NO_LIGHT, ReferencePoint};
use crate::attributes::{SurfaceAttributes, TriangleVertices};
use crate::bsdf::{TexturePoint, load_material, opacity, slots};
use crate::buffer::load_record;
use crate::features::{ATTRIBUTES, FeatureSet, Features, HOLES, LIGHT_TREE, TEXTURES};
use crate::math::{atan2_turns, basis, max, sqrt, unit_circle, unit_f32, unit_sphere};
use crate::params::RenderParams;
use crate::planar::Planar;
use crate::primitive::{is_planar, is_triangle};
use crate::rng::Words;
use crate::scene::Scene;
use crate::sphere::Sphere;
use crate::triangle::Triangle;
use core::f32::consts::PI;
use glam::Vec3;

/// Returns 1 - cos of the half angle of the cone that contains the sphere as seen from `from`. No
/// cone contains it, and the result is 0, from inside and from the sphere's own surface, which
/// rounding puts inside or outside.
#[inline(always)]
fn sphere_cone(sphere: &Sphere, primitive: u32, from: ReferencePoint) -> f32 {
    let to = sphere.center - from.point;
    let sine2 = sphere.radius * sphere.radius * (1.0 / max(to.dot(to), 1e-37));
    if sine2 < 1.0 && primitive != from.primitive { sine2 * (1.0 / (1.0 + sqrt(1.0 - sine2))) } else { 0.0 }
}

/// Samples a point of the emitting primitive of a light.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn sample<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    light: &Light,
    from: ReferencePoint,
    random: Words,
) -> LightSample {
    let (point, primitive) = (from.point, light.primitive);
    let (u, v) = (unit_f32(random.x), unit_f32(random.y));
    let (target, normal, material);
    // Direction into the cone of a sphere seen from outside: not derived from the near point, which
    // may be the very point that the sphere is seen from.
    let mut inside_cone = Vec3::ZERO;
    let (mut texture_u, mut texture_v) = (0.0, 0.0);
    let mut attributes = SurfaceAttributes::NONE;
    if is_triangle(features, params, primitive) {
        let index = primitive - params.first_triangle;
        // SAFETY: the caller's promise.
        let triangle = unsafe { load_record::<Triangle>(scene.triangles, index) };
        // Uniform by area (Turk, Graphics Gems, 1990).
        let root = sqrt(u);
        let (a, b) = (1.0 - root, root * (1.0 - v));
        let c = root * v;
        target = triangle.a * a + triangle.b * b + triangle.c * c;
        let n = triangle.normal();
        normal = n * (1.0 / sqrt(n.dot(n)));
        // SAFETY: as above.
        let vertices = unsafe { TriangleVertices::load(scene.vertices, &triangle) };
        material = vertices.a.material;
        if features.has::<{ TEXTURES | ATTRIBUTES }>() {
            (texture_u, texture_v) = vertices.uv(a, b, c);
        }
        if features.has::<ATTRIBUTES>() && vertices.have_attributes() {
            // SAFETY: as above.
            attributes = unsafe { vertices.attributes(scene.vertices, a, b, c) };
        }
    } else if is_planar(features, params, primitive) {
        // SAFETY: the caller's promise.
        let planar = unsafe { load_record::<Planar>(scene.planars, primitive - params.first_planar) };
        let (mut across, mut down) = (u, v);
        if planar.kind == crate::planar::DISC {
            let radius = sqrt(u);
            let (cos, sin) = unit_circle(random.y);
            (across, down) = (radius * cos, radius * sin);
            (texture_u, texture_v) = (0.5 + 0.5 * across, 0.5 - 0.5 * down);
        } else {
            (texture_u, texture_v) = (u, 1.0 - v);
        }
        target = planar.origin + planar.edge_u * across + planar.edge_v * down;
        normal = planar.normal;
        material = planar.material;
    } else {
        // SAFETY: the caller's promise.
        let sphere = unsafe { load_record::<Sphere>(scene.spheres, primitive) };
        let half_cone = sphere_cone(&sphere, primitive, from);
        material = sphere.material;
        if half_cone > 0.0 {
            // Uniform in the cone that contains the sphere (Shirley, Wang and Zimmerman, 1996):
            // towards the near side.
            let to = sphere.center - point;
            let distance = sqrt(to.dot(to));
            let axis = to * (1.0 / distance);
            let below = u * half_cone; // 1 - cos, without cancellation
            let (cos, sin2) = (1.0 - below, below * (2.0 - below));
            let (x, y) = basis(axis);
            let (c, s) = unit_circle(random.y);
            let sine = sqrt(sin2);
            let direction = axis * cos + (x * c + y * s) * sine;
            let depth = sqrt(max(sphere.radius * sphere.radius - distance * distance * sin2, 0.0));
            let away = point + direction * (distance * cos - depth) - sphere.center;
            normal = away * (1.0 / max(sqrt(away.dot(away)), 1e-37));
            target = sphere.center; // no nearer than the near side
            inside_cone = direction;
        } else {
            normal = unit_sphere(random.x, random.y);
            target = sphere.center + normal * sphere.radius;
        }
        if features.has::<TEXTURES>() {
            texture_u = 0.5 + atan2_turns(-normal.z, normal.x);
            texture_v = 2.0 * atan2_turns(sqrt(normal.x * normal.x + normal.z * normal.z), normal.y);
        }
    }
    let to = target - point;
    let square = to.dot(to);
    // SAFETY: each primitive's material and its textures are in range.
    let material = unsafe {
        let wanted = if features.has::<HOLES>() { slots::EMISSION | slots::ALBEDO } else { slots::EMISSION };
        let at = TexturePoint { u: texture_u, v: texture_v, attributes };
        load_material(features, scene, material, wanted, at).material
    };
    let distance = sqrt(square);
    let mut direction = to * (1.0 / distance);
    let mut cos = -direction.dot(normal);
    if inside_cone.dot(inside_cone) > 0.0 {
        (direction, cos) = (inside_cone, 1.0);
    }
    if square <= 0.0 || cos == 0.0 || !material.emits(cos > 0.0) {
        return NO_LIGHT;
    }
    let by_area = if features.has::<LIGHT_TREE>() { light.intensity.x } else { material.light_pdf };
    LightSample {
        direction,
        t_max: distance * 1.001, // only to skip what lies behind
        primitive,
        radiance: material.emission * opacity(features, &material),
        // SAFETY: the caller's promise.
        pdf: unsafe { pdf(features, params, scene, primitive, by_area, from, distance, -cos) },
        is_delta: false,
    }
}

/// Returns the pdf, per steradian at `from`, of the point of `primitive` at `distance`, which is
/// chosen with the pdf `light_pdf` by area. `cos` is the cosine of the direction to that point with
/// the normal there.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "one place, seen from one point; see buffer")]
pub(super) unsafe fn pdf<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    primitive: u32,
    light_pdf: f32,
    from: ReferencePoint,
    distance: f32,
    cos: f32,
) -> f32 {
    if !is_triangle(features, params, primitive) && !is_planar(features, params, primitive) {
        // SAFETY: the caller's promise.
        let sphere = unsafe { load_record::<Sphere>(scene.spheres, primitive) };
        let half_cone = sphere_cone(&sphere, primitive, from);
        if half_cone > 0.0 {
            // The far side, seen through holes of the near one, is never sampled.
            let chance = if cos > 0.0 { 0.0 } else { light_pdf };
            let chance = chance * (4.0 * PI * sphere.radius * sphere.radius);
            return chance * (1.0 / (2.0 * PI * half_cone));
        }
    }
    light_pdf * distance * distance * (1.0 / max(cos.abs(), 1e-9))
}
