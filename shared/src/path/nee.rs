//! Connections of a path to lights: by next-event estimation, and by hitting an emitter.

use super::vertex::Vertex;
use super::{Path, blocks};
use crate::bsdf::{Bsdf, BsdfEval};
use crate::features::{EMITTERS, ENVIRONMENT, FeatureSet, Features, NEE, PORTALS, PUNCTUAL};
use crate::light::{self, LightSample, NO_LIGHT, ReferencePoint, mis_weight};
use crate::params::RenderParams;
use crate::ray::Ray;
use crate::rng::Words;
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
        let from = path.reference(ray);
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

impl Path {
    /// Returns the vertex from which `ray` left, which may have passed panes and holes since.
    #[inline(always)]
    pub(super) fn reference(&self, ray: &Ray) -> ReferencePoint {
        ReferencePoint {
            point: ray.origin - ray.direction * self.skipped_distance,
            primitive: self.vertex_primitive,
            normal: self.vertex_normal,
        }
    }

    /// Returns the words that choose between the sky and other lights, and how to sample the sky;
    /// zeros where nothing is to be chosen.
    #[inline(always)]
    pub(super) fn choice_of_sky<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
    ) -> Words {
        let of_lights = features.has::<ENVIRONMENT>()
            && features.has::<{ EMITTERS | PUNCTUAL }>()
            && params.light_count > 0;
        if of_lights || features.has::<PORTALS>() {
            words(features, self.key, blocks::environment(self.segment))
        } else {
            Words { x: 0, y: 0, z: 0, w: 0 }
        }
    }
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
/// As [`render_pixel`](super::render_pixel); there is a light or a sky to sample.
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
    let choice = path.choice_of_sky(features, params);
    let normal = bsdf.reflecting_normal(features);
    let from = ReferencePoint { point: surface.point, primitive: hit.primitive, normal };
    // SAFETY: the caller's promise.
    let light = unsafe { light::sample(features, params, scene, from, random, choice) };
    let outside = light.direction.dot(surface.normal) > 0.0;
    let is_lifted = vertex.is_lifted(bsdf, light.direction);
    let is_possible = vertex.scatters(bsdf, light.direction, front);
    Connection { light, is_possible, inside: if is_lifted { !front } else { !outside } }
}
