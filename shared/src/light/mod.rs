//! Light sampling: choosing a point of a light, and the pdf of that choice. Each kind of light is a
//! file; [`sample`] chooses among them.
//!
//! [`crate::path`] calls [`sample`] for next-event estimation, and [`pdf`] to weight a light that a
//! path hits by scattering.

mod area;
mod directional;
mod point;

pub use area::pdf;

use crate::buffer::load;
use crate::bvh::NO_PRIMITIVE;
use crate::environment;
use crate::features::{EMITTERS, ENVIRONMENT, Features, has};
use crate::math::{mul_high, unit_f32};
use crate::params::RenderParams;
use crate::rng::Words;
use crate::scene::Scene;
use crate::sphere::MISS;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Kind of an area light: a primitive that emits.
pub const AREA: u32 = 0;
/// Kind of a point light; a spot light if its cone is narrower than the whole sphere.
pub const POINT: u32 = 1;
/// Kind of a directional light: infinitely far.
pub const DIRECTIONAL: u32 = 2;

/// Light, and its entry of the alias table (Walker, 1977; Vose, 1991), which chooses lights by
/// power. 64 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// Kind: [`AREA`], [`POINT`] or [`DIRECTIONAL`].
    pub kind: u32,
    /// Primitive of an area light.
    pub primitive: u32,
    /// Threshold of the alias table: keep this light if a random word is below, else take `alias`.
    pub threshold: u32,
    /// Index of the light to take instead.
    pub alias: u32,
    /// Position of a point light; unit vector towards a directional light.
    pub position: Vec3,
    /// Probability that this light is sampled.
    pub probability: f32,
    /// Radiant intensity of a point light (power per steradian); irradiance of a directional light
    /// (power per unit of area).
    pub intensity: Vec3,
    /// Slope of a spot's falloff over the cosine from its axis; 0 for a point light.
    pub cone_scale: f32,
    /// Unit vector along a spot's axis, away from the light.
    pub axis: Vec3,
    /// Offset of a spot's falloff: its intensity is multiplied by (cosine × `cone_scale` +
    /// `cone_offset`)², the base clamped to 0 to 1 (glTF's KHR_lights_punctual).
    pub cone_offset: f32,
}

const _: () = assert!(size_of::<Light>() == 64 && align_of::<Light>() == 16);

/// Sampled point of a light or of the environment map.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Maximum distance of the shadow ray.
    pub t_max: f32,
    /// Primitive that the shadow ray may hit, or [`NO_PRIMITIVE`].
    pub primitive: u32,
    /// Arriving radiance, zero for a choice that gives nothing; irradiance for a light without
    /// extent.
    pub radiance: Vec3,
    /// pdf of this choice, per steradian at the point; its probability for a light without extent.
    pub pdf: f32,
    /// True if only light sampling can find this light.
    pub is_delta: bool,
}

const NO_LIGHT: LightSample = LightSample {
    direction: Vec3::Y,
    t_max: MISS,
    primitive: NO_PRIMITIVE,
    radiance: Vec3::ZERO,
    pdf: 1.0,
    is_delta: true,
};

/// Point that light is sampled from.
#[derive(Clone, Copy, Debug)]
pub struct ReferencePoint {
    /// Position on a surface.
    pub point: Vec3,
    /// Primitive of that surface.
    pub primitive: u32,
}

/// Samples a light by its power, and a point on it.
///
/// `random.x` and `random.y` choose the point, `random.z` and `random.w` the light; `choice`
/// decides whether the environment map is sampled instead.
///
/// # Safety
///
/// The scene's indices were proven as [`crate::buffer`] says; there is a light, or an environment
/// map with a probability above 0.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn sample<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    from: ReferencePoint,
    random: Words,
    choice: u32,
) -> LightSample {
    if const { has(FEATURES, ENVIRONMENT) } && unit_f32(choice) < params.environment_probability {
        // SAFETY: a probability above zero means that there is an environment map.
        let sky = unsafe { environment::sample(params, scene, random) };
        return LightSample {
            direction: sky.direction,
            t_max: MISS,
            primitive: NO_PRIMITIVE,
            radiance: sky.radiance,
            pdf: sky.pdf * params.environment_probability,
            is_delta: false,
        };
    }
    if const { !has(FEATURES, EMITTERS) } || params.light_count == 0 {
        return NO_LIGHT;
    }
    // SAFETY: the index is below the number of lights, as is each alias.
    let light = unsafe {
        let light = load::<Light>(scene.lights, mul_high(random.z, params.light_count));
        if random.w < light.threshold { light } else { load::<Light>(scene.lights, light.alias) }
    };
    match light.kind {
        // SAFETY: the caller's promise for the light's primitive.
        AREA => unsafe { area::sample::<FEATURES>(params, scene, light.primitive, from, random) },
        DIRECTIONAL => directional::sample(&light),
        _ => point::sample(&light, from),
    }
}

/// Returns the weight of a sample with pdf `own` that another technique finds with pdf `other`: the
/// power heuristic with exponent 2 (Veach and Guibas, SIGGRAPH 1995). The two weights of a pair sum
/// to 1.
#[inline(always)]
pub fn mis_weight(own: f32, other: f32) -> f32 {
    // The larger pdf is divided out, so neither square overflows.
    let ratio = if own >= other { other / own } else { own / other };
    let square = ratio * ratio;
    if own >= other { 1.0 / (1.0 + square) } else { square / (1.0 + square) }
}
