//! Pieces of smooth glass that refracted connections are sought through: balls around them, from
//! which a connection chooses one.
//!
//! Their records follow the lights and the nodes of a light tree in their array: `primitive` is the
//! [name](crate::bvh::Hit::named) of the first primitive of the piece, `alias` the number of its
//! primitives, `position` and `probability` are middle and radius of the ball.

use super::{DIRECTIONAL, Light};
use crate::buffer::load_record;
use crate::features::{FeatureSet, Features};
use crate::math::{max, mul_high, sqrt, unit_circle, unit_f32};
use crate::params::RenderParams;
use crate::planar::{DISC, Planar};
use crate::primitive::{is_planar, is_triangle};
use crate::rng::Words;
use crate::scene::Scene;
use crate::triangle::Triangle;
use glam::Vec3;

/// Kind of the record of a piece of glass.
pub const GLASS: u32 = 3;

/// Maximum number of pieces that a choice compares.
const COMPARED: u32 = 64;

/// Number of primitives up to which a piece is thought to have flat sides, some of them narrow,
/// which walks towards its ball miss.
const FEW: u32 = 64;

/// Piece of glass, as a reference point sees it. (Vectors begin rows of 16 bytes: naga lays records
/// out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Unit vector to the middle of the ball.
    axis: Vec3,
    /// Name of the first primitive.
    first: u32,
    /// Number of primitives.
    count: u32,
    /// 1 less the cosine of the angle that the ball fills around the axis; 2 from inside the ball.
    cap: f32,
    /// 1 over the probability of the choice.
    pub inverse_probability: f32,
}

impl Piece {
    /// Returns whether the primitive or instance with this name is part of the piece.
    #[inline(always)]
    pub fn has(&self, name: u32) -> bool {
        name >= self.first && name - self.first < self.count
    }

    /// Returns a unit vector towards the ball, uniform by solid angle.
    #[inline(always)]
    pub fn direction(&self, random: Words) -> Vec3 {
        let height = self.cap * unit_f32(random.x);
        let (cos, radius) = (1.0 - height, sqrt(max(height * (2.0 - height), 0.0)));
        let (c, s) = unit_circle(random.y);
        let (x, y) = crate::math::basis(self.axis);
        crate::math::normalize(x * (radius * c) + y * (radius * s) + self.axis * cos)
    }

    /// Returns a unit vector to begin a walk: towards the ball, and for three of four walks to a
    /// piece of [few primitives](FEW) towards a point of one of them.
    ///
    /// # Safety
    ///
    /// `params` belongs to this scene, whose piece this is.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn start<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        from: Vec3,
        random: Words,
    ) -> Vec3 {
        let mut direction = self.direction(random);
        let name = self.first + mul_high(random.z, self.count);
        if random.w >> 30 != 0 && self.count <= FEW && name < params.primitive_count {
            let (u, v) = (unit_f32(random.x), unit_f32(random.y));
            let mut to = Vec3::ZERO;
            if is_triangle(features, params, name) {
                // SAFETY: the caller's promise.
                let triangle =
                    unsafe { load_record::<Triangle>(scene.triangles, name - params.first_triangle) };
                // As for lights: see `area`.
                let root = sqrt(u);
                to = triangle.a * (1.0 - root) + triangle.b * (root * (1.0 - v)) + triangle.c * (root * v)
                    - from;
            } else if is_planar(features, params, name) {
                // SAFETY: the caller's promise.
                let planar = unsafe { load_record::<Planar>(scene.planars, name - params.first_planar) };
                let (mut across, mut down) = (u, v);
                if planar.kind == DISC {
                    let (cos, sin) = unit_circle(random.y);
                    (across, down) = (sqrt(u) * cos, sqrt(u) * sin);
                }
                to = planar.origin + planar.edge_u * across + planar.edge_v * down - from;
            }
            let square = to.dot(to);
            if square > 1e-37 && square < 1e37 {
                direction = to * (1.0 / sqrt(square));
            }
        }
        direction
    }

    /// Returns the sine of the angle that the ball fills around its axis; 1 from inside.
    #[inline(always)]
    pub fn sine(&self) -> f32 {
        if self.cap >= 1.0 { 1.0 } else { sqrt(self.cap * (2.0 - self.cap)) }
    }
}

/// Chooses a piece of glass by the solid angle that its ball fills at `from`, times that at the
/// light. Of many pieces, some that follow each other are compared.
///
/// # Safety
///
/// `params` belongs to this scene, which has at least one piece of glass.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(crate) unsafe fn choose(
    params: &RenderParams,
    scene: Scene,
    from: Vec3,
    light: &Light,
    random: Words,
) -> Piece {
    let count = params.glass_count;
    let (mut compared, mut index) = (count, 0);
    if count > COMPARED {
        (compared, index) = (COMPARED, mul_high(random.z, count));
    }
    let (mut chosen, mut sum, mut of_chosen) = (0, 0.0, 0.0);
    let (mut left, mut u) = (compared, unit_f32(random.w));
    while left > 0 {
        // SAFETY: the index is below the number of pieces.
        let piece = unsafe { load_record::<Light>(scene.lights, params.first_glass + index) };
        let square = piece.probability * piece.probability;
        let to = piece.position - from;
        let mut weight = square * (1.0 / max(to.dot(to), square));
        if light.kind != DIRECTIONAL {
            let to = piece.position - light.position;
            weight *= square * (1.0 / max(to.dot(to), square));
        }
        // A hint must not exclude what it is wrong about.
        weight += 1e-6;
        sum += weight;
        // A reservoir that uses the rest of one random number.
        let share = weight * (1.0 / sum);
        if u < share {
            (chosen, of_chosen) = (index, weight);
            u *= 1.0 / share;
        } else {
            u = (u - share) * (1.0 / (1.0 - share));
        }
        index = if index + 1 < count { index + 1 } else { 0 };
        left -= 1;
    }
    // SAFETY: as above.
    let piece = unsafe { load_record::<Light>(scene.lights, params.first_glass + chosen) };
    let to = piece.position - from;
    let (distance2, square) = (to.dot(to), piece.probability * piece.probability);
    let (mut axis, mut cap) = (Vec3::Y, 2.0);
    if distance2 > square {
        let sin2 = square * (1.0 / distance2);
        axis = to * (1.0 / sqrt(distance2));
        cap = sin2 * (1.0 / (1.0 + sqrt(1.0 - sin2)));
    }
    let windows = count as f32 * (1.0 / compared as f32);
    Piece {
        axis,
        first: piece.primitive,
        count: piece.alias,
        cap,
        inverse_probability: sum * (1.0 / of_chosen) * windows,
    }
}
