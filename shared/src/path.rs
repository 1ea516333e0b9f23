//! Paths: the samples of one pixel, and its first hit.

use crate::bsdf::{Bsdf, coverage};
use crate::buffer::{load, store};
use crate::bvh::{Hit, NO_PRIMITIVE, Reach, closest_hit};
use crate::environment;
use crate::features::{
    EMITTERS, ENVIRONMENT, FLATS, Features, LIGHTS, MICROFACETS, ROULETTE, TEXTURES, TRIANGLES, has, has_any,
};
use crate::film::{Carry, PixelSums};
use crate::light::{self, Vertex, mis_weight};
use crate::material::{BLENDED, MASKED, Material};
use crate::math::{greatest, min, unit_f32};
use crate::params::{FLAG_FINISH, FLAG_HOLES, FLAG_NEVER, FLAG_SCHLICK, RenderParams};
use crate::ray::{Departure, Ray};
use crate::rng::PathKey;
use crate::sampler::words;
use crate::scene::Scene;
use crate::sphere::MISS;
use crate::surface::{self, Surface, facing};
use crate::texture;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Blocks of random words: 0 for the camera, k for the scattering at the k-th vertex, and for the k-th vertex with these bits the
/// point of a light, the choice of the panorama, the passing of a surface with holes.
const LIGHT_BLOCK: u32 = 0x8000_0000;
const PANORAMA_BLOCK: u32 = 0xa000_0000;
const PASS_BLOCK: u32 = 0xc000_0000;

/// Surfaces with holes that a sample may pass; it is black beyond, so that no path is endless.
const GREATEST_PASSES: u32 = 1023;

/// Adds the launch's samples of pixel (`x`, `y`), in the order of their indices, to `film[slot]`, and what they round off to
/// `carries[slot]`. Whether both stay in memory between samples is the caller's choice: in Vulkan's buffers they do, and are 11 % faster
/// there on scenes with light sampling; CUDA is 19 % slower so, and hands over variables of its own.
///
/// One loop over the rays of all samples: when a path ends, the lane starts its next sample at once instead of
/// waiting for the longest path of its warp, and a shadow ray is a turn of the loop like any other, so that there is one traversal.
/// A path has at most `params.depth` segments, a light's connection among them, and is black beyond, as in the book.
///
/// # Safety
///
/// The scene's indices, `params.root` among them, were proven as [`crate::buffer`] says; `slot` is below both lengths.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn render_pixel<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    film: &mut [PixelSums],
    carries: &mut [Carry],
    slot: u32,
) {
    if params.resume == 0 {
        // SAFETY: the caller's promise.
        unsafe {
            store(film, slot, PixelSums::ZERO);
            store(carries, slot, Carry::ZERO);
        }
    }
    let pixel = y * params.width + x;
    let mut key = PathKey { seed: params.seed, pixel, sample: params.first_sample };
    let mut segment = 0;
    let mut ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, departure: Departure::NONE };
    let mut throughput = Vec3::ONE;
    let mut radiance = Vec3::ZERO;
    let mut rays = 0;
    let mut passes = 0;
    // Of the direction that the path took last; 0 where light sampling cannot find it.
    let mut density = 0.0;
    // The primitive of that vertex, and the way from there to the ray's origin: above 0 after holes.
    let mut vertex = NO_PRIMITIVE;
    let mut travelled = 0.0;
    // A shadow ray, and what is done after it.
    let mut shadow = false;
    let mut limit = MISS;
    let mut target = NO_PRIMITIVE;
    let mut gathered = Vec3::ZERO;
    let mut shadow_ray = ray;
    let mut next = ray;
    let mut goes_on = true;
    while key.sample < params.end_sample {
        if segment == 0 && (!has(FEATURES, TEXTURES) || passes == 0) {
            ray = params.camera.ray(x, y, words::<FEATURES>(key, 0));
            throughput = Vec3::ONE;
            radiance = Vec3::ZERO;
            rays = 0;
            density = 0.0;
            vertex = NO_PRIMITIVE;
            travelled = 0.0;
        }
        let reach = if has_any(FEATURES, LIGHTS) && shadow {
            let any = !has(FEATURES, TEXTURES) || params.flags & FLAG_HOLES == 0;
            Reach { limit, target, any }
        } else {
            Reach::CLOSEST
        };
        // SAFETY: the caller's promise.
        let hit = unsafe { closest_hit::<FEATURES>(params, scene, ray, reach) };
        rays += 1;
        let mut ended = true;
        if has_any(FEATURES, LIGHTS) && shadow {
            let blocked = hit.primitive != NO_PRIMITIVE && hit.primitive != target;
            let mut passed = false;
            if has(FEATURES, TEXTURES) && blocked && params.flags & FLAG_HOLES != 0 {
                // SAFETY: traversal returns a primitive of the scene, and the caller promises its material.
                let (surface, material) = unsafe {
                    let surface = surface::at::<FEATURES>(params, scene, ray, hit);
                    (surface, load(scene.materials, surface.material))
                };
                // SAFETY: the caller's promise for textures.
                gathered *= 1.0 - unsafe { coverage(scene, &material, surface.u, surface.v) };
                passes += 1;
                passed = greatest(gathered) > 0.0 && passes <= GREATEST_PASSES;
                ray = pass(ray, hit.primitive, &surface);
                limit -= hit.distance;
            }
            ended = false;
            if !passed {
                if !blocked {
                    radiance += gathered;
                }
                shadow = false;
                ray = next;
                ended = !goes_on;
            }
        } else if hit.primitive == NO_PRIMITIVE {
            segment += 1;
            let mut sky = params.sky.radiance(ray.direction);
            if has(FEATURES, ENVIRONMENT) && params.environment_width > 0 {
                // SAFETY: the caller's promise.
                let from = unsafe { environment::radiance(params, scene, ray.direction) };
                let other = from.density * params.environment_probability;
                sky = from.radiance * if density > 0.0 { mis_weight(density, other) } else { 1.0 };
            }
            radiance += throughput * sky;
        } else {
            segment += 1;
            // SAFETY: traversal returns a primitive of the scene, and the caller promises its material.
            let (surface, material) = unsafe {
                let surface = surface::at::<FEATURES>(params, scene, ray, hit);
                (surface, load(scene.materials, surface.material))
            };
            let front = ray.direction.dot(surface.normal) < 0.0;
            let mut passed = false;
            if has(FEATURES, TEXTURES) && material.flags & (MASKED | BLENDED) != 0 {
                // SAFETY: the caller's promise for textures.
                let covered = unsafe { coverage(scene, &material, surface.u, surface.v) };
                passed = unit_f32(key.words(PASS_BLOCK | segment << 10 | passes).x) >= covered;
            }
            if passed {
                segment -= 1;
                passes += 1;
                travelled += hit.distance;
                ray = pass(ray, hit.primitive, &surface);
                ended = passes > GREATEST_PASSES;
            } else {
                if has(FEATURES, EMITTERS) && material.emits(front) {
                    // SAFETY: the caller's promise.
                    let emitted = unsafe {
                        emission::<FEATURES>(
                            params, scene, &material, &surface, ray, hit, vertex, travelled, density,
                        )
                    };
                    radiance += throughput * emitted;
                }
                if segment < params.depth {
                    let normal = if front { surface.normal } else { -surface.normal };
                    let mut shading = normal;
                    // Only a triangle's shading normal is not its own: other primitives keep their bits in every variant.
                    let bent = has(FEATURES, TRIANGLES) && hit.primitive >= params.first_triangle;
                    if bent {
                        let towards = if front { surface.shading } else { -surface.shading };
                        shading = facing(towards, -ray.direction);
                    }
                    // SAFETY: the caller's promise for textures.
                    let bsdf = unsafe {
                        let place = (surface.u, surface.v);
                        Bsdf::new::<FEATURES>(scene, material, ray.direction, shading, front, place)
                    };
                    if has_any(FEATURES, LIGHTS)
                        && (params.lights > 0 || params.environment_probability > 0.0)
                        && bsdf.is_smooth_lobe::<FEATURES>()
                    {
                        // SAFETY: the caller's promise.
                        let light = unsafe {
                            connect::<FEATURES>(
                                params,
                                scene,
                                key,
                                segment,
                                hit.primitive,
                                &surface,
                                &bsdf,
                                front,
                            )
                        };
                        gathered = throughput * light.gathered;
                        shadow = greatest(gathered) > 0.0;
                        (limit, target) = (light.limit, light.target);
                        shadow_ray = Ray {
                            origin: origin::<FEATURES>(&surface, light.inside),
                            direction: light.direction,
                            departure: Departure::from(hit.primitive, light.inside),
                        };
                    }
                    let random = words::<FEATURES>(key, segment);
                    let book_fresnel = !has(FEATURES, MICROFACETS) || params.flags & FLAG_SCHLICK != 0;
                    let scatter = bsdf.sample::<FEATURES>(book_fresnel, random);
                    throughput *= scatter.weight;
                    goes_on = !scatter.absorbed;
                    if bent {
                        // What the shading normal sends through the surface is lost.
                        goes_on &= (scatter.direction.dot(normal) < 0.0) == scatter.transmitted;
                    }
                    if has_any(FEATURES, LIGHTS) {
                        goes_on &= greatest(throughput) > 0.0;
                    }
                    if has(FEATURES, ROULETTE) && segment >= params.roulette_from {
                        let survival = min(greatest(throughput), 1.0);
                        goes_on &= unit_f32(random.w) < survival;
                        throughput *= 1.0 / survival;
                    }
                    let inside = front == scatter.transmitted;
                    density = scatter.density;
                    vertex = hit.primitive;
                    travelled = 0.0;
                    next = Ray {
                        origin: origin::<FEATURES>(&surface, inside),
                        direction: scatter.direction,
                        departure: Departure::from(hit.primitive, inside),
                    };
                    ended = !goes_on && !shadow;
                    ray = if has_any(FEATURES, LIGHTS) && shadow { shadow_ray } else { next };
                }
            }
        }
        if ended {
            // SAFETY: the caller's promise, and the stores above or of the launch before.
            unsafe {
                let (mut sums, mut carry) = (load(film, slot), load(carries, slot));
                sums.add(radiance, &mut carry, params.flags & FLAG_NEVER);
                sums.segments += if has_any(FEATURES, LIGHTS | TEXTURES) { rays } else { segment };
                store(film, slot, sums);
                store(carries, slot, carry);
            }
            key.sample += 1;
            segment = 0;
            passes = 0;
        }
    }
    if params.flags & FLAG_FINISH != 0 {
        // SAFETY: as above.
        unsafe {
            let mut sums = load(film, slot);
            sums.finish(load(carries, slot));
            store(film, slot, sums);
        }
    }
}

/// Where a ray starts that leaves `surface` to its inside or its outside.
#[inline(always)]
fn origin<const FEATURES: Features>(surface: &Surface, inside: bool) -> Vec3 {
    if has_any(FEATURES, FLATS | TRIANGLES) {
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

/// What the surface emits towards the ray, by the weight of having found it by scattering with `density`.
///
/// # Safety
///
/// As [`render_pixel`]; `hit` is of its traversal.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of the loop above")]
unsafe fn emission<const FEATURES: Features>(
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
    if has(FEATURES, TEXTURES) {
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
struct Connection {
    direction: Vec3,
    limit: f32,
    target: u32,
    /// What it adds for a throughput of 1.
    gathered: Vec3,
    /// Whether it leaves the surface to its inside.
    inside: bool,
}

/// Next-event estimation at a vertex.
///
/// # Safety
///
/// As [`render_pixel`]; there is a light or a panorama to sample.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
#[allow(clippy::too_many_arguments, reason = "a part of the loop above")]
unsafe fn connect<const FEATURES: Features>(
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
    if has(FEATURES, ENVIRONMENT) && has(FEATURES, EMITTERS) && params.lights > 0 {
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

/// What the ray of one sample meets first. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FirstHit {
    /// Outward unit normal of the surface; zero where nothing is hit.
    pub normal: Vec3,
    /// Index of the primitive, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// Along the camera ray; [`crate::sphere::MISS`] where nothing is hit.
    pub distance: f32,
    /// Unused.
    pub pad: [u32; 3],
}

const _: () = assert!(size_of::<FirstHit>() == 32 && align_of::<FirstHit>() == 16);

/// The first hit of sample `params.first_sample` of pixel (`x`, `y`).
///
/// # Safety
///
/// As [`render_pixel`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn first_hit(params: &RenderParams, scene: Scene, x: u32, y: u32) -> FirstHit {
    let pixel = y * params.width + x;
    let key = PathKey { seed: params.seed, pixel, sample: params.first_sample };
    let ray = params.camera.ray(x, y, key.words(0));
    // SAFETY: the caller's promise.
    let hit = unsafe { closest_hit::<{ FLATS | TRIANGLES }>(params, scene, ray, Reach::CLOSEST) };
    let mut normal = Vec3::ZERO;
    if hit.primitive != NO_PRIMITIVE {
        // SAFETY: traversal returns a primitive of the scene.
        normal = unsafe { surface::at::<{ FLATS | TRIANGLES }>(params, scene, ray, hit) }.normal;
    }
    FirstHit { normal, primitive: hit.primitive, distance: hit.distance, pad: [0; 3] }
}
