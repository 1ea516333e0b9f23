//! Use of earlier frames for the surfaces that a frame sees.
//!
//! While the camera rests, [`accumulate`] sums frames without a filter: the plain mean over all
//! samples, whatever comes after. While it moves, [`reproject`] finds each pixel's surface in the
//! previous frame (Schied et al. 2017, section 4.1, with Karis's clamp to the neighbourhood,
//! "High-Quality Temporal Supersampling", SIGGRAPH 2014), whose history counts as further samples.
//! With each frame at rest the history counts for less, and finally for nothing.

use super::edge_stopping::{EdgeStopping, OPEN};
use super::variance::{MAX_VARIANCE, NeighbourhoodStats, neighbourhood_stats};
use super::{DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel, PinholeView, STOP_FACTORS};
use crate::aovs::AovSums;
use crate::buffer::load;
use crate::buffer_layout::Packed;
use crate::film::PixelSums;
use crate::math::{all_finite, floor, max, min, sqrt};
use glam::Vec3;

/// Returns the sums over a frame's samples, added to those of the frames before it (`kept`) if
/// `params.accumulate` is not 0.
#[inline(always)]
pub fn accumulate(
    params: &DenoiseParams,
    sums: PixelSums,
    aovs: AovSums,
    kept: (PixelSums, AovSums),
) -> (PixelSums, AovSums) {
    if params.accumulate == 0 {
        return (sums, aovs);
    }
    let (mut total_sums, mut total_aovs) = kept;
    total_sums.radiance += sums.radiance;
    total_sums.squares += sums.squares;
    total_sums.samples += sums.samples;
    total_sums.segments = total_sums.segments.wrapping_add(sums.segments);
    total_aovs.add(aovs);
    (total_sums, total_aovs)
}

/// Returns pixel (`x`, `y`), which has `samples` samples, combined with the history of its surface,
/// and the pixel's history for the next frame.
///
/// Its variance is that of all samples or, if they are fewer than `params.trusted_samples`, that of
/// its neighbourhood. Without a history it is the result of
/// [`estimate_variance`](super::estimate_variance).
///
/// # Safety
///
/// The pixel lies inside the image, and each slice has a record for each pixel.
#[inline(always)]
#[allow(unsafe_code, clippy::too_many_arguments, reason = "see buffer; one argument per binding")]
pub unsafe fn reproject(
    params: &DenoiseParams,
    from: &[Packed<FilteredPixel>],
    edges: &[Packed<GBufferTexel>],
    history: &[Packed<HistoryPixel>],
    samples: u32,
    aovs: AovSums,
    x: u32,
    y: u32,
) -> (FilteredPixel, HistoryPixel) {
    let pixel = y * params.width + x;
    // SAFETY: the caller's promise.
    let (middle, edge) = unsafe { (load::<FilteredPixel>(from, pixel), load::<GBufferTexel>(edges, pixel)) };
    // SAFETY: the caller's promise.
    let found = unsafe { Reprojection::new(params, middle, edge, history, samples, aovs, x, y) };
    let mut shown = NeighbourhoodStats::NONE;
    if found.needs_neighbourhood() {
        // SAFETY: the caller's promise.
        shown = unsafe { neighbourhood_stats(params, from, edges, middle, edge, x, y) };
    }
    found.combine(params, shown)
}

/// A pixel and the history of its surface.
#[derive(Clone, Copy, Debug)]
pub struct Reprojection {
    middle: FilteredPixel,
    edge: GBufferTexel,
    previous: HistoryPixel,
    /// Number of samples of this frame.
    new: f32,
    /// Number of samples that the history counts for.
    weight: f32,
    /// True if the samples of both suffice for a variance.
    counted: bool,
}

impl Reprojection {
    /// Finds the history of pixel (`x`, `y`), which has the colour `middle`, the surface `edge` and
    /// `samples` samples.
    ///
    /// # Safety
    ///
    /// As [`reproject`].
    #[inline(always)]
    #[allow(unsafe_code, clippy::too_many_arguments, reason = "see buffer; one argument per binding")]
    pub unsafe fn new(
        params: &DenoiseParams,
        middle: FilteredPixel,
        edge: GBufferTexel,
        history: &[Packed<HistoryPixel>],
        samples: u32,
        aovs: AovSums,
        x: u32,
        y: u32,
    ) -> Self {
        let new = if middle.is_known() { samples as f32 } else { 0.0 };
        // SAFETY: the caller's promise.
        let previous = unsafe { find_history(params, edge, history, aovs, x, y) };
        // A reflection in a mirror does not move with the mirror's surface.
        let max_weight =
            if previous.samples > 0.0 { params.max_history * (aovs.diffuse / aovs.hits as f32) } else { 0.0 };
        let weight = max(min(previous.samples, max_weight) - params.expired_history, 0.0);
        let counted = new + weight >= params.trusted_samples as f32;
        Self { middle, edge, previous, new, weight, counted }
    }

    /// Returns whether [`combine`](Self::combine) reads the pixel's neighbourhood.
    #[inline(always)]
    pub fn needs_neighbourhood(&self) -> bool {
        self.new > 0.0 && (self.weight > 0.0 || !self.counted)
    }

    /// Returns what [`reproject`] returns, for the neighbourhood `shown`.
    #[inline(always)]
    pub fn combine(
        &self,
        params: &DenoiseParams,
        shown: NeighbourhoodStats,
    ) -> (FilteredPixel, HistoryPixel) {
        let Self { middle, edge, previous, new, weight, counted } = *self;
        let total = new + weight;
        // Variance of one sample.
        let mut variance = if new > 0.0 { middle.variance * (new - 1.0) } else { 0.0 };
        let mut lit = middle;
        if weight > 0.0 {
            let within = new > 0.0 && params.clamp_deviations < STOP_FACTORS.1;
            let old = if within {
                clamp_to_neighbourhood(previous.filtered.color, shown, params.clamp_deviations)
            } else {
                previous.filtered.color
            };
            let difference = old - middle.color;
            let share = weight / total; // 1 if this frame has no colour
            lit.color = if new > 0.0 { middle.color + difference * share } else { old };
            let between = if new > 0.0 { difference.dot(difference) * (share * (1.0 - share)) } else { 0.0 };
            variance = variance * (1.0 - share) + previous.filtered.variance * share + between;
            lit.variance = variance / max(total - 1.0, 1.0);
        }
        if total > 0.0 && !counted {
            lit.variance = shown.total_variance();
        }
        let mut keep = HistoryPixel {
            filtered: FilteredPixel { variance, ..lit },
            gbuffer: edge,
            samples: total,
            ..HistoryPixel::NONE
        };
        // A history beyond the range of numbers is dropped.
        if !(all_finite(lit.color) && lit.variance <= MAX_VARIANCE && variance <= MAX_VARIANCE) {
            lit = middle;
            keep = HistoryPixel { gbuffer: edge, ..HistoryPixel::NONE };
        }
        (lit, keep)
    }
}

/// Returns `color`, clamped to `deviations` standard deviations around the mean of the
/// neighbourhood.
#[inline(always)]
fn clamp_to_neighbourhood(color: Vec3, shown: NeighbourhoodStats, deviations: f32) -> Vec3 {
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

/// Returns the position of a point in a view, in pixels from the middle of the top left pixel, and
/// whether the point is in front of the camera.
#[inline(always)]
fn project(view: &PinholeView, point: Vec3) -> (f32, f32, bool) {
    let to = point - view.origin;
    let depth = to.dot(view.axis);
    let off = to / depth - view.first_pixel;
    let x = off.dot(view.right) / view.right.dot(view.right);
    let y = off.dot(view.down) / view.down.dot(view.down);
    (x, y, depth > 0.0)
}

/// Minimum weight, of the four pixels around a point, of those that saw its surface.
const MIN_SHARE: f32 = 0.05;

/// Returns the history of the surface that this pixel sees, from the previous frame.
///
/// # Safety
///
/// As [`reproject`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn find_history(
    params: &DenoiseParams,
    edge: GBufferTexel,
    history: &[Packed<HistoryPixel>],
    aovs: AovSums,
    x: u32,
    y: u32,
) -> HistoryPixel {
    let point = aovs.position / aovs.hits as f32;
    let (now, then) = (project(&params.view, point), project(&params.previous_view, point));
    // Adds the point's motion, not its position: within its pixel the next sample may lie
    // elsewhere. Without motion the difference is exactly 0.
    let (across, down) = (x as f32 + (then.0 - now.0), y as f32 + (then.1 - now.1));
    let (width, height) = (params.width as f32, params.height as f32);
    // Comparisons with NaN are false.
    let inside = (across > -1.0) & (down > -1.0) & (across < width) & (down < height);
    let is_searched =
        (params.max_history > params.expired_history) & (edge.inverse_depth > 0.0) & inside & then.2;
    let (left, above) = (floor(across), floor(down));
    let (right, below) = (across - left as f32, down - above as f32);
    let stops =
        EdgeStopping::of_plane(params, &params.previous_view, edge.normal, point, left as f32, above as f32);
    let mut found =
        HistoryPixel { filtered: FilteredPixel { color: Vec3::ZERO, variance: 0.0 }, ..HistoryPixel::NONE };
    let mut total = 0.0;
    if is_searched {
        macro_rules! taps {
            ($(($i:literal, $j:literal, $share:expr))*) => {$(
                let (u, v) = ((left + $i) as u32, (above + $j) as u32);
                let (there, u, v) = (
                    (u < params.width) & (v < params.height),
                    if u < params.width { u } else { 0 },
                    if v < params.height { v } else { 0 },
                );
                // SAFETY: the tap lies inside the image.
                let tap = unsafe { load::<HistoryPixel>(history, v * params.width + u) };
                let open = stops.remaining(OPEN, tap.gbuffer, $i as f32, $j as f32);
                // More than half is left if the surfaces differ by less than a parameter of edge
                // stopping.
                let same = there & (open > 0.5) & (tap.gbuffer.inverse_depth > 0.0) & (tap.samples > 0.0);
                let share: f32 = if same { $share } else { 0.0 };
                found.filtered.color += tap.filtered.color * share;
                found.filtered.variance += tap.filtered.variance * share;
                found.samples += tap.samples * share;
                total += share;
            )*};
        }
        taps! {
            (0, 0, (1.0 - right) * (1.0 - below)) (1, 0, right * (1.0 - below))
            (0, 1, (1.0 - right) * below) (1, 1, right * below)
        }
    }
    if total >= MIN_SHARE {
        found.filtered.color /= total;
        found.filtered.variance /= total;
        found.samples /= total;
    } else {
        found.samples = 0.0;
    }
    found
}
