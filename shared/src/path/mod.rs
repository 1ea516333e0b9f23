//! Paths: what a sample does from ray to ray.

mod connect;
mod first_hit;
mod render;

pub use first_hit::{FirstHit, first_hit};
pub use render::{render_pixel, render_queue};

use crate::bsdf::{Bsdf, coverage};
use crate::buffer::{Slots, load};
use crate::bvh::{Hit, NO_PRIMITIVE, Reach};
use crate::environment;
use crate::features::{
    EMITTERS, ENVIRONMENT, FLATS, Features, GUIDES, LIGHTS, MICROFACETS, ROULETTE, TEXTURES, TRIANGLES, has,
    has_any,
};
use crate::film::{Carry, PixelSums};
use crate::guides::{self, Guides, Look};
use crate::light::mis_weight;
use crate::material::{BLENDED, LAMBERTIAN, MASKED, Material};
use crate::math::{greatest, min, unit_f32};
use crate::params::{FLAG_HOLES, FLAG_NEVER, FLAG_SCHLICK, RenderParams};
use crate::ray::{Departure, Ray};
use crate::rng::PathKey;
use crate::sampler::words;
use crate::scene::Scene;
use crate::sphere::MISS;
use crate::surface::{self, Surface, reflecting};
use connect::{connect, emission};
use glam::Vec3;

/// Blocks of random words: 0 for the camera, k for the scattering at the k-th vertex, and for the k-th vertex with these bits the
/// point of a light, the choice of the panorama, the passing of a surface with holes.
const LIGHT_BLOCK: u32 = 0x8000_0000;
const PANORAMA_BLOCK: u32 = 0xa000_0000;
const PASS_BLOCK: u32 = 0xc000_0000;

/// Surfaces with holes that a sample may pass; it is black beyond, so that no path is endless.
const GREATEST_PASSES: u32 = 1023;

/// `radiance` with each channel at most `limit`: less noise from rare bright paths, and a darker mean. What is infinite stays so, and no sum takes it. (Scaling the
/// colour instead would keep its hue, and needs a division, which took 5 % of the samples a second on CUDA even where no limit was set.)
#[inline(always)]
fn clamped(radiance: Vec3, limit: f32) -> Vec3 {
    let clamp = |c: f32| if c > limit && c.to_bits() < f32::INFINITY.to_bits() { limit } else { c };
    Vec3::new(clamp(radiance.x), clamp(radiance.y), clamp(radiance.z))
}

/// A sample between two of its rays. A shadow ray is a ray like any other, so that there is one traversal.
///
/// A path has at most `params.depth` segments, a light's connection among them, and is black beyond, as in the book.
/// Vectors begin rows: naga lays records out so.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct Path {
    ray: Ray,
    /// The path's ray after a shadow ray, if it goes on.
    next: Ray,
    throughput: Vec3,
    segment: u32,
    radiance: Vec3,
    /// Rays traced.
    rays: u32,
    /// What a light adds if nothing is between.
    gathered: Vec3,
    /// Surfaces with holes passed.
    passes: u32,
    key: PathKey,
    /// Of the direction that the path took last; 0 where light sampling cannot find it.
    density: f32,
    /// The primitive of that vertex.
    vertex: u32,
    /// The way from there to the ray's origin: above 0 after holes.
    travelled: f32,
    /// Of a shadow ray.
    limit: f32,
    /// The light's primitive.
    target: u32,
    /// Whether the sample has yet to get its camera ray.
    fresh: bool,
    /// Whether the ray is a shadow ray.
    shadow: bool,
    /// Whether the path does after it.
    goes_on: bool,
}

impl Path {
    /// The sample that `key` names.
    #[inline(always)]
    fn new(key: PathKey) -> Self {
        let ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, departure: Departure::NONE };
        Self {
            key,
            fresh: true,
            segment: 0,
            ray,
            throughput: Vec3::ONE,
            radiance: Vec3::ZERO,
            rays: 0,
            passes: 0,
            density: 0.0,
            vertex: NO_PRIMITIVE,
            travelled: 0.0,
            shadow: false,
            limit: MISS,
            target: NO_PRIMITIVE,
            gathered: Vec3::ZERO,
            next: ray,
            goes_on: true,
        }
    }

    /// The camera's ray through pixel (`x`, `y`).
    #[inline(always)]
    fn begin<const FEATURES: Features>(&mut self, params: &RenderParams, x: u32, y: u32) {
        self.ray = params.camera.ray(x, y, words::<FEATURES>(self.key, 0));
        self.fresh = false;
        self.throughput = Vec3::ONE;
        self.radiance = Vec3::ZERO;
        self.density = 0.0;
        self.vertex = NO_PRIMITIVE;
        self.travelled = 0.0;
    }

    /// Adds the finished sample to its pixel's sums, and goes on to the next.
    #[inline(always)]
    fn end<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        sums: &mut PixelSums,
        carry: &mut Carry,
    ) {
        sums.add(clamped(self.radiance, params.clamp), carry, params.flags & FLAG_NEVER);
        sums.segments +=
            if const { has_any(FEATURES, LIGHTS | TEXTURES) } { self.rays } else { self.segment };
        self.key.sample += 1;
        self.fresh = true;
        self.segment = 0;
        self.passes = 0;
        self.rays = 0;
    }

    /// What the ray looks for.
    #[inline(always)]
    fn reach<const FEATURES: Features>(&self, params: &RenderParams) -> Reach {
        if const { has_any(FEATURES, LIGHTS) } && self.shadow {
            let any = const { !has(FEATURES, TEXTURES) } || params.flags & FLAG_HOLES == 0;
            Reach { limit: self.limit, target: self.target, any }
        } else {
            Reach::CLOSEST
        }
    }

    /// Goes on from what the ray hit. Returns whether the path ended.
    ///
    /// # Safety
    ///
    /// As [`render_pixel`]; `hit` is of the ray's traversal.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn advance<const FEATURES: Features>(
        &mut self,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        guides: &mut Slots<Guides>,
    ) -> bool {
        let key = self.key;
        let ray = self.ray;
        self.rays += 1;
        let mut ended = true;
        let mut shadow_ray = ray;
        if const { has_any(FEATURES, LIGHTS) } && self.shadow {
            let blocked = hit.primitive != NO_PRIMITIVE && hit.primitive != self.target;
            let mut passed = false;
            if const { has(FEATURES, TEXTURES) } && blocked && params.flags & FLAG_HOLES != 0 {
                // SAFETY: traversal returns a primitive of the scene, and the caller promises its material.
                let (surface, material) = unsafe {
                    let surface = surface::at::<FEATURES>(params, scene, ray, hit);
                    (surface, load::<Material>(scene.materials, surface.material))
                };
                // SAFETY: the caller's promise for textures.
                self.gathered *= 1.0 - unsafe { coverage(scene, &material, surface.u, surface.v) };
                self.passes += 1;
                passed = greatest(self.gathered) > 0.0 && self.passes <= GREATEST_PASSES;
                self.ray = pass(ray, hit.primitive, &surface);
                self.limit -= hit.distance;
            }
            ended = false;
            if !passed {
                if !blocked {
                    self.radiance += self.gathered;
                }
                self.shadow = false;
                self.ray = self.next;
                ended = !self.goes_on;
            }
        } else if hit.primitive == NO_PRIMITIVE {
            self.segment += 1;
            let mut sky = params.sky.radiance(ray.direction);
            if const { has(FEATURES, ENVIRONMENT) } && params.environment_width > 0 {
                // SAFETY: the caller's promise.
                let from = unsafe { environment::radiance(params, scene, ray.direction) };
                let other = from.density * params.environment_probability;
                sky = from.radiance * if self.density > 0.0 { mis_weight(self.density, other) } else { 1.0 };
            }
            self.radiance += self.throughput * sky;
            if const { has(FEATURES, GUIDES) } && self.segment == 1 {
                // SAFETY: the caller's promise.
                unsafe { guides::update(guides, key.pixel, |g: &mut Guides| g.add_miss(sky)) };
            }
        } else {
            self.segment += 1;
            // SAFETY: traversal returns a primitive of the scene, and the caller promises its material.
            let (surface, material) = unsafe {
                let surface = surface::at::<FEATURES>(params, scene, ray, hit);
                (surface, load::<Material>(scene.materials, surface.material))
            };
            let front = ray.direction.dot(surface.normal) < 0.0;
            let mut passed = false;
            if const { has(FEATURES, TEXTURES) } && material.flags & (MASKED | BLENDED) != 0 {
                // SAFETY: the caller's promise for textures.
                let covered = unsafe { coverage(scene, &material, surface.u, surface.v) };
                passed = unit_f32(key.words(PASS_BLOCK | self.segment << 10 | self.passes).x) >= covered;
            }
            if passed {
                self.segment -= 1;
                self.passes += 1;
                self.travelled += hit.distance;
                self.ray = pass(ray, hit.primitive, &surface);
                ended = self.passes > GREATEST_PASSES;
            } else {
                let mut emitted = Vec3::ZERO;
                if const { has(FEATURES, EMITTERS) } && material.emits(front) {
                    // SAFETY: the caller's promise.
                    emitted = unsafe {
                        emission::<FEATURES>(
                            params,
                            scene,
                            &material,
                            &surface,
                            ray,
                            hit,
                            self.vertex,
                            self.travelled,
                            self.density,
                        )
                    };
                    self.radiance += self.throughput * emitted;
                }
                let goes_on = self.segment < params.depth;
                let guides_too = const { has(FEATURES, GUIDES) } && self.segment == 1;
                if goes_on || guides_too {
                    let normal = if front { surface.normal } else { -surface.normal };
                    let mut shading = normal;
                    // Only a triangle's shading normal is not its own: other primitives keep their bits in every variant.
                    let bent = const { has(FEATURES, TRIANGLES) } && hit.primitive >= params.first_triangle;
                    if bent {
                        shading = if front { surface.shading } else { -surface.shading };
                        // What is diffuse keeps its normal: its shading must not depend on the
                        // viewer.
                        if material.kind != LAMBERTIAN {
                            shading = reflecting(shading, normal, -ray.direction);
                        }
                    }
                    // SAFETY: the caller's promise for textures.
                    let bsdf = unsafe {
                        let place = (surface.u, surface.v);
                        Bsdf::new::<FEATURES>(scene, material, ray.direction, shading, front, place)
                    };
                    if guides_too {
                        let look = Look {
                            albedo: bsdf.albedo::<FEATURES>(),
                            diffuse: bsdf.diffuseness::<FEATURES>(),
                        };
                        let hit =
                            |g: &mut Guides| g.add_hit(hit.primitive, shading, look, surface.point, emitted);
                        // SAFETY: the caller's promise.
                        unsafe { guides::update(guides, key.pixel, hit) };
                    }
                    if goes_on {
                        if const { has_any(FEATURES, LIGHTS) }
                            && (params.lights > 0 || params.environment_probability > 0.0)
                            && bsdf.is_smooth_lobe::<FEATURES>()
                        {
                            // SAFETY: the caller's promise.
                            let light = unsafe {
                                connect::<FEATURES>(
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
                            self.gathered = self.throughput * light.gathered;
                            self.shadow = greatest(self.gathered) > 0.0;
                            (self.limit, self.target) = (light.limit, light.target);
                            shadow_ray = Ray {
                                origin: origin::<FEATURES>(&surface, light.inside),
                                direction: light.direction,
                                departure: Departure::from(hit.primitive, light.inside),
                            };
                        }
                        let random = words::<FEATURES>(key, self.segment);
                        let book_fresnel =
                            const { !has(FEATURES, MICROFACETS) } || params.flags & FLAG_SCHLICK != 0;
                        let scatter = bsdf.sample::<FEATURES>(book_fresnel, random);
                        self.throughput *= scatter.weight;
                        self.goes_on = !scatter.absorbed;
                        if bent {
                            // What the shading normal sends through the surface is lost.
                            self.goes_on &= (scatter.direction.dot(normal) < 0.0) == scatter.transmitted;
                        }
                        if const { has_any(FEATURES, LIGHTS) } {
                            self.goes_on &= greatest(self.throughput) > 0.0;
                        }
                        if const { has(FEATURES, ROULETTE) } && self.segment >= params.roulette_from {
                            let survival = min(greatest(self.throughput), 1.0);
                            self.goes_on &= unit_f32(random.w) < survival;
                            self.throughput *= 1.0 / survival;
                        }
                        let inside = front == scatter.transmitted;
                        self.density = scatter.density;
                        self.vertex = hit.primitive;
                        self.travelled = 0.0;
                        self.next = Ray {
                            origin: origin::<FEATURES>(&surface, inside),
                            direction: scatter.direction,
                            departure: Departure::from(hit.primitive, inside),
                        };
                        ended = !self.goes_on && !self.shadow;
                        self.ray = if const { has_any(FEATURES, LIGHTS) } && self.shadow {
                            shadow_ray
                        } else {
                            self.next
                        };
                    }
                }
            }
        }
        ended
    }
}

/// Where a ray starts that leaves `surface` to its inside or its outside.
#[inline(always)]
fn origin<const FEATURES: Features>(surface: &Surface, inside: bool) -> Vec3 {
    if const { has_any(FEATURES, FLATS | TRIANGLES) } {
        surface::leave(surface.point, surface.normal, surface.error, !inside)
    } else {
        surface.point
    }
}

/// The ray beyond a surface that it passes.
#[inline(always)]
fn pass(ray: Ray, primitive: u32, surface: &Surface) -> Ray {
    let inside = ray.direction.dot(surface.normal) < 0.0;
    Ray {
        origin: surface::leave(surface.point, surface.normal, surface.error, !inside),
        direction: ray.direction,
        departure: Departure::from(primitive, inside),
    }
}
