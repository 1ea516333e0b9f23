//! What earlier frames saw of the surfaces that this one sees.
//!
//! While the camera rests, frames are summed as they are ([`add`]): that is the plain mean over all samples, whatever comes after.
//! While it moves, [`reproject`] finds each pixel's surface in the frame before (Schied et al. 2017, section 4.1, with Karis's clamp to the
//! neighbourhood, "High-Quality Temporal Supersampling", SIGGRAPH 2014), and lets what was known there count as some samples more. It
//! counts less with each frame that the camera rests, and then for nothing.

use super::edges::{OPEN, Stops};
use super::variance::{Around, GREATEST, around};
use super::{DenoiseParams, Edge, Lit, STOPS, View};
use crate::buffer::load;
use crate::film::PixelSums;
use crate::guides::Guides;
use crate::math::{all_finite, floor, max, min, sqrt};
use crate::rows::Stored;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// What a pixel keeps for the next frame. 48 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Past {
    /// Mean over its samples, and the variance of one of them.
    pub lit: Lit,
    /// Where.
    pub edge: Edge,
    /// How many samples that counts for.
    pub samples: f32,
    /// Unused.
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
    /// Unused.
    pub pad2: u32,
}

const _: () = assert!(size_of::<Past>() == 48 && align_of::<Past>() == 16);

impl Past {
    /// Nothing.
    pub const NONE: Self =
        Self { lit: Lit::UNKNOWN, edge: Edge::NONE, samples: 0.0, pad0: 0, pad1: 0, pad2: 0 };
}

/// The sums over a frame's samples and those over the frames before it.
#[inline(always)]
pub fn add(
    params: &DenoiseParams,
    sums: PixelSums,
    guides: Guides,
    kept: (PixelSums, Guides),
) -> (PixelSums, Guides) {
    if params.add == 0 {
        return (sums, guides);
    }
    let (mut all, mut seen) = kept;
    all.radiance += sums.radiance;
    all.squares += sums.squares;
    all.samples += sums.samples;
    all.segments = all.segments.wrapping_add(sums.segments);
    seen.add(guides);
    (all, seen)
}

/// The pixel (`x`, `y`), of so many `samples`, with what the past knows of its surface; and what it keeps for the next frame.
///
/// Its variance is that of all samples, or, where they are fewer than `params.trusted`, what its neighbourhood shows. Without a
/// past that is what [`estimate`](super::estimate) says.
///
/// # Safety
///
/// The pixel is of the image, and there is a record for each of it.
#[inline(always)]
#[allow(unsafe_code, clippy::too_many_arguments, reason = "see buffer; a binding each")]
pub unsafe fn reproject(
    params: &DenoiseParams,
    from: &[Stored<Lit>],
    edges: &[Stored<Edge>],
    past: &[Stored<Past>],
    samples: u32,
    guides: Guides,
    x: u32,
    y: u32,
) -> (Lit, Past) {
    let pixel = y * params.width + x;
    // SAFETY: the caller's promise.
    let (middle, edge) = unsafe { (load::<Lit>(from, pixel), load::<Edge>(edges, pixel)) };
    let new = if middle.is_known() { samples as f32 } else { 0.0 };
    // SAFETY: the caller's promise.
    let before = unsafe { find(params, edge, past, guides, x, y) };
    // What a mirror shows moves otherwise than its surface.
    let most =
        if before.samples > 0.0 { params.history * (guides.diffuse / guides.hits as f32) } else { 0.0 };
    let weight = max(min(before.samples, most) - params.spent, 0.0);
    let total = new + weight;
    let counted = total >= params.trusted as f32;
    let mut shown = Around { mean: Vec3::ZERO, variance: Vec3::ZERO };
    if new > 0.0 && (weight > 0.0 || !counted) {
        // SAFETY: the caller's promise.
        shown = unsafe { around(params, from, edges, middle, edge, x, y) };
    }
    // Of one sample.
    let mut variance = if new > 0.0 { middle.variance * (new - 1.0) } else { 0.0 };
    let mut lit = middle;
    if weight > 0.0 {
        let within = new > 0.0 && params.clamp < STOPS.1;
        let old = if within { clamped(before.lit.color, shown, params.clamp) } else { before.lit.color };
        let apart = old - middle.color;
        let share = weight / total; // 1 where this frame has no colour
        lit.color = if new > 0.0 { middle.color + apart * share } else { old };
        let between = if new > 0.0 { apart.dot(apart) * (share * (1.0 - share)) } else { 0.0 };
        variance = variance * (1.0 - share) + before.lit.variance * share + between;
        lit.variance = variance / max(total - 1.0, 1.0);
    }
    if total > 0.0 && !counted {
        lit.variance = shown.total();
    }
    let mut keep = Past { lit: Lit { variance, ..lit }, edge, samples: total, ..Past::NONE };
    // A past beyond the range of numbers is none.
    if !(all_finite(lit.color) && lit.variance <= GREATEST && variance <= GREATEST) {
        lit = middle;
        keep = Past { edge, ..Past::NONE };
    }
    (lit, keep)
}

/// Within so many standard deviations of what the neighbourhood shows now.
#[inline(always)]
fn clamped(color: Vec3, shown: Around, deviations: f32) -> Vec3 {
    let one = |color: f32, mean: f32, variance: f32| {
        let reach = deviations * sqrt(max(variance, 0.0));
        min(max(color, mean - reach), mean + reach)
    };
    Vec3::new(
        one(color.x, shown.mean.x, shown.variance.x),
        one(color.y, shown.mean.y, shown.variance.y),
        one(color.z, shown.mean.z, shown.variance.z),
    )
}

/// Where a view has a point, in pixels from the middle of the top left one, and whether that is in front of it.
#[inline(always)]
fn place(view: &View, point: Vec3) -> (f32, f32, bool) {
    let to = point - view.origin;
    let depth = to.dot(view.axis);
    let off = to / depth - view.first;
    let x = off.dot(view.right) / view.right.dot(view.right);
    let y = off.dot(view.down) / view.down.dot(view.down);
    (x, y, depth > 0.0)
}

/// Least share of the four pixels around a point that must have seen its surface.
const LEAST_SHARE: f32 = 0.05;

/// What the frame before knew of the surface that this pixel sees.
///
/// # Safety
///
/// As [`reproject`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn find(
    params: &DenoiseParams,
    edge: Edge,
    past: &[Stored<Past>],
    guides: Guides,
    x: u32,
    y: u32,
) -> Past {
    let point = guides.position / guides.hits as f32;
    let (now, then) = (place(&params.view, point), place(&params.before, point));
    // The way of the point, not its place: within its pixel the next sample may lie elsewhere. Without a motion it is just 0.
    let (across, down) = (x as f32 + (then.0 - now.0), y as f32 + (then.1 - now.1));
    let (width, height) = (params.width as f32, params.height as f32);
    // Comparisons of what is no number are false.
    let inside = (across > -1.0) & (down > -1.0) & (across < width) & (down < height);
    let asked = (params.history > params.spent) & (edge.depth > 0.0) & inside & then.2;
    let (left, above) = (floor(across), floor(down));
    let (right, below) = (across - left as f32, down - above as f32);
    let stops = Stops::of_plane(params, &params.before, edge.normal, point, left as f32, above as f32);
    let mut found = Past { lit: Lit { color: Vec3::ZERO, variance: 0.0 }, ..Past::NONE };
    let mut total = 0.0;
    if asked {
        macro_rules! taps {
            ($(($i:literal, $j:literal, $share:expr))*) => {$(
                let (u, v) = ((left + $i) as u32, (above + $j) as u32);
                let (there, u, v) = (
                    (u < params.width) & (v < params.height),
                    if u < params.width { u } else { 0 },
                    if v < params.height { v } else { 0 },
                );
                // SAFETY: the tap is of the image.
                let tap = unsafe { load::<Past>(past, v * params.width + u) };
                let open = stops.leave(OPEN, tap.edge, $i as f32, $j as f32);
                // More than half is left where surfaces differ by less than a stop's parameter.
                let same = there & (open > 0.5) & (tap.edge.depth > 0.0) & (tap.samples > 0.0);
                let share: f32 = if same { $share } else { 0.0 };
                found.lit.color += tap.lit.color * share;
                found.lit.variance += tap.lit.variance * share;
                found.samples += tap.samples * share;
                total += share;
            )*};
        }
        taps! {
            (0, 0, (1.0 - right) * (1.0 - below)) (1, 0, right * (1.0 - below))
            (0, 1, (1.0 - right) * below) (1, 1, right * below)
        }
    }
    if total >= LEAST_SHARE {
        found.lit.color /= total;
        found.lit.variance /= total;
        found.samples /= total;
    } else {
        found.samples = 0.0;
    }
    found
}
