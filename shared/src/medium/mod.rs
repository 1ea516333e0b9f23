//! Participating media: which medium a ray is in, how far light travels there, and how it scatters.
//! [`crate::path`] calls this; the records stand behind the materials in their array.
//!
//! The distance to a collision is sampled for one channel, the hero, which is chosen by what the
//! path carries; the weight combines the pdfs of all channels (single-sample multiple importance
//! sampling, balance heuristic), so that no channel is biased and no weight is larger than the
//! path's throughput allows. In a grid the collisions of one channel are those of delta tracking
//! (Woodcock et al., 1965), and the transmittance of shadow rays comes from ratio tracking (Novák
//! et al., "Residual Ratio Tracking for Estimating Attenuation in Participating Media", SIGGRAPH
//! Asia 2014). The pdf of another channel is that of the hero times a factor that depends only on
//! the number of collisions and on the majorant's optical depth (after Miller, Georgiev and Jarosz,
//! "A Null-Scattering Path Integral Formulation of Light Transport", SIGGRAPH 2019).

mod grid;
mod phase;

use crate::buffer::load_other;
use crate::buffer_layout::Packed;
use crate::material::Material;
use crate::math::{exp2, log2, max, min, unit_f32};
use crate::ray::Ray;
pub use crate::records::medium::{COLLIDES, HAS_GRID, Medium};
use crate::rng::Words;
use crate::scene::Scene;
use core::f32::consts::{LN_2, LOG2_E};
use glam::Vec3;
pub use grid::{CELL, MAX_COLLISIONS};
pub use phase::{phase_function, sample_phase_function};

/// Identifier of a medium that neither absorbs nor scatters, and has no record: that of a solid
/// which a path can enter, in a scene with other media.
pub const CLEAR: u32 = 255;

/// Media that a ray is in, innermost last: four identifiers of 8 bits. 0 stands for none.
///
/// Identifier k from 1 on is record k - 1 of the scene's media. The lowest identifier of the stack
/// is that of the innermost medium. A path in more than four media forgets the outermost.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MediumStack(pub u32);

impl MediumStack {
    /// Stack of a ray in no medium.
    pub const EMPTY: Self = Self(0);

    /// Returns the identifier of the innermost medium, or 0 for none.
    #[inline(always)]
    pub fn innermost(self) -> u32 {
        let id = self.0 & 0xff;
        if id == CLEAR { 0 } else { id }
    }

    /// Returns the stack of a ray that crosses the boundary of medium `id`, inwards if `enters`. A
    /// boundary without medium (0) changes nothing, nor does leaving a medium that the ray is not
    /// in, as behind a boundary that is not closed.
    #[inline(always)]
    pub fn cross(self, id: u32, enters: bool) -> Self {
        let stack = self.0;
        let mut crossed = stack;
        if id != 0 {
            if enters {
                crossed = stack << 8 | id;
            } else if stack & 0xff == id {
                crossed = stack >> 8;
            } else if stack >> 8 & 0xff == id {
                crossed = stack >> 16 << 8 | stack & 0xff;
            } else if stack >> 16 & 0xff == id {
                crossed = stack >> 24 << 16 | stack & 0xffff;
            } else if stack >> 24 == id {
                crossed = stack & 0x00ff_ffff;
            }
        }
        Self(crossed)
    }
}

/// Returns medium `index` of the array of materials, in which media stand.
///
/// # Safety
///
/// `index < materials.len()`, and the host put a medium there.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn load_medium(materials: &[Packed<Material>], index: u32) -> Medium {
    // SAFETY: the caller's promise.
    unsafe { load_other::<Material, _>(materials, index) }
}

/// Returns the transmittance of a homogeneous medium by channel (Beer and Lambert's law): at least
/// 2⁻¹²⁶. `extinction` times `distance` is not NaN.
#[inline(always)]
pub fn transmittance(extinction: Vec3, distance: f32) -> Vec3 {
    let power = extinction * (-LOG2_E * distance);
    Vec3::new(exp2(power.x), exp2(power.y), exp2(power.z))
}

/// Way of light through a medium, up to a surface or a collision.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// True if it ends at a collision.
    pub collided: bool,
    /// Distance to the collision.
    pub distance: f32,
    /// Transmittance over the probability of this way, by channel.
    pub weight: Vec3,
}

/// Channel for which a flight is sampled.
#[derive(Clone, Copy)]
struct Hero {
    /// Extinction of the channel.
    extinction: f32,
    /// Probability of each channel.
    probability: Vec3,
}

impl Hero {
    /// Chooses the channel in proportion to what light `carries`.
    #[inline(always)]
    fn choose(extinction: Vec3, carries: Vec3, random: u32) -> Self {
        let sum = carries.x + carries.y + carries.z;
        let is_dark = sum < f32::MIN_POSITIVE;
        let probability = if is_dark { Vec3::splat(1.0 / 3.0) } else { carries * (1.0 / sum) };
        let u = unit_f32(random);
        let blue = if probability.z > 0.0 { extinction.z } else { extinction.y };
        let rest = if u < probability.x + probability.y { extinction.y } else { blue };
        Self { extinction: if u < probability.x { extinction.x } else { rest }, probability }
    }

    /// Returns the pdf of a way by channel over the mean of these pdfs. The way has `collisions`
    /// collisions, null collisions among them, on a majorant's optical depth of `depth` for an
    /// extinction of 1.
    #[inline(always)]
    fn weight(self, extinction: Vec3, depth: f32, collisions: f32) -> Vec3 {
        let pdfs = Vec3::new(
            relative_pdf(extinction.x, self.extinction, depth, collisions),
            relative_pdf(extinction.y, self.extinction, depth, collisions),
            relative_pdf(extinction.z, self.extinction, depth, collisions),
        );
        pdfs * (1.0 / max(self.probability.dot(pdfs), f32::MIN_POSITIVE))
    }
}

/// Returns the pdf of a way as [`Hero::weight`] has it, for an extinction, over that of the hero's.
#[inline(always)]
fn relative_pdf(extinction: f32, of_hero: f32, depth: f32, collisions: f32) -> f32 {
    let power = (of_hero - extinction) * min(LOG2_E * depth, 1e30);
    // The logarithm of the ratio, so that its rounding does not depend on the scene's scale.
    let ratio = if of_hero > 0.0 { extinction * (1.0 / of_hero) } else { 1.0 };
    let of_collisions = log2(ratio) * collisions;
    if extinction <= 0.0 && collisions > 0.0 { 0.0 } else { exp2(power + of_collisions) }
}

/// Returns the optical depth, from 0 on, that light of one channel travels to its next collision.
#[inline(always)]
fn exponential(random: u32) -> f32 {
    -LN_2 * log2(1.0 - unit_f32(random))
}

/// Samples the way of light that `carries` this throughput along `ray`, for at most `distance`,
/// through `medium`. With `only_transmits` it never collides, and its weight estimates the
/// transmittance. In a homogeneous medium that estimate is exact.
///
/// # Safety
///
/// The medium's indices were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn fly(
    scene: Scene,
    medium: &Medium,
    ray: Ray,
    distance: f32,
    carries: Vec3,
    only_transmits: bool,
    random: Words,
) -> Flight {
    let extinction = medium.extinction;
    let distance = min(distance, 1e30); // no product with 0 is NaN
    if medium.flags & HAS_GRID == 0 && only_transmits {
        return Flight { collided: false, distance, weight: transmittance(extinction, distance) };
    }
    let hero = Hero::choose(extinction, carries, random.x);
    let first = exponential(random.y);
    if medium.flags & HAS_GRID == 0 {
        let length = if hero.extinction > 0.0 { first * (1.0 / hero.extinction) } else { 1e30 };
        let collided = length < distance;
        let (distance, collisions) = if collided { (length, 1.0) } else { (distance, 0.0) };
        return Flight { collided, distance, weight: hero.weight(extinction, distance, collisions) };
    }
    // SAFETY: the caller's promise.
    let walk =
        unsafe { grid::walk(scene, medium, ray, distance, hero.extinction, first, only_transmits, random) };
    let weight = hero.weight(extinction, walk.depth, walk.collisions) * walk.transmittance;
    Flight { collided: walk.collided, distance: walk.distance, weight }
}

#[cfg(test)]
mod tests;
