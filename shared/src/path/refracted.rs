//! Connections to lights without extent through smooth glass: next-event estimation along the
//! refracted paths, which scattering cannot find, because it never hits such a light.
//!
//! A walk follows a [`tube`](super::tube) in some direction, and corrects the direction by Newton's
//! method until the tube meets the light. Walks end in different refracted paths, or in none. One
//! starts straight towards the light: behind a pane or a slab it finds the only path there is. One
//! starts in a [random direction](glass::Piece::start) towards a piece of glass. If it finds
//! another path, further random walks are made until one finds that path again: their number
//! estimates 1 over its probability without bias (Zeltner, Georgiev and Jakob, "Specular Manifold
//! Sampling for Rendering High-Frequency Caustics and Glints", SIGGRAPH 2020, section 4.2), but for
//! the limit [`MAX_TRIALS`]. Some connections do so, too, for paths with a mirror: one of the first
//! [`MIRRORS`] surfaces reflects below the critical angle. Paths with two such are left out.

use super::tube::{Arrival, NO_MIRROR, follow};
use super::vertex::Vertex;
use super::{Path, blocks};
use crate::bsdf::Bsdf;
use crate::buffer::load_record;
use crate::features::{FeatureSet, Features};
use crate::light::glass::{self, Piece};
use crate::light::{DIRECTIONAL, Light, point};
use crate::math::{max_component, min, mul_high, normalize, sqrt};
use crate::params::RenderParams;
use crate::scene::Scene;
use crate::sphere::MISS;
use glam::Vec3;

/// Maximum number of walks that are made to find the path of the first random one again. Light on
/// paths that fewer walks find is too dark.
const MAX_TRIALS: u32 = 256;

/// Number of bends, from the first on, one of which may be a reflection below the critical angle.
const MIRRORS: u32 = 2;

/// Number of choices, [`MIRRORS`] of which stand for a bend that reflects, the others for none.
const MIRROR_CHOICES: u32 = 8;

/// Number of the first [block](blocks::refracted) for walks with a mirror, after those without.
const FIRST_MIRRORED: u32 = 0x1e0;

/// Maximum number of tubes that a walk follows.
const MAX_STEPS: u32 = 24;

/// Factor of Newton's steps below which a walk has failed: each step that comes no closer halves
/// the factor.
const MIN_DAMPING: f32 = 0.01;

/// Greatest step of a walk, relative to the sine of the angle that the glass fills.
const MAX_STEP: f32 = 0.5;

/// Step at which a walk has ended, relative to that sine.
const TOLERANCE: f32 = 1e-4;

/// Greatest sine that the tolerance is relative to.
const MAX_SINE: f32 = 0.1;

/// Distance of directions that count as the same, relative to that sine.
const SAME: f32 = 1e-2;

/// End of a walk. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct Walk {
    /// Unit vector from the vertex along the refracted path.
    direction: Vec3,
    /// Number of rays traced.
    rays: u32,
    arrival: Arrival,
    /// True if the path reaches the light.
    found: bool,
}

/// Walks from the direction `start` to a refracted path from a vertex to the light, through `piece`
/// first unless `is_straight`.
///
/// # Safety
///
/// As [`render_pixel`](super::render_pixel).
#[inline(always)]
#[allow(clippy::too_many_arguments, unsafe_code, reason = "one walk; see buffer")]
unsafe fn walk<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    params: &RenderParams,
    scene: Scene,
    path: &Path,
    from: &Vertex,
    piece: &Piece,
    light: &Light,
    start: Vec3,
    is_straight: bool,
    mirror: u32,
    max_segments: u32,
) -> Walk {
    let sine = piece.sine();
    let (mut direction, mut best, mut step) = (start, start, Vec3::ZERO);
    let (mut least, mut damping, mut steps, mut rays) = (MISS, 1.0, 0, 0);
    let (mut found, mut going) = (false, true);
    let mut arrival = Arrival::NONE;
    while going {
        direction = normalize(best + step * damping);
        // SAFETY: the caller's promise.
        arrival = unsafe {
            follow(
                features,
                params,
                scene,
                path,
                from,
                piece,
                light,
                direction,
                is_straight,
                mirror,
                max_segments,
            )
        };
        rays += arrival.rays;
        steps += 1;
        if arrival.arrived && arrival.miss2 < least {
            let length = sqrt(arrival.step.dot(arrival.step));
            let limit = MAX_STEP * sine;
            (best, least) = (direction, arrival.miss2);
            step = arrival.step * (if length > limit { limit * (1.0 / length) } else { 1.0 });
            damping = min(2.0 * damping, 1.0);
            found = length < TOLERANCE * min(sine, MAX_SINE);
        } else {
            damping *= 0.5;
        }
        going = !found && least < MISS && damping > MIN_DAMPING && steps < MAX_STEPS;
    }
    Walk { direction, rays, arrival, found }
}

/// Returns the light that arrives along the end of a tube, per solid angle at its start and for a
/// transmittance of 1.
#[inline(always)]
fn strength(light: &Light, arrival: &Arrival) -> Vec3 {
    let mut intensity = light.intensity;
    if light.kind != DIRECTIONAL {
        intensity *= point::falloff(light, arrival.direction);
    }
    intensity * (1.0 / arrival.spread)
}

impl Path {
    /// Adds the light that reaches a vertex through smooth glass from a light without extent.
    ///
    /// # Safety
    ///
    /// As [`Path::shade`]; the scene has such lights and such glass.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) unsafe fn add_refracted_light<const POSSIBLE: Features>(
        &mut self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        vertex: &Vertex,
        bsdf: &Bsdf,
        front: bool,
    ) {
        let max_segments = params.max_depth - self.segment;
        if max_segments < 2 || !bsdf.has_non_delta_lobe(features) {
            return;
        }
        let random = self.key.words(blocks::refracted(self.segment, 0));
        let count = params.light_count - params.area_light_count;
        let lights = count as f32;
        // SAFETY: the index is that of a point, spot or directional light; the caller's promise.
        let (light, piece) = unsafe {
            let index = params.area_light_count + mul_high(random.x, count);
            let light = load_record::<Light>(scene.lights, index);
            (light, glass::choose(params, scene, vertex.surface.point, &light, random))
        };
        // Walk 0 starts towards the light, the others towards the piece; the light of the path that
        // walk 0 finds is not counted again.
        let mut to_light = light.position;
        if light.kind != DIRECTIONAL {
            to_light = normalize(light.position - vertex.surface.point);
        }
        let limit = SAME * piece.sine();
        let (mut straight, mut has_straight) = (Vec3::ZERO, false);
        let (mut found, mut radiance) = (Vec3::ZERO, Vec3::ZERO);
        let (mut walks, mut first_block, mut going) = (0, 0, true);
        let mut weight = piece.inverse_probability * lights;
        // Few connections also follow a path with a mirror, which has little light.
        let (mut mirror, mut next_mirror) = (NO_MIRROR, mul_high(random.y, MIRROR_CHOICES));
        while going {
            let block = blocks::refracted(self.segment, first_block + walks);
            let mut start = to_light;
            if walks > 0 {
                let random = self.key.words(block);
                // SAFETY: the caller's promise.
                start = unsafe { piece.start(features, params, scene, vertex.surface.point, random) };
            }
            // SAFETY: the caller's promise.
            let walk = unsafe {
                let towards = walks == 0;
                walk(
                    features,
                    params,
                    scene,
                    self,
                    vertex,
                    &piece,
                    &light,
                    start,
                    towards,
                    mirror,
                    max_segments,
                )
            };
            self.rays += walk.rays;
            let (from_straight, from_found) = (walk.direction - straight, walk.direction - found);
            let is_straight = has_straight && from_straight.dot(from_straight) < limit * limit;
            let is_same = walk.found && from_found.dot(from_found) < limit * limit;
            if walks < 2 {
                let mut arriving = Vec3::ZERO;
                if walk.found && !is_straight && vertex.scatters(bsdf, walk.direction, front) {
                    let eval = bsdf.evaluate(features, walk.direction);
                    arriving = eval.value * walk.arrival.passed * strength(&light, &walk.arrival);
                }
                if walks == 0 {
                    (straight, has_straight) = (walk.direction, walk.found);
                    self.radiance += self.throughput * arriving * lights;
                } else {
                    (found, radiance) = (walk.direction, arriving);
                    going = max_component(radiance) > 0.0;
                }
            } else {
                going = !is_same && walks <= MAX_TRIALS;
            }
            walks += 1;
            if !going {
                let trials = (walks - 2) as f32;
                self.radiance += self.throughput * radiance * (weight * trials);
                going = next_mirror < MIRRORS;
                (mirror, next_mirror) = (next_mirror, MIRRORS);
                (walks, first_block, has_straight) = (1, FIRST_MIRRORED, false);
                weight = piece.inverse_probability * lights * MIRROR_CHOICES as f32;
            }
        }
    }
}
