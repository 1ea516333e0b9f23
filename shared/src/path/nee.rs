//! Connections of a path to lights: by next-event estimation, and by hitting an emitter.

use super::vertex::Vertex;
use super::{Path, blocks};
use crate::bsdf::{Bsdf, BsdfEval};
use crate::features::{EMITTERS, ENVIRONMENT, FeatureSet, Features, NEE, PUNCTUAL};
use crate::light::{self, LightSample, NO_LIGHT, ReferencePoint, mis_weight};
use crate::params::RenderParams;
use crate::sampler::words;
use crate::scene::Scene;
use glam::Vec3;

/// Returns the radiance that `vertex` emits towards the path's ray, times the weight of having
/// found it by scattering.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); `vertex` comes from the traversal of the path's ray.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn weighted_emission<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    path: &Path,
    vertex: &Vertex,
) -> Vec3 {
    let Vertex { ray, hit, surface, material, .. } = vertex;
    let mut emission = material.emission;
    if features.has::<NEE>() && path.pdf > 0.0 && params.light_count > 0 {
        let from = ReferencePoint {
            point: ray.origin - ray.direction * path.skipped_distance,
            primitive: path.vertex_primitive,
            normal: path.vertex_normal,
        };
        let distance = path.skipped_distance + hit.distance;
        let cos = ray.direction.dot(surface.normal);
        let chance = material.light_pdf;
        // SAFETY: the caller's promise.
        let light_pdf =
            unsafe { light::pdf(features, params, scene, hit.primitive, chance, from, distance, cos) };
        emission *= mis_weight(path.pdf, light_pdf);
    }
    emission
}

/// Connection to a light, before the shadow ray is traced.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub(super) struct Connection {
    pub light: LightSample,
    /// True if the surface may scatter light from there.
    pub is_possible: bool,
    /// True if it leaves the surface to its inside.
    pub inside: bool,
}

impl Connection {
    /// Connection of a surface that is not connected to a light.
    pub const NONE: Self = Self { light: NO_LIGHT, is_possible: false, inside: false };

    /// Returns the radiance that the connection adds for a throughput of 1.
    #[inline(always)]
    pub fn contribution(&self, eval: BsdfEval) -> Vec3 {
        let Self { light, is_possible, .. } = *self;
        if !is_possible {
            return Vec3::ZERO;
        }
        let weight = if light.is_delta { 1.0 } else { mis_weight(light.pdf, eval.pdf) };
        eval.value * light.radiance * (weight * (1.0 / light.pdf))
    }
}

/// Samples the direct light at a vertex for next-event estimation.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel); there is a light or an environment map to sample.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn sample_direct_light<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    path: &Path,
    vertex: &Vertex,
    bsdf: &Bsdf,
    front: bool,
) -> Connection {
    let Vertex { hit, surface, .. } = vertex;
    let random = words(features, path.key, blocks::light(path.segment));
    let mut choice = 0;
    if features.has::<ENVIRONMENT>() && features.has::<{ EMITTERS | PUNCTUAL }>() && params.light_count > 0 {
        choice = words(features, path.key, blocks::environment(path.segment)).x;
    }
    let normal = bsdf.reflecting_normal(features);
    let from = ReferencePoint { point: surface.point, primitive: hit.primitive, normal };
    // SAFETY: the caller's promise.
    let light = unsafe { light::sample(features, params, scene, from, random, choice) };
    let outside = light.direction.dot(surface.normal) > 0.0;
    let is_lifted = vertex.is_lifted(bsdf, light.direction);
    let is_possible = vertex.scatters(bsdf, light.direction, front);
    Connection { light, is_possible, inside: if is_lifted { !front } else { !outside } }
}
