//! Connections to lights, by next-event estimation and by chance.

use super::{LIGHT_BLOCK, PANORAMA_BLOCK};
use crate::bsdf::Bsdf;
use crate::bvh::Hit;
use crate::features::{EMITTERS, ENVIRONMENT, Features, TEXTURES, has};
use crate::light::{self, ReferencePoint, mis_weight};
use crate::material::Material;
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::rng::PathKey;
use crate::sampler::words;
use crate::scene::Scene;
use crate::surface::Surface;
use crate::texture;
use glam::Vec3;

/// What the surface emits towards the ray, by the weight of having found it by scattering with
/// `pdf`.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); `hit` is of its traversal.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of the path's turn")]
pub(super) unsafe fn weighted_emission<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    material: &Material,
    surface: &Surface,
    ray: Ray,
    hit: Hit,
    from_primitive: u32,
    skipped_distance: f32,
    pdf: f32,
) -> Vec3 {
    let mut emission = material.emission;
    if const { has(FEATURES, TEXTURES) } {
        // SAFETY: the caller's promise for textures.
        emission *= unsafe { texture::color(scene, material.emission_texture, surface.u, surface.v) };
    }
    if pdf > 0.0 && params.light_count > 0 {
        let from = ReferencePoint {
            point: ray.origin - ray.direction * skipped_distance,
            primitive: from_primitive,
        };
        let distance = skipped_distance + hit.distance;
        let cos = ray.direction.dot(surface.normal);
        let chance = material.light_pdf;
        // SAFETY: the caller's promise.
        let light_pdf =
            unsafe { light::pdf::<FEATURES>(params, scene, hit.primitive, chance, from, distance, cos) };
        emission *= mis_weight(pdf, light_pdf);
    }
    emission
}

/// A connection to a light, before it is known whether something is between.
pub(super) struct Connection {
    pub direction: Vec3,
    pub t_max: f32,
    /// The light's primitive.
    pub light_primitive: u32,
    /// What it adds for a throughput of 1.
    pub contribution: Vec3,
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
pub(super) unsafe fn sample_direct_light<const FEATURES: Features>(
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
    if const { has(FEATURES, ENVIRONMENT) } && const { has(FEATURES, EMITTERS) } && params.light_count > 0 {
        choice = words::<FEATURES>(key, PANORAMA_BLOCK | segment).x;
    }
    let from = ReferencePoint { point: surface.point, primitive };
    // SAFETY: the caller's promise.
    let light = unsafe { light::sample::<FEATURES>(params, scene, from, random, choice) };
    let outside = light.direction.dot(surface.normal) > 0.0;
    let mut value = Vec3::ZERO;
    // A direction between the horizons of the surface and of its shading normal would leak.
    if (bsdf.cosine(light.direction) > 0.0) == (outside == front) {
        let bsdf_eval = bsdf.evaluate::<FEATURES>(light.direction);
        let weight = if light.is_delta { 1.0 } else { mis_weight(light.pdf, bsdf_eval.pdf) };
        value = bsdf_eval.value * light.radiance * (weight / light.pdf);
    }
    Connection {
        direction: light.direction,
        t_max: light.t_max,
        light_primitive: light.primitive,
        contribution: value,
        inside: !outside,
    }
}
