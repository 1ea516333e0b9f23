//! Paths: the samples of one pixel, and its first hit.

use crate::buffer::load;
use crate::bvh::{Child, NO_PRIMITIVE, closest_hit};
use crate::features::{Features, ROULETTE, has};
use crate::film::PixelSums;
use crate::math::{max, min, unit_f32};
use crate::params::RenderParams;
use crate::ray::{Departure, Ray};
use crate::rng::PathKey;
use crate::scene::Scene;
use crate::sphere::Sphere;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Adds the launch's samples of pixel (`x`, `y`) to `sums`, in the order of their indices.
///
/// One loop over the segments of all samples: when a path ends, the lane starts its next sample at once instead of
/// waiting for the longest path of its warp. A path has at most `params.depth` segments and is black beyond, as in the
/// book. Random words: block 0 for the camera, block k for the k-th vertex.
///
/// # Safety
///
/// The scene's indices, `params.root` among them, were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn render_pixel<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    sums: &mut PixelSums,
) {
    let pixel = y * params.width + x;
    let mut key = PathKey { seed: params.seed, pixel, sample: params.first_sample };
    let mut segment = 0;
    let mut ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, departure: Departure::NONE };
    let mut throughput = Vec3::ONE;
    while key.sample < params.end_sample {
        if segment == 0 {
            ray = params.camera.ray(x, y, key.words(0));
            throughput = Vec3::ONE;
        }
        // SAFETY: the caller's promise.
        let hit = unsafe { closest_hit(scene, Child(params.root), ray) };
        segment += 1;
        let mut radiance = Vec3::ZERO;
        let mut ended = true;
        if hit.primitive == NO_PRIMITIVE {
            radiance = throughput * params.sky.radiance(ray.direction);
        } else if segment < params.depth {
            let random = key.words(segment);
            // SAFETY: traversal returns a primitive of the array, and the caller promises its material.
            let (sphere, material) = unsafe {
                let sphere: Sphere = load(scene.spheres, hit.primitive);
                (sphere, load(scene.materials, sphere.material))
            };
            let (outward, point) = sphere.project(ray.origin + ray.direction * hit.distance, ray.direction);
            let front = ray.direction.dot(outward) < 0.0;
            let normal = if front { outward } else { -outward };
            let scatter = material.scatter::<FEATURES>(ray.direction, normal, front, random);
            throughput *= material.albedo;
            ended = scatter.absorbed;
            if has(FEATURES, ROULETTE) {
                let survival = min(max(throughput.x, max(throughput.y, throughput.z)), 1.0);
                ended |= unit_f32(random.w) >= survival;
                throughput *= 1.0 / survival;
            }
            let inside = front == scatter.transmitted;
            ray = Ray {
                origin: point,
                direction: scatter.direction,
                departure: Departure::from(hit.primitive, inside),
            };
        }
        if ended {
            sums.add(radiance);
            sums.segments += segment;
            key.sample += 1;
            segment = 0;
        }
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
    let hit = unsafe { closest_hit(scene, Child(params.root), ray) };
    let mut normal = Vec3::ZERO;
    if hit.primitive != NO_PRIMITIVE {
        // SAFETY: traversal returns a primitive of the array.
        let sphere = unsafe { load(scene.spheres, hit.primitive) };
        normal = sphere.project(ray.origin + ray.direction * hit.distance, ray.direction).0;
    }
    FirstHit { normal, primitive: hit.primitive, distance: hit.distance, pad: [0; 3] }
}
