//! Connections of a path to lights: by next-event estimation, and by hitting an emitter.

use super::vertex::Vertex;
use super::{LIGHT_BLOCK, PANORAMA_BLOCK, Path};
use crate::bsdf::Bsdf;
use crate::features::{EMITTERS, ENVIRONMENT, Features, TEXTURES, has};
use crate::light::{self, ReferencePoint, mis_weight};
use crate::params::RenderParams;
use crate::sampler::words;
use crate::scene::Scene;
use crate::texture;
use glam::Vec3;

/// Returns the radiance that `vertex` emits towards the path's ray, times the weight of having
/// found it by scattering.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); `vertex` comes from the traversal of the path's ray.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn weighted_emission<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    path: &Path,
    vertex: &Vertex,
) -> Vec3 {
    let Vertex { ray, hit, surface, material } = vertex;
    let mut emission = material.emission;
    if const { has(FEATURES, TEXTURES) } {
        // SAFETY: the caller's promise for textures.
        emission *= unsafe { texture::color(scene, material.emission_texture, surface.u, surface.v) };
    }
    if path.pdf > 0.0 && params.light_count > 0 {
        let from = ReferencePoint {
            point: ray.origin - ray.direction * path.skipped_distance,
            primitive: path.vertex_primitive,
        };
        let distance = path.skipped_distance + hit.distance;
        let cos = ray.direction.dot(surface.normal);
        let chance = material.light_pdf;
        // SAFETY: the caller's promise.
        let light_pdf =
            unsafe { light::pdf::<FEATURES>(params, scene, hit.primitive, chance, from, distance, cos) };
        emission *= mis_weight(path.pdf, light_pdf);
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
pub(super) unsafe fn sample_direct_light<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    path: &Path,
    vertex: &Vertex,
    bsdf: &Bsdf,
    front: bool,
) -> Connection {
    let Vertex { hit, surface, .. } = vertex;
    let random = words::<FEATURES>(path.key, LIGHT_BLOCK | path.segment);
    let mut choice = 0;
    if const { has(FEATURES, ENVIRONMENT) } && const { has(FEATURES, EMITTERS) } && params.light_count > 0 {
        choice = words::<FEATURES>(path.key, PANORAMA_BLOCK | path.segment).x;
    }
    let from = ReferencePoint { point: surface.point, primitive: hit.primitive };
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
