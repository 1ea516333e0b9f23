//! Light sampling: choosing a point of a light, and the pdf of that choice. Each kind of light is a
//! file; [`sample`] chooses among them, by an alias table or, of many lights, by a [`tree`].
//!
//! [`crate::path`] calls [`sample`] for next-event estimation, and [`pdf`] to weight a light that a
//! path hits by scattering.

mod area;
mod directional;
pub mod glass;
mod importance;
pub(crate) mod point;
mod portal;
pub mod sky;
pub mod tree;

use crate::buffer::load_record;
use crate::bvh::NO_PRIMITIVE;
use crate::features::{EMITTERS, ENVIRONMENT, FeatureSet, Features, LIGHT_TREE, PORTALS, PUNCTUAL};
use crate::math::{max, mul_high, unit_f32};
use crate::params::RenderParams;
pub use crate::records::light::Light;
use crate::rng::Words;
use crate::scene::Scene;
use crate::sphere::MISS;
use glam::Vec3;

/// Kind of an area light: a primitive that emits.
pub const AREA: u32 = 0;
/// Kind of a point light; a spot light if its cone is narrower than the whole sphere.
pub const POINT: u32 = 1;
/// Kind of a directional light: infinitely far.
pub const DIRECTIONAL: u32 = 2;

/// Sampled point of a light or of the sky. (Vectors begin rows of 16 bytes: naga lays
/// records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Maximum distance of the shadow ray.
    pub t_max: f32,
    /// Arriving radiance, zero for a choice that gives nothing; irradiance for a light without
    /// extent.
    pub radiance: Vec3,
    /// Primitive that the shadow ray may hit, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// pdf of this choice, per steradian at the point; its probability for a light without extent.
    pub pdf: f32,
    /// True if only light sampling can find this light.
    pub is_delta: bool,
}

/// Choice that gives no light.
pub(crate) const NO_LIGHT: LightSample = LightSample {
    direction: Vec3::Y,
    t_max: MISS,
    primitive: NO_PRIMITIVE,
    radiance: Vec3::ZERO,
    pdf: 1.0,
    is_delta: true,
};

/// Point that light is sampled from. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct ReferencePoint {
    /// Position on a surface.
    pub point: Vec3,
    /// Primitive of that surface.
    pub primitive: u32,
    /// Unit shading normal of a surface that reflects alone, on the viewer's side; zero for one
    /// that light passes. A light tree and portals ask for it.
    pub normal: Vec3,
}

/// Samples a light by its power, or by a light tree, and a point on it.
///
/// `random.x` and `random.y` choose the point, `random.z` and `random.w` the light; `choice.x`
/// decides whether the sky is sampled instead, and `choice.y` how.
///
/// # Safety
///
/// The scene's indices were proven as [`crate::buffer`] says; there is a light, or a sky with
/// a probability above 0.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn sample<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    from: ReferencePoint,
    random: Words,
    choice: Words,
) -> LightSample {
    let mut of_sky = 0.0;
    if features.has::<{ ENVIRONMENT | PORTALS }>() {
        // SAFETY: the caller's promise.
        of_sky = unsafe { sky::probability(features, params, scene, &from) };
        if unit_f32(choice.x) < of_sky {
            // SAFETY: a probability above zero means that there is a panorama or a portal.
            return unsafe { sky::sample(features, params, scene, &from, random, choice.y, of_sky) };
        }
    }
    if !features.has::<{ EMITTERS | PUNCTUAL }>() || params.light_count == 0 {
        return NO_LIGHT;
    }
    let mut light: Light;
    if features.has::<LIGHT_TREE>() {
        // SAFETY: the feature says that there is a tree.
        let choice = unsafe { tree::choose(params, scene, &from, random) };
        if choice.light == tree::NOWHERE {
            return NO_LIGHT;
        }
        // SAFETY: the tree's indices are in range.
        light = unsafe { load_record::<Light>(scene.lights, choice.light) };
        let probability = choice.probability * (1.0 - of_sky);
        light.intensity.x *= if light.kind == AREA { probability } else { 1.0 };
        light.probability = probability;
    } else {
        // SAFETY: the index is below the number of lights, as is each alias.
        unsafe {
            light = load_record::<Light>(scene.lights, mul_high(random.z, params.light_count));
            if random.w >= light.threshold {
                light = load_record::<Light>(scene.lights, light.alias);
            }
        }
    }
    if !features.has::<PUNCTUAL>() || (features.has::<EMITTERS>() && light.kind == AREA) {
        // SAFETY: the caller's promise for the light's primitive.
        unsafe { area::sample(features, params, scene, &light, from, random) }
    } else if light.kind == DIRECTIONAL {
        directional::sample(&light)
    } else {
        point::sample(&light, from)
    }
}

/// Returns the pdf, per steradian at `from`, with which [`sample`] chooses the point of `primitive`
/// at `distance`. `cos` is the cosine of the direction to that point with the normal there;
/// `light_pdf` is that of its material.
///
/// # Safety
///
/// As [`sample`].
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "one place, seen from one point; see buffer")]
pub unsafe fn pdf<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    primitive: u32,
    light_pdf: f32,
    from: ReferencePoint,
    distance: f32,
    cos: f32,
) -> f32 {
    let mut by_area = light_pdf;
    // SAFETY: the caller's promise; the feature says that there is a tree.
    unsafe {
        if features.has::<LIGHT_TREE>() {
            by_area = tree::area_pdf(params, scene, &from, primitive);
            if features.has::<{ ENVIRONMENT | PORTALS }>() {
                by_area *= 1.0 - sky::probability(features, params, scene, &from);
            }
        }
        area::pdf(features, params, scene, primitive, by_area, from, distance, cos)
    }
}

/// Returns the weight of a sample with pdf `own` that another technique finds with pdf `other`: the
/// power heuristic with exponent 2 (Veach and Guibas, SIGGRAPH 1995). The two weights of a pair sum
/// to 1, unless both pdfs are denormal.
#[inline(always)]
pub fn mis_weight(own: f32, other: f32) -> f32 {
    // The larger pdf is divided out, so neither square overflows.
    let is_larger = own >= other;
    let (low, high) = if is_larger { (other, own) } else { (own, other) };
    let ratio = low * (1.0 / max(high, f32::MIN_POSITIVE));
    let square = ratio * ratio;
    (if is_larger { 1.0 } else { square }) * (1.0 / (1.0 + square))
}
