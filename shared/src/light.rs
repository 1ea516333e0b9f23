//! Light sampling: choosing a point of a light, and the pdf of that choice.
//!
//! [`crate::path`] calls [`sample`] for next-event estimation, and [`pdf`] to weight a light that a
//! path hits by scattering.

use crate::buffer::load;
use crate::bvh::NO_PRIMITIVE;
use crate::environment;
use crate::features::{EMITTERS, ENVIRONMENT, Features, PLANAR, TEXTURES, TRIANGLES, has};
use crate::material::Material;
use crate::math::{basis, max, min, mul_high, sqrt, unit_circle, unit_f32, unit_sphere};
use crate::params::RenderParams;
use crate::planar::Planar;
use crate::rng::Words;
use crate::scene::Scene;
use crate::sphere::{MISS, Sphere};
use crate::texture;
use crate::triangle::{Triangle, TriangleShading};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::Vec3;

/// Kind of an area light: a primitive that emits.
pub const AREA: u32 = 0;
/// Kind of a point light; a spot light if its cone is narrower than the whole sphere.
pub const POINT: u32 = 1;
/// Kind of a directional light: infinitely far.
pub const DIRECTIONAL: u32 = 2;

/// Light, and its entry of the alias table (Walker, 1977; Vose, 1991), which chooses lights by
/// power. 64 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// Kind: [`AREA`], [`POINT`] or [`DIRECTIONAL`].
    pub kind: u32,
    /// Primitive of an area light.
    pub primitive: u32,
    /// Threshold of the alias table: keep this light if a random word is below, else take `alias`.
    pub threshold: u32,
    /// Index of the light to take instead.
    pub alias: u32,
    /// Position of a point light; unit vector towards a directional light.
    pub position: Vec3,
    /// Probability that this light is sampled.
    pub probability: f32,
    /// Radiant intensity of a point light (power per steradian); irradiance of a directional light
    /// (power per unit of area).
    pub intensity: Vec3,
    /// Slope of a spot's falloff over the cosine from its axis; 0 for a point light.
    pub cone_scale: f32,
    /// Unit vector along a spot's axis, away from the light.
    pub axis: Vec3,
    /// Offset of a spot's falloff: its intensity is multiplied by (cosine × `cone_scale` +
    /// `cone_offset`)², the base clamped to 0 to 1 (glTF's KHR_lights_punctual).
    pub cone_offset: f32,
}

const _: () = assert!(size_of::<Light>() == 64 && align_of::<Light>() == 16);

/// Sampled point of a light or of the environment map.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Maximum distance of the shadow ray.
    pub t_max: f32,
    /// Primitive that the shadow ray may hit, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// Arriving radiance, zero for a choice that gives nothing; irradiance for a light without
    /// extent.
    pub radiance: Vec3,
    /// pdf of this choice, per steradian at the point; its probability for a light without extent.
    pub pdf: f32,
    /// True if only light sampling can find this light.
    pub is_delta: bool,
}

const NO_LIGHT: LightSample = LightSample {
    direction: Vec3::Y,
    t_max: MISS,
    primitive: NO_PRIMITIVE,
    radiance: Vec3::ZERO,
    pdf: 1.0,
    is_delta: true,
};

/// Point that light is sampled from.
#[derive(Clone, Copy, Debug)]
pub struct ReferencePoint {
    /// Position on a surface.
    pub point: Vec3,
    /// Primitive of that surface.
    pub primitive: u32,
}

/// Returns 1 - cos of the half angle of the cone that contains the sphere as seen from `from`. No
/// cone contains it, and the result is 0, from inside and from the sphere's own surface, which
/// rounding puts inside or outside.
#[inline(always)]
fn sphere_cone(sphere: &Sphere, primitive: u32, from: ReferencePoint) -> f32 {
    let to = sphere.center - from.point;
    let sine2 = sphere.radius * sphere.radius / max(to.dot(to), 1e-37);
    if sine2 < 1.0 && primitive != from.primitive { sine2 / (1.0 + sqrt(1.0 - sine2)) } else { 0.0 }
}

/// Samples a light by its power, and a point on it.
///
/// `random.x` and `random.y` choose the point, `random.z` and `random.w` the light; `choice`
/// decides whether the environment map is sampled instead.
///
/// # Safety
///
/// The scene's indices were proven as [`crate::buffer`] says; there is a light, or an environment
/// map with a probability above 0.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn sample<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    from: ReferencePoint,
    random: Words,
    choice: u32,
) -> LightSample {
    if const { has(FEATURES, ENVIRONMENT) } && unit_f32(choice) < params.environment_probability {
        // SAFETY: a probability above zero means that there is an environment map.
        let sky = unsafe { environment::sample(params, scene, random) };
        return LightSample {
            direction: sky.direction,
            t_max: MISS,
            primitive: NO_PRIMITIVE,
            radiance: sky.radiance,
            pdf: sky.pdf * params.environment_probability,
            is_delta: false,
        };
    }
    if const { !has(FEATURES, EMITTERS) } || params.light_count == 0 {
        return NO_LIGHT;
    }
    // SAFETY: the index is below the number of lights, as is each alias.
    let light = unsafe {
        let light = load::<Light>(scene.lights, mul_high(random.z, params.light_count));
        if random.w < light.threshold { light } else { load::<Light>(scene.lights, light.alias) }
    };
    if light.kind == AREA {
        // SAFETY: the caller's promise for the light's primitive.
        return unsafe { sample_area::<FEATURES>(params, scene, light.primitive, from, random) };
    }
    if light.kind == DIRECTIONAL {
        return LightSample {
            direction: light.position,
            radiance: light.intensity,
            pdf: light.probability,
            ..NO_LIGHT
        };
    }
    let to = light.position - from.point;
    let square = to.dot(to);
    if square <= 0.0 {
        return NO_LIGHT;
    }
    let distance = sqrt(square);
    let direction = to * (1.0 / distance);
    let cone = min(max(light.cone_offset - direction.dot(light.axis) * light.cone_scale, 0.0), 1.0);
    LightSample {
        direction,
        t_max: distance,
        radiance: light.intensity * (cone * cone / square),
        pdf: light.probability,
        ..NO_LIGHT
    }
}

/// Samples a point of an emitting primitive.
///
/// # Safety
///
/// As [`sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn sample_area<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    primitive: u32,
    from: ReferencePoint,
    random: Words,
) -> LightSample {
    let point = from.point;
    let (u, v) = (unit_f32(random.x), unit_f32(random.y));
    let (target, normal, material);
    // Direction into the cone of a sphere seen from outside: not derived from the near point, which
    // may be the very point that the sphere is seen from.
    let mut inside_cone = Vec3::ZERO;
    let (mut texture_u, mut texture_v) = (0.0, 0.0);
    if const { has(FEATURES, TRIANGLES) } && primitive >= params.first_triangle {
        let index = primitive - params.first_triangle;
        // SAFETY: the caller's promise.
        let triangle = unsafe { load::<Triangle>(scene.triangles, index) };
        // Uniform by area (Turk, Graphics Gems, 1990).
        let root = sqrt(u);
        let (a, b) = (1.0 - root, root * (1.0 - v));
        let c = root * v;
        target = triangle.a * a + triangle.b * b + triangle.c * c;
        let n = triangle.normal();
        normal = n * (1.0 / sqrt(n.dot(n)));
        material = triangle.material;
        if const { has(FEATURES, TEXTURES) } {
            // SAFETY: as above.
            let s = unsafe { load::<TriangleShading>(scene.shading, index) };
            texture_u = s.u_a * a + s.u_b * b + s.u_c * c;
            texture_v = s.v_a * a + s.v_b * b + s.v_c * c;
        }
    } else if const { has(FEATURES, PLANAR) } && primitive >= params.first_planar {
        // SAFETY: the caller's promise.
        let planar = unsafe { load::<Planar>(scene.planars, primitive - params.first_planar) };
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
        let sphere = unsafe { load::<Sphere>(scene.spheres, primitive) };
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
        if const { has(FEATURES, TEXTURES) } {
            texture_u = 0.5 + crate::math::atan2_turns(-normal.z, normal.x);
            texture_v =
                2.0 * crate::math::atan2_turns(sqrt(normal.x * normal.x + normal.z * normal.z), normal.y);
        }
    }
    let to = target - point;
    let square = to.dot(to);
    // SAFETY: each primitive's material is in range.
    let material = unsafe { load::<Material>(scene.materials, material) };
    let distance = sqrt(square);
    let mut direction = to * (1.0 / distance);
    let mut cos = -direction.dot(normal);
    if inside_cone.dot(inside_cone) > 0.0 {
        (direction, cos) = (inside_cone, 1.0);
    }
    if square <= 0.0 || cos == 0.0 || !material.emits(cos > 0.0) {
        return NO_LIGHT;
    }
    let mut radiance = material.emission;
    if const { has(FEATURES, TEXTURES) } {
        // SAFETY: the scene's textures are proven.
        unsafe {
            radiance *= texture::color(scene, material.emission_texture, texture_u, texture_v);
            radiance *= crate::bsdf::opacity(scene, &material, texture_u, texture_v);
        }
    }
    LightSample {
        direction,
        t_max: distance * 1.001, // only to skip what lies behind
        primitive,
        radiance,
        // SAFETY: the caller's promise.
        pdf: unsafe { pdf::<FEATURES>(params, scene, primitive, material.light_pdf, from, distance, -cos) },
        is_delta: false,
    }
}

/// Returns the pdf, per steradian at `from`, with which [`sample`] chooses the point of `primitive`
/// at `distance`. `cos` is the cosine of the direction to that point with the normal there;
/// `light_pdf` is that of its material.
///
/// # Safety
///
/// As [`sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn pdf<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    primitive: u32,
    light_pdf: f32,
    from: ReferencePoint,
    distance: f32,
    cos: f32,
) -> f32 {
    let is_sphere = (const { !has(FEATURES, PLANAR) } || primitive < params.first_planar)
        && (const { !has(FEATURES, TRIANGLES) } || primitive < params.first_triangle);
    if is_sphere {
        // SAFETY: the caller's promise.
        let sphere = unsafe { load::<Sphere>(scene.spheres, primitive) };
        let half_cone = sphere_cone(&sphere, primitive, from);
        if half_cone > 0.0 {
            // The far side, seen through holes of the near one, is never sampled.
            let chance = if cos > 0.0 { 0.0 } else { light_pdf };
            let chance = chance * (4.0 * PI * sphere.radius * sphere.radius);
            return chance / (2.0 * PI * half_cone);
        }
    }
    light_pdf * distance * distance / max(cos.abs(), 1e-9)
}

/// Returns the weight of a sample with pdf `own` that another technique finds with pdf `other`: the
/// power heuristic with exponent 2 (Veach and Guibas, SIGGRAPH 1995). The two weights of a pair sum
/// to 1.
#[inline(always)]
pub fn mis_weight(own: f32, other: f32) -> f32 {
    // The larger pdf is divided out, so neither square overflows.
    let ratio = if own >= other { other / own } else { own / other };
    let square = ratio * ratio;
    if own >= other { 1.0 / (1.0 + square) } else { square / (1.0 + square) }
}
