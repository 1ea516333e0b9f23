//! Shading: the end of a path's ray, at a light, in the sky or at a vertex, which the path passes,
//! or which emits, is connected to a light and scatters.

use super::nee::weighted_emission;
use super::vertex::{FacingNormals, Vertex};
use super::{MAX_PASSES, Path, blocks};
use crate::aovs::{self, AovSums, SurfaceAovs};
use crate::attributes::SurfaceAttributes;
use crate::bsdf::{Bsdf, BsdfSample, is_layered, is_pane, slots};
use crate::buffer::SharedSlice;
use crate::bvh::{Hit, NO_PRIMITIVE};
use crate::features::{
    AOVS, EMITTERS, ENVIRONMENT, FeatureSet, Features, HOLES, LAYERS, LIGHT_TREE, MEDIA, NEE, PANES, PORTALS,
    REFRACTED_LIGHT,
};
use crate::layers::SOLID;
use crate::light::{self, mis_weight};
use crate::material::{BLENDED, MASKED};
use crate::math::{max, max_component, unit_f32};
use crate::medium::transmittance;
use crate::params::{FLAG_HIDDEN_SKY, RenderParams};
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
    pub(super) unsafe fn shade<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        aovs: &mut SharedSlice<AovSums>,
    ) -> bool {
        self.rays += 1;
        if features.has::<MEDIA>() {
            // SAFETY: the caller's promise.
            unsafe {
                let vertex = self.fly(features, params, scene, hit.distance);
                if vertex.collided {
                    return self.shade_medium(features, params, scene, vertex, aovs);
                }
            }
        }
        let mut ended = true;
        let blocked = hit.primitive != NO_PRIMITIVE && hit.primitive != self.light_primitive;
        if features.has::<NEE>() && self.shadow && !(features.has::<{ HOLES | PANES }>() && blocked) {
            if !blocked {
                self.radiance += self.pending_light;
            }
            ended = self.end_connection();
        } else if hit.primitive == NO_PRIMITIVE {
            self.segment += 1;
            // SAFETY: the caller's promise.
            unsafe { self.add_sky(features, params, scene, aovs) };
        } else {
            // SAFETY: the caller's promise.
            ended = unsafe { self.shade_surface(features, params, scene, hit, aovs) };
        }
        ended
    }

    /// Returns whether the path passes a surface of this opacity. Only a partial one takes a random
    /// number: that of the sampler of the kernel, which spreads the choices evenly over samples and
    /// pixels.
    #[inline(always)]
    fn chooses_to_pass<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        opacity: f32,
    ) -> bool {
        let mut passed = opacity <= 0.0;
        if opacity > 0.0 && opacity < 1.0 {
            let random = words(features, self.key, blocks::passing(self.segment, self.passes));
            passed = unit_f32(random.x) >= opacity;
        }
        passed
    }

    /// Continues the path beyond the surface at `vertex`, which is no segment. Returns whether the
    /// path ended.
    #[inline(always)]
    fn pass_hole<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        vertex: &Vertex,
    ) -> bool {
        self.segment -= 1;
        self.passes += 1;
        self.skipped_distance += vertex.hit.distance;
        self.pass(features, vertex);
        self.passes > MAX_PASSES
    }

    /// Adds the radiance of the sky, which ends the path.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn add_sky<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        aovs: &mut SharedSlice<AovSums>,
    ) {
        // SAFETY: the caller's promise.
        let seen = unsafe { light::sky::radiance(features, params, scene, self.ray.direction) };
        let mut sky = seen.radiance;
        if features.has::<{ ENVIRONMENT | PORTALS }>() && self.pdf > 0.0 {
            let from = self.reference(&self.ray);
            // SAFETY: the caller's promise.
            sky *= mis_weight(self.pdf, unsafe { light::sky::pdf(features, params, scene, &from, &seen) });
        }
        if self.segment == 1 && params.flags & FLAG_HIDDEN_SKY != 0 {
            sky = Vec3::ZERO;
        }
        self.radiance += self.throughput * sky;
        if features.has::<AOVS>() && self.segment == 1 {
            // SAFETY: the caller's promise.
            unsafe { aovs::update_pixel(aovs, self.pixel, |g: &mut AovSums| g.add_miss(sky)) };
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
    unsafe fn shade_surface<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        aovs: &mut SharedSlice<AovSums>,
    ) -> bool {
        let is_shadow = features.has::<NEE>() && features.has::<{ HOLES | PANES }>() && self.shadow;
        let of_shadow = if features.has::<PANES>() { slots::PASSING } else { slots::ALBEDO };
        let wanted = if is_shadow { of_shadow } else { slots::ALL };
        // SAFETY: the caller's promise.
        let vertex = unsafe { Vertex::at(features, params, scene, self.ray, hit, wanted) };
        if is_shadow {
            return self.attenuate(features, params, &vertex);
        }
        self.segment += 1;
        if features.has::<LAYERS>() {
            self.absorb(hit.distance);
        }
        let front = vertex.is_front();
        let mut passed = false;
        if features.has::<HOLES>() && vertex.material.flags & (MASKED | BLENDED) != 0 {
            passed = self.chooses_to_pass(features, vertex.opacity(features));
        }
        if passed {
            return self.pass_hole(features, &vertex);
        }
        let mut emitted = Vec3::ZERO;
        if features.has::<EMITTERS>() && vertex.material.emits(front) {
            // SAFETY: the caller's promise.
            emitted = unsafe { weighted_emission(features, params, scene, self, &vertex) };
            self.radiance += self.throughput * emitted;
        }
        let continues = self.segment < params.max_depth;
        let writes_aovs = features.has::<AOVS>() && self.segment == 1;
        let mut ended = true;
        if continues || writes_aovs {
            let normals = vertex.facing_normals(features, params, front);
            let bsdf = self.bsdf(features, &vertex, &normals, front);
            if writes_aovs {
                let aov_sample =
                    SurfaceAovs { albedo: bsdf.albedo(features), diffuse: bsdf.diffuseness(features) };
                let add_hit = |g: &mut AovSums| {
                    g.add_hit(
                        hit.named(features, params),
                        normals.of_bsdf.shading,
                        aov_sample,
                        vertex.surface.point,
                        emitted,
                    )
                };
                // SAFETY: the caller's promise.
                unsafe { aovs::update_pixel(aovs, self.pixel, add_hit) };
            }
            if continues {
                // SAFETY: the caller's promise.
                let connection = unsafe { self.connect(features, params, scene, &vertex, &bsdf, front) };
                let random = words(features, self.key, blocks::scattering(self.segment));
                if features.has::<REFRACTED_LIGHT>() {
                    // SAFETY: the caller's promise; the feature says that there are lights and
                    // glass.
                    unsafe { self.add_refracted_light(features, params, scene, &vertex, &bsdf, front) };
                }
                let (direction, evaluates) = (connection.light.direction, connection.is_possible);
                let (scatter, eval) = bsdf.sample_and_evaluate(features, random, direction, evaluates);
                if features.has::<NEE>() {
                    self.begin_connection(&connection, eval);
                    if features.has::<LAYERS>() {
                        self.absorb_connection(features, &vertex, &connection, front);
                    }
                }
                self.scatter(features, params, &vertex, &normals, &scatter, random.w);
                self.keep_reference(features, &vertex, &scatter, &bsdf);
                if is_layered(features, vertex.material.kind)
                    && scatter.transmitted
                    && vertex.layers.flags & SOLID != 0
                {
                    self.absorption = if front { vertex.layers.absorption } else { Vec3::ZERO };
                }
                let inside = front == scatter.transmitted;
                self.leave_surface(features, &vertex, front, inside, connection.inside);
                self.continuation = vertex.leave(features, scatter.direction, inside);
                ended = !self.continues && !self.shadow;
                self.ray = if features.has::<NEE>() && self.shadow {
                    vertex.leave(features, direction, connection.inside)
                } else {
                    self.continuation
                };
            }
        }
        ended
    }

    /// Keeps what weights a light that the path hits next: the vertex, as light sampling sees it,
    /// and the pdf of the direction.
    #[inline(always)]
    fn keep_reference<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        vertex: &Vertex,
        scatter: &BsdfSample,
        bsdf: &Bsdf,
    ) {
        if scatter.transmitted && is_pane(features, &vertex.material) {
            // Light sampling from the vertex before finds what lies behind, too.
            self.skipped_distance += vertex.hit.distance;
        } else {
            (self.pdf, self.vertex_primitive) = (scatter.pdf, vertex.hit.primitive);
            self.skipped_distance = 0.0;
            if features.has::<{ LIGHT_TREE | PORTALS }>() {
                self.vertex_normal = bsdf.reflecting_normal(features);
            }
        }
    }

    /// Returns the BSDF at `vertex`, seen along the path's ray.
    #[inline(always)]
    fn bsdf<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        vertex: &Vertex,
        normals: &FacingNormals,
        front: bool,
    ) -> Bsdf {
        let (mut material, mut dispersed) = (vertex.material, Vec3::ONE);
        if is_layered(features, material.kind) && vertex.layers.dispersion > 0.0 {
            (material.ior, dispersed) = self.disperse(vertex);
        }
        let mut layers = vertex.layers;
        if is_layered(features, material.kind) {
            let coat = if front { layers.coat_normal } else { -layers.coat_normal };
            layers.coat_normal = normals.of_coat(features, coat, -vertex.ray.direction);
        }
        let SurfaceAttributes { tangent, handedness, .. } = vertex.surface.attributes;
        Bsdf::new(features, material, vertex.ray.direction, normals.of_bsdf, front)
            .with_layers(features, layers, tangent, handedness, dispersed)
    }

    /// Weakens the path by the absorption of the solid that its ray passed through for a distance
    /// (Beer and Lambert's law).
    #[inline(always)]
    fn absorb(&mut self, distance: f32) {
        if self.absorption.dot(self.absorption) > 0.0 {
            self.throughput *= transmittance(self.absorption, distance);
        }
    }

    /// Chooses the colour of the light that a dispersive surface refracts, by what the path still
    /// carries. Returns the index of refraction for it, and the factor of refracted light.
    #[inline(always)]
    fn disperse(&self, vertex: &Vertex) -> (f32, Vec3) {
        let (ior, spread, t) = (vertex.material.ior, vertex.layers.dispersion, self.throughput);
        let u = unit_f32(self.key.words(blocks::color(self.segment)).x) * (t.x + t.y + t.z);
        let sum = t.x + t.y + t.z;
        if u < t.x {
            (max(ior - spread, 1.0), Vec3::new(sum * (1.0 / t.x), 0.0, 0.0))
        } else if u < t.x + t.y {
            (ior, Vec3::new(0.0, sum * (1.0 / t.y), 0.0))
        } else if t.z > 0.0 {
            (ior + spread, Vec3::new(0.0, 0.0, sum * (1.0 / t.z)))
        } else {
            (ior, Vec3::ZERO)
        }
    }

    /// Continues the path from `vertex` in the direction of `scatter`, if `self.continues`;
    /// `survival` is the random word of roulette.
    #[inline(always)]
    fn scatter<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        vertex: &Vertex,
        normals: &FacingNormals,
        scatter: &BsdfSample,
        survival: u32,
    ) {
        self.throughput *= scatter.weight;
        self.continues = !scatter.absorbed;
        if normals.differ {
            // Light that the shading normal sends through the surface is lost, unless the smooth
            // surface lies above.
            let is_below = scatter.direction.dot(normals.geometric) < 0.0;
            let is_lifted = !scatter.transmitted && vertex.surface.smooth_height > 0.0;
            self.continues &= is_below == scatter.transmitted || is_lifted;
        }
        if features.has::<NEE>() {
            self.continues &= max_component(self.throughput) > 0.0;
        }
        self.play_roulette(features, params, survival);
    }
}
