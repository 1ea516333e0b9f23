//! Connections to the sky: by the panorama's radiance, through portals, or by both.

use super::{LightSample, NO_LIGHT, ReferencePoint, portal, tree};
use crate::bvh::NO_PRIMITIVE;
use crate::environment::{self, EnvironmentSample};
use crate::features::{ENVIRONMENT, FeatureSet, Features, LIGHT_TREE, PORTALS};
use crate::math::{max, min, unit_f32};
use crate::params::RenderParams;
use crate::rng::Words;
use crate::scene::Scene;
use crate::sphere::MISS;
use core::f32::consts::PI;
use glam::Vec3;

/// Part of the connections to a panorama that go through portals, where a point sees one: a
/// panorama may have a small sun, which points of a portal rarely hit.
const PORTAL_SHARE: f32 = 0.5;

/// Least and greatest part of the connections that go to a panorama where lights have a tree: what
/// blocks either is not known, and the panorama may have a small sun.
const PART_OF_PANORAMA: (f32, f32) = (0.25, 0.75);

/// Least and greatest part of the connections that go through portals to a sky without a panorama,
/// which scattering finds well, too.
const PART_OF_PORTALS: (f32, f32) = (1.0 / 32.0, 0.75);

/// Returns whether the sky is a panorama.
#[inline(always)]
fn has_panorama<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, params: &RenderParams) -> bool {
    features.has::<ENVIRONMENT>() && params.environment_width > 0
}

/// Returns the sky's radiance from a unit direction, and the pdf with which its panorama alone
/// chooses it; 0 without a panorama.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn radiance<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    direction: Vec3,
) -> EnvironmentSample {
    if has_panorama(features, params) {
        // SAFETY: the caller's promise.
        unsafe { environment::radiance(params, scene, direction) }
    } else {
        EnvironmentSample { direction, radiance: params.sky.radiance(direction), pdf: 0.0 }
    }
}

/// Returns the probability with which a connection from `from` samples the sky; `view` is that of
/// the portals.
///
/// With a light tree it follows what may arrive: the mean of two shares of the sky's light, of that
/// of all lights and of that of lights which are not infinitely far, because a sun may not enter a
/// room.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn probability_seen<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
    view: f32,
) -> f32 {
    let mut probability = params.environment_probability;
    if features.has::<LIGHT_TREE>() && params.light_count > 0 && probability > 0.0 {
        let has_panorama = has_panorama(features, params);
        let seen = if view > 0.0 || !has_panorama { view } else { PI };
        let sky = params.sky.strength * seen;
        // SAFETY: the caller's promise; the feature says that there is a tree.
        let lights = unsafe { tree::arriving(params, scene, from) };
        let of = |others: f32| sky * (1.0 / max(sky + others, f32::MIN_POSITIVE));
        let share = 0.5 * of(lights.near) + 0.5 * of(lights.near + lights.distant);
        let (least, most) = if has_panorama { PART_OF_PANORAMA } else { PART_OF_PORTALS };
        probability = min(max(share, least), most);
        if !has_panorama && view <= 0.0 {
            probability = 0.0;
        }
    }
    probability
}

/// Returns the probability with which [`super::sample`] samples the sky from `from`.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn probability<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
) -> f32 {
    let mut view = 0.0;
    if features.has::<PORTALS>() && features.has::<LIGHT_TREE>() {
        // SAFETY: the caller's promise.
        view = unsafe { portal::view(params, scene, from, Vec3::Y) }.weight;
    }
    // SAFETY: the caller's promise.
    unsafe { probability_seen(features, params, scene, from, view) }
}

/// pdf of a direction of the sky, per steradian, where the sky is sampled.
#[derive(Clone, Copy)]
struct SkyPdf {
    /// pdf by all ways.
    all: f32,
    /// [Weight](portal::View::weight) of the portals.
    view: f32,
    /// pdf of the choice among portals alone.
    through_portals: f32,
}

/// Returns the pdf, per steradian at `from`, with which [`super::sample`] chooses the direction of
/// `sky`, which [`radiance`] returned.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn pdf<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
    sky: &EnvironmentSample,
) -> f32 {
    // SAFETY: the caller's promise.
    unsafe {
        let pdf = pdf_by_ways(features, params, scene, from, sky);
        pdf.all * probability_seen(features, params, scene, from, pdf.view)
    }
}

/// Returns what [`pdf`] returns, but for the probability that the sky is sampled.
///
/// # Safety
///
/// As [`super::sample`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn pdf_by_ways<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
    sky: &EnvironmentSample,
) -> SkyPdf {
    let mut pdf = SkyPdf { all: sky.pdf, view: 0.0, through_portals: 0.0 };
    if features.has::<PORTALS>() {
        // SAFETY: the caller's promise.
        let view = unsafe { portal::view(params, scene, from, sky.direction) };
        (pdf.view, pdf.through_portals) = (view.weight, view.pdf);
        if view.weight > 0.0 {
            let share = if has_panorama(features, params) { PORTAL_SHARE } else { 1.0 };
            pdf.all = sky.pdf * (1.0 - share) + view.pdf * share;
        }
    }
    pdf
}

/// Samples a direction of the sky, which is sampled with this [`probability`]: `choice` decides
/// between panorama and portals; `random` as [`environment::sample`] and [`portal::sample`] use it.
///
/// # Safety
///
/// As [`super::sample`]; there is a panorama or a portal.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn sample<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
    random: Words,
    choice: u32,
    probability: f32,
) -> LightSample {
    let has_panorama = has_panorama(features, params);
    let mut direction = Vec3::ZERO;
    if features.has::<PORTALS>() && (!has_panorama || unit_f32(choice) < PORTAL_SHARE) {
        // SAFETY: the caller's promise.
        direction = unsafe { portal::sample(params, scene, from, random) };
    }
    let is_chosen = direction.dot(direction) > 0.0;
    if !is_chosen && !has_panorama {
        return NO_LIGHT;
    }
    // SAFETY: the caller's promise.
    let (sky, pdf) = unsafe {
        let sky = if is_chosen {
            radiance(features, params, scene, direction)
        } else {
            environment::sample(params, scene, random)
        };
        (sky, pdf_by_ways(features, params, scene, from, &sky))
    };
    // Rounding may take the direction past the edge of the portal that it was made for.
    if pdf.all <= 0.0 || is_chosen && pdf.through_portals <= 0.0 {
        return NO_LIGHT;
    }
    LightSample {
        direction: sky.direction,
        t_max: MISS,
        primitive: NO_PRIMITIVE,
        radiance: sky.radiance,
        pdf: pdf.all * probability,
        is_delta: false,
    }
}
