//! Path tracing: a sample from its camera ray to its radiance. [`render_pixel`] and
//! [`render_persistent`] are the render kernels, which entry points and the CPU backend call.

#![warn(clippy::too_many_lines)]

mod blocks;
mod connect;
mod first_hit;
mod medium;
mod nee;
mod persistent;
mod refracted;
mod render;
mod roulette;
mod shade;
mod tube;
mod vertex;

pub use first_hit::{FirstHit, first_hit};
pub use persistent::render_persistent;
pub use render::render_pixel;

use crate::bvh::{NO_PRIMITIVE, RayQuery};
use crate::features::{FeatureSet, Features, HOLES, NEE, PANES};
use crate::film::{Compensation, PixelSums};
use crate::medium::MediumStack;
use crate::params::{FLAG_OPAQUE_ZERO, RenderParams};
use crate::ray::{OriginPrimitive, Ray};
use crate::rng::PathKey;
use crate::sampler::{pixel_number, words};
use crate::sphere::MISS;
use glam::Vec3;

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
    /// Number of panes that the shadow ray has passed.
    panes: u32,
    key: PathKey,
    /// pdf of the direction that the path took last, per steradian; 0 if light sampling cannot find
    /// it.
    pdf: f32,
    /// Primitive of the vertex that the path left last.
    vertex_primitive: u32,
    /// Normal of that vertex, as [`ReferencePoint`](crate::light::ReferencePoint) has it.
    vertex_normal: Vec3,
    /// Distance from that vertex to the ray's origin; above 0 after surfaces that the path passed.
    skipped_distance: f32,
    /// Absorption of the solid in which the ray is, by channel, per scene unit.
    absorption: Vec3,
    /// Maximum distance of the shadow ray.
    shadow_t_max: f32,
    /// Primitive of the light that the shadow ray is sent to.
    light_primitive: u32,
    /// Row-major index of the pixel in the whole image.
    pixel: u32,
    /// Media in which the ray is.
    media: MediumStack,
    /// Media of the path's ray after a shadow ray.
    continuation_media: MediumStack,
    /// True if the sample has no camera ray yet.
    needs_camera_ray: bool,
    /// True if the ray is a shadow ray.
    shadow: bool,
    /// True if the path continues after the shadow ray.
    continues: bool,
}

impl Path {
    /// Creates the path of sample `sample` of pixel (`x`, `y`).
    #[inline(always)]
    fn new<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        (x, y): (u32, u32),
        sample: u32,
    ) -> Self {
        let pixel = pixel_number(features, params.width, x, y);
        let key = PathKey { seed: params.seed, pixel, sample };
        let ray = Ray::in_world(Vec3::ZERO, Vec3::Z, OriginPrimitive::NONE);
        Self {
            key,
            needs_camera_ray: true,
            segment: 0,
            ray,
            throughput: Vec3::ONE,
            radiance: Vec3::ZERO,
            rays: 0,
            passes: 0,
            panes: 0,
            pdf: 0.0,
            vertex_primitive: NO_PRIMITIVE,
            vertex_normal: Vec3::ZERO,
            skipped_distance: 0.0,
            absorption: Vec3::ZERO,
            media: MediumStack::EMPTY,
            continuation_media: MediumStack::EMPTY,
            shadow: false,
            shadow_t_max: MISS,
            light_primitive: NO_PRIMITIVE,
            pixel: y * params.width + x,
            pending_light: Vec3::ZERO,
            continuation: ray,
            continues: true,
        }
    }

    /// Starts the sample with the camera ray through pixel (`x`, `y`).
    #[inline(always)]
    fn begin_sample<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        x: u32,
        y: u32,
    ) {
        self.ray = params.camera.ray(x, y, words(features, self.key, blocks::CAMERA));
        self.needs_camera_ray = false;
        self.throughput = Vec3::ONE;
        self.radiance = Vec3::ZERO;
        self.pdf = 0.0;
        self.vertex_primitive = NO_PRIMITIVE;
        self.skipped_distance = 0.0;
        self.absorption = Vec3::ZERO;
        self.media = MediumStack(params.camera.media);
    }

    /// Adds the finished sample to its pixel's sums, and moves on to the pixel's next sample.
    #[inline(always)]
    fn finish_sample<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        sums: &mut PixelSums,
        compensation: &mut Compensation,
    ) {
        sums.add(clamped(self.radiance, params.max_radiance), compensation, params.flags & FLAG_OPAQUE_ZERO);
        sums.segments += if features.has::<{ NEE | HOLES }>() { self.rays } else { self.segment };
        self.key.sample += 1;
        self.needs_camera_ray = true;
        self.segment = 0;
        self.passes = 0;
        self.rays = 0;
    }

    /// Returns the query of the current ray.
    #[inline(always)]
    fn query<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> RayQuery {
        if features.has::<NEE>() && self.shadow {
            RayQuery {
                t_max: self.shadow_t_max,
                light_primitive: self.light_primitive,
                any_hit: !features.has::<{ HOLES | PANES }>(),
            }
        } else {
            RayQuery::CLOSEST
        }
    }
}
