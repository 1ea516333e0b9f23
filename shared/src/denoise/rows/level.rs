//! A level of the à-trous transform, with the bits of
//! [`atrous_level`](super::super::atrous_level).

use super::super::atrous::{B3, MIN_VARIANCE, PIXELS_PER_THREAD};
use super::super::edge_stopping::SHUT;
use super::super::{DenoiseParams, FilteredPixel, GBufferTexel, STOP_FACTORS};
use super::planes::{LaneStops, Layout, Planes, VARIANCE_ROWS};
use crate::simd::{LANES, Simd, dot, three};
use core::ops::Range;
use glam::Vec3;

/// Rows of taps of a set of pixels.
const TAP_ROWS: usize = 4 + PIXELS_PER_THREAD as usize;

fn layout(params: &DenoiseParams, span: &Range<u32>) -> Layout {
    Layout::new(span, 2 * params.step.max(1), TAP_ROWS)
}

/// Returns how many numbers [`atrous_rows`] needs for a span of pixels.
pub fn level_numbers(params: &DenoiseParams, span: &Range<u32>) -> usize {
    layout(params, span).numbers()
}

/// Calls `write` with the index and the value of each pixel of the next level in the columns `span`
/// of set number `row`: the pixels that threads `span` of a device write.
///
/// # Panics
///
/// If `numbers` is shorter than [`level_numbers`], or a slice than the image has pixels.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "a launch, its memory and its output")]
pub fn atrous_rows<const BY_VARIANCE: bool, L: Simd>(
    l: L,
    params: &DenoiseParams,
    from: &[FilteredPixel],
    edges: &[GBufferTexel],
    span: Range<u32>,
    row: u32,
    numbers: &mut [f32],
    mut write: impl FnMut(u32, FilteredPixel),
) {
    let step = params.step.max(1);
    let first = row / step * (PIXELS_PER_THREAD * step) + row % step;
    if first >= params.height {
        return;
    }
    let mut planes = Planes::new(l, params, from, edges, layout(params, &span), numbers);
    for tap_row in 0..TAP_ROWS {
        planes.fill_taps(tap_row, i64::from(first) + (tap_row as i64 - 2) * i64::from(step));
    }
    let rows = (0..PIXELS_PER_THREAD).map(|of_set| (of_set as usize, first + of_set * step));
    for (of_set, y) in rows.filter(|(_, y)| *y < params.height) {
        if const { BY_VARIANCE } {
            for row in 0..VARIANCE_ROWS {
                planes.fill_variances(row, i64::from(y) + row as i64 - 1);
            }
        }
        for x in span.clone().step_by(LANES) {
            let column = 2 * step as usize + (x - span.start) as usize;
            let pixels = eight::<BY_VARIANCE, L>(&planes, of_set, column, x, y);
            let count = LANES.min((span.end - x) as usize);
            for (index, pixel) in (y * params.width + x..).zip(&pixels[..count]) {
                write(index, *pixel);
            }
        }
    }
}

/// Sums over the taps of eight pixels.
struct LaneSums<L: Simd> {
    difference: [L::F; 3],
    variance: L::F,
    weight: L::F,
}

/// Returns the pixels from (`x`, `y`) on, which lie in row `2 + of_set` of the taps.
#[inline(always)]
fn eight<const BY_VARIANCE: bool, L: Simd>(
    planes: &Planes<'_, L>,
    of_set: usize,
    column: usize,
    x: u32,
    y: u32,
) -> [FilteredPixel; LANES] {
    let (l, step) = (planes.l, planes.params.step.max(1) as usize);
    let (zero, own_row) = (l.splat(0.0), 2 + of_set);
    let middle = planes.taps(own_row, column);
    let own_variance = planes.variance(own_row, column);
    let known = l.le(zero, own_variance);
    let color_factor =
        l.select(known, color_factor::<BY_VARIANCE, L>(planes, column), l.splat(STOP_FACTORS.0));
    let stops = LaneStops::new(l, planes.params, &middle, x, y, planes.params.step as f32);
    let own = l.select(known, l.splat(B3[0] * B3[0]), zero);
    let mut sums =
        LaneSums::<L> { difference: [zero; 3], variance: l.mul(l.mul(own, own), own_variance), weight: own };
    for i in 0..5 {
        let across = l.mul(stops.across, l.splat(i as f32 - 2.0));
        let column = column - 2 * step + i * step;
        for j in 0..5 {
            let row = j + of_set;
            let (taps, along) = (planes.taps(row, column), l.mul(stops.along, l.splat(j as f32 - 2.0)));
            let open = if i == 2 && j == 2 { l.splat(SHUT) } else { planes.open(row, column) };
            let left = stops.remaining(l, open, &taps, across, along);
            let difference = three([0, 1, 2], |c| l.sub(taps.color[c], middle.color[c]));
            let root = l.max(l.sub(left, l.mul(dot(l, difference, difference), color_factor)), zero);
            let kernel = B3[i.abs_diff(2)] * B3[j.abs_diff(2)];
            let weight = l.mul(l.splat(kernel), l.mul(root, root));
            sums.difference = three([0, 1, 2], |c| l.add(sums.difference[c], l.mul(difference[c], weight)));
            sums.weight = l.add(sums.weight, weight);
            if const { BY_VARIANCE } {
                let variance = planes.variance(row, column);
                sums.variance = l.add(sums.variance, l.mul(l.mul(weight, weight), variance));
            }
        }
    }
    let by = l.div(l.splat(1.0), sums.weight);
    let [red, green, blue] =
        three([0, 1, 2], |c| l.store(l.add(middle.color[c], l.mul(sums.difference[c], by))).0);
    let variance = if const { BY_VARIANCE } { l.mul(sums.variance, l.mul(by, by)) } else { zero };
    let (variance, has_weight) = (l.store(variance).0, l.bits(l.lt(zero, sums.weight)));
    core::array::from_fn(|lane| match has_weight >> lane & 1 == 1 {
        true => {
            FilteredPixel { color: Vec3::new(red[lane], green[lane], blue[lane]), variance: variance[lane] }
        }
        false => FilteredPixel::UNKNOWN,
    })
}

/// Returns the factor of the squared distance of colours for eight pixels with a colour.
#[inline(always)]
fn color_factor<const BY_VARIANCE: bool, L: Simd>(planes: &Planes<'_, L>, column: usize) -> L::F {
    const WEIGHTS: [[f32; 3]; 3] = [[1.0, 2.0, 1.0], [2.0, 4.0, 2.0], [1.0, 2.0, 1.0]];
    let l = planes.l;
    let factor = l.splat(planes.params.color_factor);
    if const { !BY_VARIANCE } {
        return factor;
    }
    let zero = l.splat(0.0);
    let (mut sum, mut total) = (zero, zero);
    for (row, weights) in WEIGHTS.iter().enumerate() {
        for (tap, &weight) in weights.iter().enumerate() {
            let variance = planes.of_variances(row, column + tap - 1);
            let weight = l.select(l.le(zero, variance), l.splat(weight), zero);
            sum = l.add(sum, l.mul(variance, weight));
            total = l.add(total, weight);
        }
    }
    let variance = l.select(l.lt(zero, total), l.div(sum, total), zero);
    let relative = l.div(factor, l.add(variance, l.splat(MIN_VARIANCE)));
    let (least, most) = (l.splat(STOP_FACTORS.0), l.splat(STOP_FACTORS.1));
    l.select(l.lt(least, relative), l.select(l.lt(relative, most), relative, most), least)
}
