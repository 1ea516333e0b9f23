//! Shading: the end of a path's ray, at a light, in the sky or at a vertex, which the path passes,
//! or which emits, is connected to a light and scatters.

use super::nee::{sample_direct_light, weighted_emission};
use super::vertex::{FacingNormals, Vertex};
use super::{MAX_PASSES, PASS_BLOCK, Path};
use crate::aovs::{self, AovSums, SurfaceAovs};
use crate::bsdf::Bsdf;
use crate::buffer::SharedSlice;
use crate::bvh::{Hit, NO_PRIMITIVE};
use crate::environment;
use crate::features::{
    AOVS, EMITTERS, ENVIRONMENT, Features, MICROFACETS, NEE, ROULETTE, TEXTURES, has, has_any,
};
use crate::light::mis_weight;
use crate::material::{BLENDED, MASKED};
use crate::math::{max_component, min, unit_f32};
use crate::params::{FLAG_HOLES, FLAG_SCHLICK, RenderParams};
use crate::ray::Ray;
use crate::sampler::words;
use crate::scene::Scene;
use glam::Vec3;

impl Path {
    /// Continues the path from the hit of its ray. Returns whether the path ended.
    ///
    /// # Safety
    ///
    /// As [`render_pixel`](super::render_pixel); `hit` comes from the traversal of the path's ray.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) unsafe fn shade<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        aovs: &mut SharedSlice<AovSums>,
    ) -> bool {
        self.rays += 1;
        let mut ended = true;
        if const { has_any(FEATURES, NEE) } && self.shadow {
            let blocked = hit.primitive != NO_PRIMITIVE && hit.primitive != self.light_primitive;
            let mut passed = false;
            if const { has(FEATURES, TEXTURES) } && blocked && params.flags & FLAG_HOLES != 0 {
                // SAFETY: the caller's promise.
                let vertex = unsafe { Vertex::at::<FEATURES>(params, scene, self.ray, hit) };
                // SAFETY: as above.
                self.pending_light *= 1.0 - unsafe { vertex.opacity(scene) };
                self.passes += 1;
                passed = max_component(self.pending_light) > 0.0 && self.passes <= MAX_PASSES;
                self.ray = vertex.pass();
                self.shadow_t_max -= hit.distance;
            }
            ended = false;
            if !passed {
                if !blocked {
                    self.radiance += self.pending_light;
                }
                self.shadow = false;
                self.ray = self.continuation;
                ended = !self.continues;
            }
        } else if hit.primitive == NO_PRIMITIVE {
            self.segment += 1;
            // SAFETY: the caller's promise.
            unsafe { self.add_sky::<FEATURES>(params, scene, aovs) };
        } else {
            self.segment += 1;
            // SAFETY: the caller's promise.
            ended = unsafe { self.shade_surface::<FEATURES>(params, scene, hit, aovs) };
        }
        ended
    }

    /// Adds the radiance of the sky, which ends the path.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn add_sky<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        scene: Scene,
        aovs: &mut SharedSlice<AovSums>,
    ) {
        let direction = self.ray.direction;
        let mut sky = params.sky.radiance(direction);
        if const { has(FEATURES, ENVIRONMENT) } && params.environment_width > 0 {
            // SAFETY: the caller's promise.
            let from = unsafe { environment::radiance(params, scene, direction) };
            let light_pdf = from.pdf * params.environment_probability;
            sky = from.radiance * if self.pdf > 0.0 { mis_weight(self.pdf, light_pdf) } else { 1.0 };
        }
        self.radiance += self.throughput * sky;
        if const { has(FEATURES, AOVS) } && self.segment == 1 {
            // SAFETY: the caller's promise.
            unsafe { aovs::update_pixel(aovs, self.key.pixel, |g: &mut AovSums| g.add_miss(sky)) };
        }
    }

    /// Passes the surface at `hit` if it is not opaque there; otherwise adds what it emits and
    /// scatters. Returns whether the path ended.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`]; a primitive was hit.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn shade_surface<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        aovs: &mut SharedSlice<AovSums>,
    ) -> bool {
        // SAFETY: the caller's promise.
        let vertex = unsafe { Vertex::at::<FEATURES>(params, scene, self.ray, hit) };
        let front = vertex.is_front();
        let mut passed = false;
        if const { has(FEATURES, TEXTURES) } && vertex.material.flags & (MASKED | BLENDED) != 0 {
            // SAFETY: the caller's promise.
            let alpha = unsafe { vertex.opacity(scene) };
            passed = unit_f32(self.key.words(PASS_BLOCK | self.segment << 10 | self.passes).x) >= alpha;
        }
        if passed {
            self.segment -= 1;
            self.passes += 1;
            self.skipped_distance += hit.distance;
            self.ray = vertex.pass();
            return self.passes > MAX_PASSES;
        }
        let mut emitted = Vec3::ZERO;
        if const { has(FEATURES, EMITTERS) } && vertex.material.emits(front) {
            // SAFETY: the caller's promise.
            emitted = unsafe { weighted_emission::<FEATURES>(params, scene, self, &vertex) };
            self.radiance += self.throughput * emitted;
        }
        let continues = self.segment < params.max_depth;
        let writes_aovs = const { has(FEATURES, AOVS) } && self.segment == 1;
        let mut ended = true;
        if continues || writes_aovs {
            let normals = vertex.facing_normals::<FEATURES>(params, front);
            // SAFETY: the caller's promise for textures.
            let bsdf = unsafe {
                let place = (vertex.surface.u, vertex.surface.v);
                let direction = vertex.ray.direction;
                Bsdf::new::<FEATURES>(scene, vertex.material, direction, normals.shading, front, place)
            };
            if writes_aovs {
                let aov_sample = SurfaceAovs {
                    albedo: bsdf.albedo::<FEATURES>(),
                    diffuse: bsdf.diffuseness::<FEATURES>(),
                };
                let add_hit = |g: &mut AovSums| {
                    g.add_hit(hit.primitive, normals.shading, aov_sample, vertex.surface.point, emitted)
                };
                // SAFETY: the caller's promise.
                unsafe { aovs::update_pixel(aovs, self.key.pixel, add_hit) };
            }
            if continues {
                // SAFETY: the caller's promise.
                let light = unsafe { self.connect::<FEATURES>(params, scene, &vertex, &bsdf, front) };
                self.scatter::<FEATURES>(params, &vertex, &normals, &bsdf, front);
                ended = !self.continues && !self.shadow;
                self.ray =
                    if const { has_any(FEATURES, NEE) } && self.shadow { light } else { self.continuation };
            }
        }
        ended
    }

    /// Samples the direct light at `vertex`, if there is a light and the surface is not a mirror.
    /// Returns the shadow ray; `self.shadow` says whether it must be traced.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn connect<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        scene: Scene,
        vertex: &Vertex,
        bsdf: &Bsdf,
        front: bool,
    ) -> Ray {
        let mut shadow_ray = vertex.ray;
        if const { has_any(FEATURES, NEE) }
            && (params.light_count > 0 || params.environment_probability > 0.0)
            && bsdf.has_non_delta_lobe::<FEATURES>()
        {
            // SAFETY: the caller's promise.
            let light = unsafe { sample_direct_light::<FEATURES>(params, scene, self, vertex, bsdf, front) };
            self.pending_light = self.throughput * light.contribution;
            self.shadow = max_component(self.pending_light) > 0.0;
            (self.shadow_t_max, self.light_primitive) = (light.t_max, light.light_primitive);
            shadow_ray = vertex.leave::<FEATURES>(light.direction, light.inside);
        }
        shadow_ray
    }

    /// Samples the direction in which the path leaves `vertex`: the path's continuation, if
    /// `self.continues`.
    #[inline(always)]
    fn scatter<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        vertex: &Vertex,
        normals: &FacingNormals,
        bsdf: &Bsdf,
        front: bool,
    ) {
        let random = words::<FEATURES>(self.key, self.segment);
        let uses_schlick = const { !has(FEATURES, MICROFACETS) } || params.flags & FLAG_SCHLICK != 0;
        let scatter = bsdf.sample::<FEATURES>(uses_schlick, random);
        self.throughput *= scatter.weight;
        self.continues = !scatter.absorbed;
        if normals.differ {
            // Light that the shading normal sends through the surface is lost.
            self.continues &= (scatter.direction.dot(normals.geometric) < 0.0) == scatter.transmitted;
        }
        if const { has_any(FEATURES, NEE) } {
            self.continues &= max_component(self.throughput) > 0.0;
        }
        if const { has(FEATURES, ROULETTE) } && self.segment >= params.roulette_from {
            let survival = min(max_component(self.throughput), 1.0);
            self.continues &= unit_f32(random.w) < survival;
            self.throughput *= 1.0 / survival;
        }
        let inside = front == scatter.transmitted;
        self.pdf = scatter.pdf;
        self.vertex_primitive = vertex.hit.primitive;
        self.skipped_distance = 0.0;
        self.continuation = vertex.leave::<FEATURES>(scatter.direction, inside);
    }
}
