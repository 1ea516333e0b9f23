//! Mean and variance of neighbourhoods, with the bits of
//! [`neighbourhood_stats`](super::super::variance::neighbourhood_stats).

use super::super::variance::{NEIGHBOURHOOD_RADIUS, NeighbourhoodStats};
use super::super::{DenoiseParams, FilteredPixel, GBufferTexel};
use super::planes::{LaneStops, Layout, Planes};
use crate::simd::{LANES, Simd, three};
use core::ops::Range;
use glam::Vec3;

const RADIUS: u32 = NEIGHBOURHOOD_RADIUS as u32;

/// Rows of taps.
const TAP_ROWS: usize = 2 * RADIUS as usize + 1;

fn layout(span: &Range<u32>) -> Layout {
    Layout::new(span, RADIUS, TAP_ROWS)
}

/// Returns how many numbers [`NeighbourhoodRow`] needs for a span of pixels.
pub fn neighbourhood_numbers(span: &Range<u32>) -> usize {
    layout(span).numbers()
}

/// Neighbourhoods of the pixels of a span, computed eight at a time when one of them is asked for.
pub struct NeighbourhoodRow<'a, L: Simd> {
    planes: Planes<'a, L>,
    span: Range<u32>,
    y: u32,
    /// True if the rows of taps are planes.
    is_filled: bool,
    /// First pixel of the eight that `eight` holds.
    first: Option<u32>,
    eight: [NeighbourhoodStats; LANES],
}

impl<'a, L: Simd> NeighbourhoodRow<'a, L> {
    /// Creates the neighbourhoods of the columns `span` of row `y`.
    ///
    /// # Panics
    ///
    /// If `numbers` is shorter than [`neighbourhood_numbers`], or a slice than the image has
    /// pixels.
    #[inline(always)]
    pub fn new(
        l: L,
        params: &'a DenoiseParams,
        from: &'a [FilteredPixel],
        edges: &'a [GBufferTexel],
        span: Range<u32>,
        y: u32,
        numbers: &'a mut [f32],
    ) -> Self {
        let planes = Planes::new(l, params, from, edges, layout(&span), numbers);
        let eight = [NeighbourhoodStats::NONE; LANES];
        Self { planes, span, y, is_filled: false, first: None, eight }
    }

    /// Returns mean and variance around the pixel in column `x` of the span.
    #[inline(always)]
    pub fn stats(&mut self, x: u32) -> NeighbourhoodStats {
        let lane = (x - self.span.start) % LANES as u32;
        if self.first != Some(x - lane) {
            if !self.is_filled {
                for row in 0..TAP_ROWS {
                    self.planes.fill_taps(row, i64::from(self.y) + row as i64 - i64::from(RADIUS));
                }
                self.is_filled = true;
            }
            self.first = Some(x - lane);
            self.eight = self.eight_from(x - lane);
        }
        self.eight[lane as usize]
    }

    #[inline(always)]
    fn eight_from(&self, x: u32) -> [NeighbourhoodStats; LANES] {
        let (planes, l) = (&self.planes, self.planes.l);
        let (zero, radius) = (l.splat(0.0), RADIUS as usize);
        let column = radius + (x - self.span.start) as usize;
        let middle = planes.taps(radius, column);
        let stops = LaneStops::new(l, planes.params, &middle, x, self.y, 1.0);
        let mut sum = middle.color;
        let mut squares = three(middle.color, |c| l.mul(c, c));
        let mut total = l.splat(1.0);
        for j in 0..TAP_ROWS {
            let along = l.mul(stops.along, l.splat(j as f32 - RADIUS as f32));
            for i in (0..TAP_ROWS).filter(|&i| (i, j) != (radius, radius)) {
                let column = column - radius + i;
                let (taps, open) = (planes.taps(j, column), planes.open(j, column));
                let across = l.mul(stops.across, l.splat(i as f32 - RADIUS as f32));
                let root = l.max(stops.remaining(l, open, &taps, across, along), zero);
                let weight = l.mul(root, root);
                let counts = l.lt(zero, weight);
                for c in 0..3 {
                    let color = l.select(counts, taps.color[c], zero);
                    sum[c] = l.add(sum[c], l.mul(color, weight));
                    squares[c] = l.add(squares[c], l.mul(l.mul(color, color), weight));
                }
                total = l.add(total, weight);
            }
        }
        let mean = three(sum, |sum| l.div(sum, total));
        let variance =
            three([0, 1, 2], |c| l.store(l.sub(l.div(squares[c], total), l.mul(mean[c], mean[c]))).0);
        let mean = three(mean, |mean| l.store(mean).0);
        let vector = |of: &[[f32; LANES]; 3], lane: usize| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
        core::array::from_fn(|lane| NeighbourhoodStats {
            mean: vector(&mean, lane),
            variance: vector(&variance, lane),
        })
    }
}
