//! Planes of the rows around a span of pixels: a number a pixel, so that the taps of eight pixels
//! are eight numbers next to each other.

use super::super::edge_stopping::{OPEN, SHUT};
use super::super::{DenoiseParams, FilteredPixel, GBufferTexel, UNKNOWN_VARIANCE};
use crate::simd::{LANES, Simd, dot, three};
use core::ops::Range;
use glam::Vec3;

/// Planes of a row of taps: colour, variance, normal, inverse depth, and whether the tap counts.
const PLANES: usize = 9;

/// Size of the planes of a span of pixels.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// First column of the span's taps, which may lie outside the image.
    first: i64,
    /// Columns of taps.
    columns: usize,
    /// Numbers of a plane: the columns, and as many as a load of eight may reach beyond.
    stride: usize,
    /// Rows of taps.
    rows: usize,
}

/// Planes of variances, after those of the rows of taps.
pub(super) const VARIANCE_ROWS: usize = 3;

impl Layout {
    /// Layout of a span whose taps lie up to `reach` columns aside, in `rows` rows.
    pub(super) fn new(span: &Range<u32>, reach: u32, rows: usize) -> Self {
        let columns = span.len() + 2 * reach as usize;
        Self { first: i64::from(span.start) - i64::from(reach), columns, stride: columns + LANES, rows }
    }

    /// Returns the numbers of all planes.
    pub(super) fn numbers(&self) -> usize {
        (self.rows * PLANES + VARIANCE_ROWS) * self.stride
    }
}

/// Planes of a span, in memory of the caller.
pub(super) struct Planes<'a, L> {
    pub l: L,
    pub params: &'a DenoiseParams,
    from: &'a [FilteredPixel],
    edges: &'a [GBufferTexel],
    layout: Layout,
    numbers: &'a mut [f32],
}

/// Eight taps.
pub(super) struct Taps<L: Simd> {
    pub color: [L::F; 3],
    pub normal: [L::F; 3],
    pub inverse_depth: L::F,
}

impl<'a, L: Simd> Planes<'a, L> {
    /// Creates planes of an image.
    ///
    /// # Panics
    ///
    /// If `numbers` is shorter than the layout needs, or a slice than the image.
    #[inline(always)]
    pub(super) fn new(
        l: L,
        params: &'a DenoiseParams,
        from: &'a [FilteredPixel],
        edges: &'a [GBufferTexel],
        layout: Layout,
        numbers: &'a mut [f32],
    ) -> Self {
        let pixels = params.width as usize * params.height as usize;
        let numbers = &mut numbers[..layout.numbers()];
        Self { l, params, from: &from[..pixels], edges: &edges[..pixels], layout, numbers }
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

    /// Turns row `y` of the image into row `row` of the taps.
    #[inline(always)]
    pub(super) fn fill_taps(&mut self, row: usize, y: i64) {
        let (pixels, column) = self.inside(y);
        let stride = self.layout.stride;
        let planes = &mut self.numbers[row * PLANES * stride..(row + 1) * PLANES * stride];
        // Taps outside the image have a weight of 0, which only finite numbers keep at 0.
        for plane in planes.chunks_exact_mut(stride) {
            plane[..column].fill(0.0);
            plane[column + pixels.len()..].fill(0.0);
        }
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
            *open = if lit.is_known() { OPEN } else { SHUT };
        }
        let normals = normal_x[taps.clone()].iter_mut().zip(&mut normal_y[taps.clone()]);
        let rest = normal_z[taps.clone()].iter_mut().zip(&mut depth[taps]);
        for (((x, y), (z, depth)), edge) in normals.zip(rest).zip(&self.edges[pixels]) {
            (*x, *y, *z, *depth) = (edge.normal.x, edge.normal.y, edge.normal.z, edge.inverse_depth);
        }
    }

    /// Turns the variances of row `y` into plane `row` of the variances.
    #[inline(always)]
    pub(super) fn fill_variances(&mut self, row: usize, y: i64) {
        let (pixels, column) = self.inside(y);
        let stride = self.layout.stride;
        let plane = &mut self.numbers[(self.layout.rows * PLANES + row) * stride..][..stride];
        plane.fill(UNKNOWN_VARIANCE);
        for (variance, lit) in plane[column..].iter_mut().zip(&self.from[pixels]) {
            *variance = lit.variance;
        }
    }

    /// Returns eight numbers of a plane.
    #[inline(always)]
    #[allow(unsafe_code, reason = "spares a check for each of 200 loads")]
    fn load(&self, plane: usize, column: usize) -> L::F {
        debug_assert!(plane < self.layout.rows * PLANES + VARIANCE_ROWS);
        debug_assert!(column + LANES <= self.layout.stride);
        let at = plane * self.layout.stride + column;
        // SAFETY: there are as many numbers as the layout says. Callers name rows of the layout and
        // columns of taps of the span, which are at least eight below the stride.
        unsafe { self.l.load_unaligned(&*self.numbers.as_ptr().add(at).cast::<[f32; LANES]>()) }
    }

    /// Returns the taps of eight pixels.
    #[inline(always)]
    pub(super) fn taps(&self, row: usize, column: usize) -> Taps<L> {
        let load = |plane| self.load(row * PLANES + plane, column);
        Taps {
            color: [load(0), load(1), load(2)],
            normal: [load(4), load(5), load(6)],
            inverse_depth: load(7),
        }
    }

    /// Returns the variances of taps.
    #[inline(always)]
    pub(super) fn variance(&self, row: usize, column: usize) -> L::F {
        self.load(row * PLANES + 3, column)
    }

    /// Returns [`OPEN`] or [`SHUT`] for taps.
    #[inline(always)]
    pub(super) fn open(&self, row: usize, column: usize) -> L::F {
        self.load(row * PLANES + 8, column)
    }

    /// Returns numbers of a plane of variances.
    #[inline(always)]
    pub(super) fn of_variances(&self, row: usize, column: usize) -> L::F {
        self.load(self.layout.rows * PLANES + row, column)
    }
}

/// Edge stopping of eight pixels: [`EdgeStopping`](super::super::edge_stopping::EdgeStopping), lane
/// by lane.
pub(super) struct LaneStops<L: Simd> {
    normal: [L::F; 3],
    normal_factor: L::F,
    cosine: L::F,
    /// Change of the tangent plane for a tap to the right.
    pub across: L::F,
    /// Change of the tangent plane for a tap down.
    pub along: L::F,
    distance: L::F,
}

impl<L: Simd> LaneStops<L> {
    /// Creates the edge stopping of the pixels from (`x`, `y`) on, for taps `step` pixels apart.
    #[inline(always)]
    pub(super) fn new(l: L, params: &DenoiseParams, own: &Taps<L>, x: u32, y: u32, step: f32) -> Self {
        let view = &params.view;
        let zero = l.splat(0.0);
        let columns: [f32; LANES] = core::array::from_fn(|lane| (x + lane as u32) as f32);
        let columns = l.load_unaligned(&columns);
        let (first, right) = (view.first_pixel.to_array(), view.right.to_array());
        let down = (view.down * y as f32).to_array();
        let to = three([0, 1, 2], |c| {
            l.add(l.add(l.splat(first[c]), l.mul(l.splat(right[c]), columns)), l.splat(down[c]))
        });
        let cosine = l.mul(dot(l, own.normal, to), l.splat(params.depth_factor));
        let by = l.splat(params.depth_factor * step);
        let change = |v: Vec3| l.mul(dot(l, own.normal, three(v.to_array(), |x| l.splat(x))), by);
        Self {
            normal: three(own.normal, |n| l.mul(n, l.splat(params.normal_factor))),
            normal_factor: l.splat(params.normal_factor),
            cosine,
            across: change(view.right),
            along: change(view.down),
            distance: l.select(l.lt(zero, own.inverse_depth), l.div(cosine, own.inverse_depth), zero),
        }
    }

    /// Returns what is left of `open` for taps; `across` and `along` are the changes of the tangent
    /// plane times the distance in taps.
    #[inline(always)]
    pub(super) fn remaining(&self, l: L, open: L::F, taps: &Taps<L>, across: L::F, along: L::F) -> L::F {
        let turned = l.max(l.sub(self.normal_factor, dot(l, self.normal, taps.normal)), l.splat(0.0));
        let plane = l.add(l.add(self.cosine, across), along);
        let off = l.sub(plane, l.mul(self.distance, taps.inverse_depth));
        l.sub(l.sub(open, turned), l.mul(off, off))
    }
}
