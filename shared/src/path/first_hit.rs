//! First hits of camera rays, for the tests that compare backends.

use crate::bvh::{NO_PRIMITIVE, RayQuery};
use crate::features::{FeatureSet, Features, INSTANCES, SHAPES};
use crate::params::RenderParams;
pub use crate::records::first_hit::FirstHit;
use crate::rng::PathKey;
use crate::scene::Scene;
use crate::surface;
use crate::traversal::closest_hit;
use glam::Vec3;

/// Features of the kernel: all that decide what is hit.
const POSSIBLE: Features = SHAPES | INSTANCES;

/// Returns the first hit of sample `params.first_sample` of pixel (`x`, `y`).
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel).
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn first_hit(params: &RenderParams, scene: Scene, x: u32, y: u32) -> FirstHit {
    let pixel = y * params.width + x;
    let key = PathKey { seed: params.seed, pixel, sample: params.first_sample };
    let ray = params.camera.ray(x, y, key.words(0));
    // SAFETY: the caller's promise.
    let hit = unsafe { closest_hit(FeatureSet::<POSSIBLE>::ALL, params, scene, ray, RayQuery::CLOSEST) };
    let mut normal = Vec3::ZERO;
    if hit.primitive != NO_PRIMITIVE {
        // SAFETY: traversal returns a primitive of the scene.
        normal = unsafe { surface::at(FeatureSet::<POSSIBLE>::ALL, params, scene, ray, hit) }.normal;
    }
    let primitive = hit.named(FeatureSet::<POSSIBLE>::ALL, params);
    FirstHit { normal, primitive, distance: hit.distance, pad: [0; 3] }
}
