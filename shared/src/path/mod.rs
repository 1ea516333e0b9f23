//! Path tracing: a sample from its camera ray to its radiance. [`render_pixel`] and
//! [`render_persistent`] are the render kernels, which entry points and the CPU backend call.

mod first_hit;
mod nee;
mod render;

pub use first_hit::{FirstHit, first_hit};
pub use render::{render_persistent, render_pixel};

use crate::aovs::{self, AovSums, SurfaceAovs};
use crate::bsdf::{Bsdf, LAMBERTIAN, opacity};
use crate::buffer::{SharedSlice, load};
use crate::bvh::{Hit, NO_PRIMITIVE, RayQuery};
use crate::environment;
use crate::features::{
    AOVS, EMITTERS, ENVIRONMENT, Features, MICROFACETS, NEE, PLANAR, ROULETTE, TEXTURES, TRIANGLES, has,
    has_any,
};
use crate::film::{Compensation, PixelSums};
use crate::light::mis_weight;
use crate::material::{BLENDED, MASKED, Material};
use crate::math::{max_component, min, unit_f32};
use crate::params::{FLAG_HOLES, FLAG_OPAQUE_ZERO, FLAG_SCHLICK, RenderParams};
use crate::ray::{OriginPrimitive, Ray};
use crate::rng::PathKey;
use crate::sampler::words;
use crate::scene::Scene;
use crate::sphere::MISS;
use crate::surface::{self, Surface, bend_shading_normal};
use glam::Vec3;
use nee::{sample_direct_light, weighted_emission};

/// Bits of blocks of random words. Block 0 is for the camera ray, block k for scattering at the
/// k-th vertex. Block k with one of these bits is for the point of a light, for the choice of the
/// environment map, and for passing a surface that is not opaque.
const LIGHT_BLOCK: u32 = 0x8000_0000;
const PANORAMA_BLOCK: u32 = 0xa000_0000;
const PASS_BLOCK: u32 = 0xc000_0000;

/// Maximum number of surfaces that a sample may pass because they are not opaque; beyond, its path
/// ends and its shadow rays are blocked, so that no path is endless.
const MAX_PASSES: u32 = 1023;

/// Returns `radiance` with each channel at most `limit`: less noise from rare bright paths, and a
/// darker mean. An infinite channel stays infinite, and no sum takes it. (Scaling the colour would
/// keep its hue, but needs a division, which costs time even if no limit is set:
/// docs/notebook/robustness-costs.md.)
#[inline(always)]
fn clamped(radiance: Vec3, limit: f32) -> Vec3 {
    let clamp = |c: f32| if c > limit && c.to_bits() < f32::INFINITY.to_bits() { limit } else { c };
    Vec3::new(clamp(radiance.x), clamp(radiance.y), clamp(radiance.z))
}

/// State of a sample between two of its rays. A shadow ray is traced like any other ray, so that
/// there is one traversal.
///
/// A path has at most `params.max_depth` segments, the connection to a light among them, and is
/// black beyond, as in "Ray Tracing in One Weekend". Vectors begin rows of 16 bytes: naga lays
/// records out so.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct Path {
    ray: Ray,
    /// Ray of the path after a shadow ray, if the path continues.
    continuation: Ray,
    throughput: Vec3,
    segment: u32,
    radiance: Vec3,
    /// Number of rays traced.
    rays: u32,
    /// Radiance that a light adds if the shadow ray reaches it.
    pending_light: Vec3,
    /// Number of surfaces passed because they are not opaque.
    passes: u32,
    key: PathKey,
    /// pdf of the direction that the path took last, per steradian; 0 if light sampling cannot find
    /// it.
    pdf: f32,
    /// Primitive of the vertex that the path left last.
    vertex_primitive: u32,
    /// Distance from that vertex to the ray's origin; above 0 after surfaces that the path passed.
    skipped_distance: f32,
    /// Maximum distance of the shadow ray.
    shadow_t_max: f32,
    /// Primitive of the light that the shadow ray is sent to.
    light_primitive: u32,
    /// True if the sample has no camera ray yet.
    needs_camera_ray: bool,
    /// True if the ray is a shadow ray.
    shadow: bool,
    /// True if the path continues after the shadow ray.
    continues: bool,
}

impl Path {
    /// Creates the path of the sample that `key` names.
    #[inline(always)]
    fn new(key: PathKey) -> Self {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, origin_primitive: OriginPrimitive::NONE };
        Self {
            key,
            needs_camera_ray: true,
            segment: 0,
            ray,
            throughput: Vec3::ONE,
            radiance: Vec3::ZERO,
            rays: 0,
            passes: 0,
            pdf: 0.0,
            vertex_primitive: NO_PRIMITIVE,
            skipped_distance: 0.0,
            shadow: false,
            shadow_t_max: MISS,
            light_primitive: NO_PRIMITIVE,
            pending_light: Vec3::ZERO,
            continuation: ray,
            continues: true,
        }
    }

    /// Starts the sample with the camera ray through pixel (`x`, `y`).
    #[inline(always)]
    fn begin_sample<const FEATURES: Features>(&mut self, params: &RenderParams, x: u32, y: u32) {
        self.ray = params.camera.ray(x, y, words::<FEATURES>(self.key, 0));
        self.needs_camera_ray = false;
        self.throughput = Vec3::ONE;
        self.radiance = Vec3::ZERO;
        self.pdf = 0.0;
        self.vertex_primitive = NO_PRIMITIVE;
        self.skipped_distance = 0.0;
    }

    /// Adds the finished sample to its pixel's sums, and moves on to the pixel's next sample.
    #[inline(always)]
    fn finish_sample<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        sums: &mut PixelSums,
        compensation: &mut Compensation,
    ) {
        sums.add(clamped(self.radiance, params.max_radiance), compensation, params.flags & FLAG_OPAQUE_ZERO);
        sums.segments += if const { has_any(FEATURES, NEE | TEXTURES) } { self.rays } else { self.segment };
        self.key.sample += 1;
        self.needs_camera_ray = true;
        self.segment = 0;
        self.passes = 0;
        self.rays = 0;
    }

    /// Returns the query of the current ray.
    #[inline(always)]
    fn query<const FEATURES: Features>(&self, params: &RenderParams) -> RayQuery {
        if const { has_any(FEATURES, NEE) } && self.shadow {
            let any = const { !has(FEATURES, TEXTURES) } || params.flags & FLAG_HOLES == 0;
            RayQuery { t_max: self.shadow_t_max, light_primitive: self.light_primitive, any_hit: any }
        } else {
            RayQuery::CLOSEST
        }
    }

    /// Continues the path from the hit of its ray. Returns whether the path ended.
    ///
    /// # Safety
    ///
    /// As [`render_pixel`]; `hit` comes from the traversal of the path's ray.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn shade<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        aovs: &mut SharedSlice<AovSums>,
    ) -> bool {
        let key = self.key;
        let ray = self.ray;
        self.rays += 1;
        let mut ended = true;
        let mut shadow_ray = ray;
        if const { has_any(FEATURES, NEE) } && self.shadow {
            let blocked = hit.primitive != NO_PRIMITIVE && hit.primitive != self.light_primitive;
            let mut passed = false;
            if const { has(FEATURES, TEXTURES) } && blocked && params.flags & FLAG_HOLES != 0 {
                // SAFETY: a primitive that traversal returned; the caller's promise for materials.
                let (surface, material) = unsafe {
                    let surface = surface::at::<FEATURES>(params, scene, ray, hit);
                    (surface, load::<Material>(scene.materials, surface.material))
                };
                // SAFETY: the caller's promise for textures.
                self.pending_light *= 1.0 - unsafe { opacity(scene, &material, surface.u, surface.v) };
                self.passes += 1;
                passed = max_component(self.pending_light) > 0.0 && self.passes <= MAX_PASSES;
                self.ray = pass_through(ray, hit.primitive, &surface);
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
            let mut sky = params.sky.radiance(ray.direction);
            if const { has(FEATURES, ENVIRONMENT) } && params.environment_width > 0 {
                // SAFETY: the caller's promise.
                let from = unsafe { environment::radiance(params, scene, ray.direction) };
                let light_pdf = from.pdf * params.environment_probability;
                sky = from.radiance * if self.pdf > 0.0 { mis_weight(self.pdf, light_pdf) } else { 1.0 };
            }
            self.radiance += self.throughput * sky;
            if const { has(FEATURES, AOVS) } && self.segment == 1 {
                // SAFETY: the caller's promise.
                unsafe { aovs::update_pixel(aovs, key.pixel, |g: &mut AovSums| g.add_miss(sky)) };
            }
        } else {
            self.segment += 1;
            // SAFETY: a primitive that traversal returned; the caller's promise for materials.
            let (surface, material) = unsafe {
                let surface = surface::at::<FEATURES>(params, scene, ray, hit);
                (surface, load::<Material>(scene.materials, surface.material))
            };
            let front = ray.direction.dot(surface.normal) < 0.0;
            let mut passed = false;
            if const { has(FEATURES, TEXTURES) } && material.flags & (MASKED | BLENDED) != 0 {
                // SAFETY: the caller's promise for textures.
                let alpha = unsafe { opacity(scene, &material, surface.u, surface.v) };
                passed = unit_f32(key.words(PASS_BLOCK | self.segment << 10 | self.passes).x) >= alpha;
            }
            if passed {
                self.segment -= 1;
                self.passes += 1;
                self.skipped_distance += hit.distance;
                self.ray = pass_through(ray, hit.primitive, &surface);
                ended = self.passes > MAX_PASSES;
            } else {
                let mut emitted = Vec3::ZERO;
                if const { has(FEATURES, EMITTERS) } && material.emits(front) {
                    // SAFETY: the caller's promise.
                    emitted = unsafe {
                        weighted_emission::<FEATURES>(
                            params,
                            scene,
                            &material,
                            &surface,
                            ray,
                            hit,
                            self.vertex_primitive,
                            self.skipped_distance,
                            self.pdf,
                        )
                    };
                    self.radiance += self.throughput * emitted;
                }
                let continues = self.segment < params.max_depth;
                let writes_aovs = const { has(FEATURES, AOVS) } && self.segment == 1;
                if continues || writes_aovs {
                    let normal = if front { surface.normal } else { -surface.normal };
                    let mut shading = normal;
                    // Only a triangle has a shading normal of its own: others keep their bits in
                    // every variant.
                    let bent = const { has(FEATURES, TRIANGLES) } && hit.primitive >= params.first_triangle;
                    if bent {
                        shading = if front { surface.shading_normal } else { -surface.shading_normal };
                        // A diffuse surface keeps its normal: its shading must not depend on the
                        // viewer.
                        if material.kind != LAMBERTIAN {
                            shading = bend_shading_normal(shading, normal, -ray.direction);
                        }
                    }
                    // SAFETY: the caller's promise for textures.
                    let bsdf = unsafe {
                        let place = (surface.u, surface.v);
                        Bsdf::new::<FEATURES>(scene, material, ray.direction, shading, front, place)
                    };
                    if writes_aovs {
                        let aov_sample = SurfaceAovs {
                            albedo: bsdf.albedo::<FEATURES>(),
                            diffuse: bsdf.diffuseness::<FEATURES>(),
                        };
                        let hit = |g: &mut AovSums| {
                            g.add_hit(hit.primitive, shading, aov_sample, surface.point, emitted)
                        };
                        // SAFETY: the caller's promise.
                        unsafe { aovs::update_pixel(aovs, key.pixel, hit) };
                    }
                    if continues {
                        if const { has_any(FEATURES, NEE) }
                            && (params.light_count > 0 || params.environment_probability > 0.0)
                            && bsdf.has_non_delta_lobe::<FEATURES>()
                        {
                            // SAFETY: the caller's promise.
                            let light = unsafe {
                                sample_direct_light::<FEATURES>(
                                    params,
                                    scene,
                                    key,
                                    self.segment,
                                    hit.primitive,
                                    &surface,
                                    &bsdf,
                                    front,
                                )
                            };
                            self.pending_light = self.throughput * light.contribution;
                            self.shadow = max_component(self.pending_light) > 0.0;
                            (self.shadow_t_max, self.light_primitive) = (light.t_max, light.light_primitive);
                            shadow_ray = Ray {
                                origin: scattered_origin::<FEATURES>(&surface, light.inside),
                                direction: light.direction,
                                origin_primitive: OriginPrimitive::new(hit.primitive, light.inside),
                            };
                        }
                        let random = words::<FEATURES>(key, self.segment);
                        let uses_schlick =
                            const { !has(FEATURES, MICROFACETS) } || params.flags & FLAG_SCHLICK != 0;
                        let scatter = bsdf.sample::<FEATURES>(uses_schlick, random);
                        self.throughput *= scatter.weight;
                        self.continues = !scatter.absorbed;
                        if bent {
                            // Light that the shading normal sends through the surface is lost.
                            self.continues &= (scatter.direction.dot(normal) < 0.0) == scatter.transmitted;
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
                        self.vertex_primitive = hit.primitive;
                        self.skipped_distance = 0.0;
                        self.continuation = Ray {
                            origin: scattered_origin::<FEATURES>(&surface, inside),
                            direction: scatter.direction,
                            origin_primitive: OriginPrimitive::new(hit.primitive, inside),
                        };
                        ended = !self.continues && !self.shadow;
                        self.ray = if const { has_any(FEATURES, NEE) } && self.shadow {
                            shadow_ray
                        } else {
                            self.continuation
                        };
                    }
                }
            }
        }
        ended
    }
}

/// Returns the origin of a ray that leaves `surface` to its inside or its outside.
#[inline(always)]
fn scattered_origin<const FEATURES: Features>(surface: &Surface, inside: bool) -> Vec3 {
    if const { has_any(FEATURES, PLANAR | TRIANGLES) } {
        surface::offset_ray_origin(surface.point, surface.normal, surface.error_bound, !inside)
    } else {
        surface.point
    }
}

/// Returns the continuation of a ray beyond a surface that it passes.
#[inline(always)]
fn pass_through(ray: Ray, primitive: u32, surface: &Surface) -> Ray {
    let inside = ray.direction.dot(surface.normal) < 0.0;
    Ray {
        origin: surface::offset_ray_origin(surface.point, surface.normal, surface.error_bound, !inside),
        direction: ray.direction,
        origin_primitive: OriginPrimitive::new(primitive, inside),
    }
}
