//! A level of the à-trous transform on a CPU: pixels of a row, eight at a time, with the bits of
//! [`atrous_level`](super::atrous_level).
//!
//! The rows that the taps lie in are first turned into planes, a number a pixel, so that eight
//! pixels' taps are eight numbers next to each other.

use super::atrous::{B3, MIN_VARIANCE, PIXELS_PER_THREAD};
use super::edge_stopping::{OPEN, SHUT};
use super::{DenoiseParams, FilteredPixel, GBufferTexel, STOP_FACTORS, UNKNOWN_VARIANCE};
use crate::simd::{LANES, Simd, dot};
use core::ops::Range;
use glam::Vec3;

/// Planes of a row of taps: colour, variance, normal, inverse depth, and whether the tap counts.
const PLANES: usize = 9;

/// Rows of taps of a set of pixels.
const TAP_ROWS: usize = 4 + PIXELS_PER_THREAD as usize;

/// Planes of variances around a row of pixels.
const VARIANCE_ROWS: usize = 3;

/// Geometry of the planes of a span of pixels.
#[derive(Clone, Copy)]
struct Layout {
    /// First column of the span's taps, which may lie outside the image.
    first: i64,
    /// Columns of taps.
    columns: usize,
    /// Numbers of a plane: the columns, and as many as a load of eight may reach beyond.
    stride: usize,
}

impl Layout {
    fn new(step: u32, span: &Range<u32>) -> Self {
        let reach = 2 * i64::from(step).max(1);
        let columns = span.len() + 2 * reach as usize;
        Self { first: i64::from(span.start) - reach, columns, stride: columns + LANES }
    }

    /// Returns the numbers of all planes.
    fn numbers(&self) -> usize {
        (TAP_ROWS * PLANES + VARIANCE_ROWS) * self.stride
    }
}

/// Returns how many numbers [`atrous_rows`] needs for a span of pixels.
pub fn row_numbers(params: &DenoiseParams, span: &Range<u32>) -> usize {
    Layout::new(params.step, span).numbers()
}

/// Calls `write` with the index and the value of each pixel of the next level in the columns `span`
/// of set number `row`: the pixels that threads `span` of a device write.
///
/// # Panics
///
/// If `planes` has fewer numbers than [`row_numbers`] returns, or a slice has fewer records than
/// the image has pixels.
pub fn atrous_rows<const BY_VARIANCE: bool, L: Simd>(
    l: L,
    params: &DenoiseParams,
    from: &[FilteredPixel],
    edges: &[GBufferTexel],
    span: Range<u32>,
    row: u32,
    planes: &mut [f32],
    write: impl FnMut(u32, FilteredPixel),
) {
    let pixels = params.width as usize * params.height as usize;
    let mut of = Rows {
        l,
        params,
        from: &from[..pixels],
        edges: &edges[..pixels],
        layout: Layout::new(params.step, &span),
        planes,
        write,
    };
    of.set::<BY_VARIANCE>(span, row);
}

/// Pixels of a span, and the planes of their taps.
struct Rows<'a, L: Simd, W> {
    l: L,
    params: &'a DenoiseParams,
    from: &'a [FilteredPixel],
    edges: &'a [GBufferTexel],
    layout: Layout,
    planes: &'a mut [f32],
    write: W,
}

/// Eight pixels and the sums over their taps.
struct LaneSums<L: Simd> {
    color: [L::F; 3],
    normal: [L::F; 3],
    /// Tangent plane, as in [`EdgeStopping`](super::edge_stopping::EdgeStopping).
    cosine: L::F,
    across: L::F,
    along: L::F,
    distance: L::F,
    /// Factor of the squared distance of colours.
    color_factor: L::F,
    difference: [L::F; 3],
    variance: L::F,
    weight: L::F,
}

impl<L: Simd, W: FnMut(u32, FilteredPixel)> Rows<'_, L, W> {
    #[inline(always)]
    fn set<const BY_VARIANCE: bool>(&mut self, span: Range<u32>, row: u32) {
        let (step, height) = (self.params.step.max(1), self.params.height);
        let y = row / step * (PIXELS_PER_THREAD * step) + row % step;
        if y >= height || span.is_empty() {
            return;
        }
        assert!(self.planes.len() >= self.layout.numbers(), "planes of a smaller span");
        for tap_row in 0..TAP_ROWS {
            self.fill_taps(tap_row, i64::from(y) + (tap_row as i64 - 2) * i64::from(step));
        }
        for of_set in 0..PIXELS_PER_THREAD as usize {
            let y = y + of_set as u32 * step;
            if y >= height {
                break;
            }
            if const { BY_VARIANCE } {
                for row in 0..VARIANCE_ROWS {
                    self.fill_variances(row, i64::from(y) + row as i64 - 1);
                }
            }
            let mut x = span.start;
            while x < span.end {
                self.eight::<BY_VARIANCE>(&span, of_set, x, y);
                x += LANES as u32;
            }
        }
    }

    /// Returns the pixels of row `y` that taps may lie on, and the column of the first of them;
    /// none if the row lies outside the image.
    #[inline(always)]
    fn inside(&self, y: i64) -> (Range<usize>, usize) {
        let (width, height) = (i64::from(self.params.width), i64::from(self.params.height));
        let start = self.layout.first.max(0);
        let end = (self.layout.first + self.layout.columns as i64).min(width);
        if y < 0 || y >= height || start >= end {
            return (0..0, 0);
        }
        ((y * width + start) as usize..(y * width + end) as usize, (start - self.layout.first) as usize)
    }

    /// Turns row `y` into the planes of a row of taps.
    #[inline(always)]
    fn fill_taps(&mut self, tap_row: usize, y: i64) {
        let (pixels, column) = self.inside(y);
        let stride = self.layout.stride;
        let planes = &mut self.planes[tap_row * PLANES * stride..(tap_row + 1) * PLANES * stride];
        let mut of = planes.chunks_exact_mut(stride);
        let mut next = || of.next().unwrap_or_default();
        let [red, green, blue, variance] = [next(), next(), next(), next()];
        let [normal_x, normal_y, normal_z, depth, open] = [next(), next(), next(), next(), next()];
        open.fill(SHUT);
        let taps = column..column + pixels.len();
        let lit = &self.from[pixels.clone()];
        let colors = red[taps.clone()].iter_mut().zip(&mut green[taps.clone()]).zip(&mut blue[taps.clone()]);
        let rest = variance[taps.clone()].iter_mut().zip(&mut open[taps.clone()]);
        for ((((red, green), blue), (variance, open)), lit) in colors.zip(rest).zip(lit) {
            (*red, *green, *blue, *variance) = (lit.color.x, lit.color.y, lit.color.z, lit.variance);
            *open = if lit.variance >= 0.0 { OPEN } else { SHUT };
        }
        let normals = normal_x[taps.clone()].iter_mut().zip(&mut normal_y[taps.clone()]);
        let rest = normal_z[taps.clone()].iter_mut().zip(&mut depth[taps]);
        for (((x, y), (z, depth)), edge) in normals.zip(rest).zip(&self.edges[pixels]) {
            (*x, *y, *z, *depth) = (edge.normal.x, edge.normal.y, edge.normal.z, edge.inverse_depth);
        }
    }

    /// Turns the variances of row `y` into a plane.
    #[inline(always)]
    fn fill_variances(&mut self, row: usize, y: i64) {
        let (pixels, column) = self.inside(y);
        let stride = self.layout.stride;
        let plane = &mut self.planes[(TAP_ROWS * PLANES + row) * stride..][..stride];
        plane.fill(UNKNOWN_VARIANCE);
        for (variance, lit) in plane[column..].iter_mut().zip(&self.from[pixels]) {
            *variance = lit.variance;
        }
    }

    /// Returns eight numbers of a plane.
    #[inline(always)]
    #[allow(unsafe_code, reason = "spares a check for each of 200 loads")]
    fn load(&self, plane: usize, column: usize) -> L::F {
        debug_assert!(column + LANES <= self.layout.stride);
        let at = plane * self.layout.stride + column;
        // SAFETY: `set` has compared the number of planes, and a column of taps of eight pixels of
        // the span is below the stride less eight.
        unsafe { self.l.load_unaligned(&*self.planes.as_ptr().add(at).cast::<[f32; LANES]>()) }
    }

    #[inline(always)]
    fn load3(&self, plane: usize, column: usize) -> [L::F; 3] {
        [0, 1, 2].map(|channel| self.load(plane + channel, column))
    }

    /// Computes the pixels from (`x`, `y`) on.
    #[inline(always)]
    fn eight<const BY_VARIANCE: bool>(&mut self, span: &Range<u32>, of_set: usize, x: u32, y: u32) {
        let (l, step) = (self.l, self.params.step.max(1) as usize);
        let column = 2 * step + (x - span.start) as usize;
        let mut sums = self.begin::<BY_VARIANCE>((2 + of_set) * PLANES, column, x, y);
        for i in 0..5 {
            let across = l.mul(sums.across, l.splat(i as f32 - 2.0));
            let column = column - 2 * step + i * step;
            for j in 0..5 {
                let plane = (j + of_set) * PLANES;
                let open = if i == 2 && j == 2 { l.splat(SHUT) } else { self.load(plane + 8, column) };
                let kernel = B3[i.abs_diff(2)] * B3[j.abs_diff(2)];
                let along = l.mul(sums.along, l.splat(j as f32 - 2.0));
                self.tap::<BY_VARIANCE>(&mut sums, plane, column, open, kernel, across, along);
            }
        }
        let by = l.div(l.splat(1.0), sums.weight);
        let color = [0, 1, 2].map(|c| l.store(l.add(sums.color[c], l.mul(sums.difference[c], by))).0);
        let variance = match BY_VARIANCE {
            true => l.store(l.mul(sums.variance, l.mul(by, by))).0,
            false => [0.0; LANES],
        };
        let has_weight = l.bits(l.lt(l.splat(0.0), sums.weight));
        let first = y * self.params.width + x;
        for lane in 0..LANES.min((span.end - x) as usize) {
            let [red, green, blue] = color.map(|channel| channel[lane]);
            let pixel = match has_weight >> lane & 1 == 1 {
                true => FilteredPixel { color: Vec3::new(red, green, blue), variance: variance[lane] },
                false => FilteredPixel::UNKNOWN,
            };
            (self.write)(first + lane as u32, pixel);
        }
    }

    /// Returns the sums of eight pixels with their own weight only.
    #[inline(always)]
    fn begin<const BY_VARIANCE: bool>(&self, plane: usize, column: usize, x: u32, y: u32) -> LaneSums<L> {
        let (l, params) = (self.l, self.params);
        let (color, own_variance) = (self.load3(plane, column), self.load(plane + 3, column));
        let (normal, inverse_depth) = (self.load3(plane + 4, column), self.load(plane + 7, column));
        let zero = l.splat(0.0);
        let known = l.le(zero, own_variance);
        let mut color_factor = l.splat(params.color_factor);
        if const { BY_VARIANCE } {
            let variance = self.smoothed_variance(column);
            let relative = l.div(color_factor, l.add(variance, l.splat(MIN_VARIANCE)));
            let (least, most) = (l.splat(STOP_FACTORS.0), l.splat(STOP_FACTORS.1));
            let bounded = l.select(l.lt(relative, most), relative, most);
            color_factor = l.select(l.lt(least, relative), bounded, least);
        }
        let color_factor = l.select(known, color_factor, l.splat(STOP_FACTORS.0));
        let own = l.select(known, l.splat(B3[0] * B3[0]), zero);
        let view = &params.view;
        let mut columns = [0.0; LANES];
        (0..).zip(&mut columns).for_each(|(lane, column)| *column = (x + lane) as f32);
        let columns = l.load_unaligned(&columns);
        let (first, right) = (view.first_pixel.to_array(), view.right.to_array());
        let down = (view.down * y as f32).to_array();
        let to = [0, 1, 2]
            .map(|c| l.add(l.add(l.splat(first[c]), l.mul(l.splat(right[c]), columns)), l.splat(down[c])));
        let cosine = l.mul(dot(l, normal, to), l.splat(params.depth_factor));
        let by = l.splat(params.depth_factor * params.step as f32);
        let along = |v: Vec3| l.mul(dot(l, normal, v.to_array().map(|x| l.splat(x))), by);
        LaneSums {
            color,
            normal: normal.map(|n| l.mul(n, l.splat(params.normal_factor))),
            cosine,
            across: along(view.right),
            along: along(view.down),
            distance: l.select(l.lt(zero, inverse_depth), l.div(cosine, inverse_depth), zero),
            color_factor,
            difference: [zero; 3],
            variance: l.mul(l.mul(own, own), own_variance),
            weight: own,
        }
    }

    /// Returns the variances around eight pixels, as
    /// [`smoothed_variance`](super::variance::smoothed_variance) does.
    #[inline(always)]
    fn smoothed_variance(&self, column: usize) -> L::F {
        const WEIGHTS: [[f32; 3]; 3] = [[1.0, 2.0, 1.0], [2.0, 4.0, 2.0], [1.0, 2.0, 1.0]];
        let l = self.l;
        let zero = l.splat(0.0);
        let (mut sum, mut total) = (zero, zero);
        for (row, weights) in WEIGHTS.iter().enumerate() {
            for (tap, &weight) in weights.iter().enumerate() {
                let variance = self.load(TAP_ROWS * PLANES + row, column + tap - 1);
                let weight = l.select(l.le(zero, variance), l.splat(weight), zero);
                sum = l.add(sum, l.mul(variance, weight));
                total = l.add(total, weight);
            }
        }
        l.select(l.lt(zero, total), l.div(sum, total), zero)
    }

    /// Adds a tap of eight pixels.
    #[inline(always)]
    fn tap<const BY_VARIANCE: bool>(
        &self,
        sums: &mut LaneSums<L>,
        plane: usize,
        column: usize,
        open: L::F,
        kernel: f32,
        across: L::F,
        along: L::F,
    ) {
        let l = self.l;
        let (color, normal) = (self.load3(plane, column), self.load3(plane + 4, column));
        let inverse_depth = self.load(plane + 7, column);
        let zero = l.splat(0.0);
        let difference = [0, 1, 2].map(|c| l.sub(color[c], sums.color[c]));
        let facing = dot(l, sums.normal, normal);
        let turned = l.max(l.sub(l.splat(self.params.normal_factor), facing), zero);
        let plane_distance = l.add(l.add(sums.cosine, across), along);
        let off = l.sub(plane_distance, l.mul(sums.distance, inverse_depth));
        let left = l.sub(l.sub(open, turned), l.mul(off, off));
        let apart = l.mul(dot(l, difference, difference), sums.color_factor);
        let root = l.max(l.sub(left, apart), zero);
        let weight = l.mul(l.splat(kernel), l.mul(root, root));
        for c in 0..3 {
            sums.difference[c] = l.add(sums.difference[c], l.mul(difference[c], weight));
        }
        sums.weight = l.add(sums.weight, weight);
        if const { BY_VARIANCE } {
            let variance = self.load(plane + 3, column);
            sums.variance = l.add(sums.variance, l.mul(l.mul(weight, weight), variance));
        }
    }
}
