//! Connections to lights, by next-event estimation and by chance.

use super::{LIGHT_BLOCK, PANORAMA_BLOCK};
use crate::bsdf::Bsdf;
use crate::bvh::Hit;
use crate::features::{EMITTERS, ENVIRONMENT, Features, TEXTURES, has};
use crate::light::{self, Vertex, mis_weight};
use crate::material::Material;
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::rng::PathKey;
use crate::sampler::words;
use crate::scene::Scene;
use crate::surface::Surface;
use crate::texture;
use glam::Vec3;

/// What the surface emits towards the ray, by the weight of having found it by scattering with `density`.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); `hit` is of its traversal.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of the path's turn")]
pub(super) unsafe fn emission<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    material: &Material,
    surface: &Surface,
    ray: Ray,
    hit: Hit,
    vertex: u32,
    travelled: f32,
    density: f32,
) -> Vec3 {
    let mut emission = material.emission;
    if const { has(FEATURES, TEXTURES) } {
        // SAFETY: the caller's promise for textures.
        emission *= unsafe { texture::color(scene, material.emission_texture, surface.u, surface.v) };
    }
    if density > 0.0 && params.lights > 0 {
        let from = Vertex { point: ray.origin - ray.direction * travelled, primitive: vertex };
        let distance = travelled + hit.distance;
        let cos = ray.direction.dot(surface.normal);
        let chance = material.light_density;
        // SAFETY: the caller's promise.
        let other =
            unsafe { light::density::<FEATURES>(params, scene, hit.primitive, chance, from, distance, cos) };
        emission *= mis_weight(density, other);
    }
    emission
}

/// A connection to a light, before it is known whether something is between.
pub(super) struct Connection {
    pub direction: Vec3,
    pub limit: f32,
    /// The light's primitive.
    pub target: u32,
    /// What it adds for a throughput of 1.
    pub gathered: Vec3,
    /// Whether it leaves the surface to its inside.
    pub inside: bool,
}

/// Next-event estimation at a vertex.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); there is a light or a panorama to sample.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of the path's turn")]
pub(super) unsafe fn connect<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    key: PathKey,
    segment: u32,
    primitive: u32,
    surface: &Surface,
    bsdf: &Bsdf,
    front: bool,
) -> Connection {
    let random = words::<FEATURES>(key, LIGHT_BLOCK | segment);
    let mut choice = 0;
    if const { has(FEATURES, ENVIRONMENT) } && const { has(FEATURES, EMITTERS) } && params.lights > 0 {
        choice = words::<FEATURES>(key, PANORAMA_BLOCK | segment).x;
    }
    let from = Vertex { point: surface.point, primitive };
    // SAFETY: the caller's promise.
    let light = unsafe { light::sample::<FEATURES>(params, scene, from, random, choice) };
    let outside = light.direction.dot(surface.normal) > 0.0;
    let mut value = Vec3::ZERO;
    // A direction between the horizons of the surface and of its shading normal would leak.
    if (bsdf.cosine(light.direction) > 0.0) == (outside == front) {
        let evaluation = bsdf.evaluate::<FEATURES>(light.direction);
        let weight = if light.is_delta { 1.0 } else { mis_weight(light.density, evaluation.density) };
        value = evaluation.value * light.radiance * (weight / light.density);
    }
    Connection {
        direction: light.direction,
        limit: light.limit,
        target: light.primitive,
        gathered: value,
        inside: !outside,
    }
}
