//! Connections of a path to lights: by next-event estimation, and by hitting an emitter.

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

/// Returns the radiance that the surface emits towards the ray, times the weight of having found it
/// by scattering with `pdf`.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); `hit` comes from the traversal of `ray`.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of `Path::shade`, which passes its state")]
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

/// Connection to a light, before the shadow ray is traced.
pub(super) struct Connection {
    pub direction: Vec3,
    pub t_max: f32,
    /// Primitive of the light.
    pub light_primitive: u32,
    /// Radiance that it adds for a throughput of 1.
    pub contribution: Vec3,
    /// True if it leaves the surface to its inside.
    pub inside: bool,
}

/// Samples the direct light at a vertex by next-event estimation.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); there is a light or an environment map to sample.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of `Path::shade`, which passes its state")]
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
    // Light between the horizons of the surface and of its shading normal would leak.
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
