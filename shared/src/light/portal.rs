//! Portals: openings, such as windows, through which a room sees the sky. A connection to the sky
//! aims at a point of one of them instead of at a direction that a wall may block.
//!
//! Their records follow the planar shapes in their array, and are no primitives.

use super::ReferencePoint;
use crate::buffer::load_record;
use crate::math::{max, max_component, min, sqrt, unit_f32};
use crate::params::RenderParams;
use crate::planar::Planar;
use crate::rng::Words;
use crate::scene::Scene;
use crate::sphere::MISS;
use core::f32::consts::PI;
use glam::Vec3;

/// Part of the choices that is even among the portals that a point sees: what blocks them is not
/// known.
const EVEN_SHARE: f32 = 1.0 / 8.0;

/// Factor of the weight of portals below the horizon: a normal map may turn the horizon.
const BELOW_HORIZON: f32 = 0.02;

/// Distance from a portal's plane up to which a point counts as behind it, relative to coordinates.
/// The wall around a window often lies in that plane, and a ray leaves it from a point that is
/// moved by the rounding of positions, about a tenth of this.
const IN_PLANE: f32 = 4e-6;

/// Portals as a point sees them.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Sum of the weights of the portals in front of which the point is: about their solid angle,
    /// times the cosine at the surface.
    pub weight: f32,
    /// pdf per steradian with which [`sample`] chooses the direction that was asked for.
    pub pdf: f32,
}

/// Returns about the solid angle of a portal, times a bound of the cosine at the surface; 0 from
/// behind and from [near](IN_PLANE) its plane.
#[inline(always)]
fn weight(portal: &Planar, from: &ReferencePoint) -> f32 {
    let to = portal.origin + (portal.edge_u + portal.edge_v) * 0.5 - from.point;
    let height = (from.point - portal.origin).dot(portal.normal);
    if height <= IN_PLANE * max_component(from.point.abs() + portal.origin.abs()) {
        return 0.0;
    }
    let radius = sqrt(portal.area * (1.0 / PI));
    let inverse = 1.0 / max(max(sqrt(to.dot(to)), radius), 1e-30);
    // At most π.
    let mut weight = portal.area * inverse * inverse * (height * inverse);
    if from.normal.dot(from.normal) > 0.0 {
        let cos = from.normal.dot(to) * inverse + radius * inverse;
        weight *= min(max(cos, BELOW_HORIZON), 1.0);
    }
    max(weight, f32::MIN_POSITIVE)
}

/// Returns what `from` sees of the portals, and the pdf of `direction`.
///
/// # Safety
///
/// The scene's indices were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn view(
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
    direction: Vec3,
) -> View {
    let (mut sum, mut count, mut weighted, mut even) = (0.0, 0.0, 0.0, 0.0);
    let mut index = 0;
    while index < params.portal_count {
        // SAFETY: the caller's promise.
        let portal = unsafe { load_record::<Planar>(scene.planars, params.first_portal + index) };
        let weight = weight(&portal, from);
        if weight > 0.0 {
            sum += weight;
            count += 1.0;
            let distance = portal.distance(from.point, direction);
            if distance < MISS {
                let cos = max(-direction.dot(portal.normal), 1e-9);
                let pdf = distance * (1.0 / portal.area) * distance * (1.0 / cos);
                weighted += pdf * weight;
                even += pdf;
            }
        }
        index += 1;
    }
    let by_weight = weighted * (1.0 / max(sum, f32::MIN_POSITIVE)) * (1.0 - EVEN_SHARE);
    View { weight: sum, pdf: by_weight + even * (1.0 / max(count, 1.0)) * EVEN_SHARE }
}

/// Choice among portals, one after the other: each takes the place of the one chosen before with
/// its share of the weights so far, and the random number is stretched to the part that it fell
/// into (weighted reservoir sampling, Chao, 1982).
#[derive(Clone, Copy)]
struct Selection {
    /// Sum of the weights, of which none is below 0.
    sum: f32,
    /// Number of portals that the point sees.
    count: f32,
    /// True if they are chosen evenly.
    even: bool,
    random: f32,
}

impl Selection {
    #[inline(always)]
    fn new(random: f32, even_share: f32) -> Self {
        let even = random < even_share;
        let (low, width) = if even { (0.0, even_share) } else { (even_share, 1.0 - even_share) };
        let random = min((random - low) * (1.0 / width), 0.999_999_94);
        Self { sum: 0.0, count: 0.0, even, random }
    }

    /// Adds a portal. Returns whether it is the one chosen so far.
    #[inline(always)]
    fn add(&mut self, weight: f32) -> bool {
        let mut chosen = false;
        if weight > 0.0 {
            let before = if self.even { self.count } else { self.sum };
            self.sum += weight;
            self.count += 1.0;
            let weight = if self.even { 1.0 } else { weight };
            let place = self.random * (before + weight);
            chosen = place < weight;
            let (part, width) = if chosen { (place, weight) } else { (place - weight, before) };
            self.random = min(part * (1.0 / max(width, f32::MIN_POSITIVE)), 0.999_999_94);
        }
        chosen
    }
}

/// Samples a portal in front of which `from` is, by `random.z`, and a point of it, by `random.x`
/// and `random.y`. Returns the unit vector towards that point, or zero if there is no such portal.
///
/// # Safety
///
/// As [`view`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) unsafe fn sample(
    params: &RenderParams,
    scene: Scene,
    from: &ReferencePoint,
    random: Words,
) -> Vec3 {
    let mut portals = Selection::new(unit_f32(random.z), EVEN_SHARE);
    let (mut to, mut index) = (Vec3::ZERO, 0);
    while index < params.portal_count {
        // SAFETY: the caller's promise.
        let portal = unsafe { load_record::<Planar>(scene.planars, params.first_portal + index) };
        if portals.add(weight(&portal, from)) {
            let (u, v) = (unit_f32(random.x), unit_f32(random.y));
            to = portal.origin + portal.edge_u * u + portal.edge_v * v - from.point;
        }
        index += 1;
    }
    let square = to.dot(to);
    if square > 0.0 { to * (1.0 / sqrt(square)) } else { Vec3::ZERO }
}
