//! One level of the à-trous wavelet transform.

use super::edge_stopping::{EdgeStopping, OPEN, SHUT, biweight, bounded_factor};
use super::variance::smoothed_variance;
use super::{DenoiseParams, FilteredPixel, GBufferTexel, STOP_FACTORS};
use crate::buffer::{load, store};
use crate::buffer_layout::Packed;
use glam::Vec3;

/// Smaller than the variance of any image; added to avoid a division by 0 (SVGF adds its root to
/// the deviation).
pub(super) const MIN_VARIANCE: f32 = 1e-10;

/// Coefficients of the B3 spline at 0, 1 and 2.
pub(super) const B3: [f32; 3] = [0.375, 0.25, 0.0625];

/// Number of pixels that a thread of a device computes, in one column of the level's lattice: they
/// share most of their taps. Four would share more, but need too many registers
/// (docs/notebook/denoising.md).
pub const PIXELS_PER_THREAD: u32 = 2;

/// A pixel and the sums over its taps.
struct TapSums {
    middle: FilteredPixel,
    stops: EdgeStopping,
    /// Factor of the squared distance of colours.
    color_factor: f32,
    /// Sum of weights times differences from the middle, so that a constant image keeps its bits.
    difference: Vec3,
    /// Sum of squared weights times variances.
    variance: f32,
    /// Sum of the weights.
    weight: f32,
}

impl TapSums {
    /// Creates the sums of pixel (`x`, `y`), with its own weight only.
    ///
    /// # Safety
    ///
    /// As [`atrous_level`].
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn new<const BY_VARIANCE: bool>(
        params: &DenoiseParams,
        from: &[Packed<FilteredPixel>],
        edges: &[Packed<GBufferTexel>],
        x: u32,
        y: u32,
    ) -> Self {
        let pixel = y * params.width + x;
        // SAFETY: the caller's promise.
        let (middle, edge) =
            unsafe { (load::<FilteredPixel>(from, pixel), load::<GBufferTexel>(edges, pixel)) };
        let mut color = params.color_factor;
        if const { BY_VARIANCE } {
            // SAFETY: the caller's promise.
            let variance = unsafe { smoothed_variance(params, from, x, y) };
            color = bounded_factor(color / (variance + MIN_VARIANCE));
        }
        let known = middle.is_known();
        if !known {
            color = STOP_FACTORS.0;
        }
        let own = if known { B3[0] * B3[0] } else { 0.0 };
        Self {
            middle,
            stops: EdgeStopping::new(params, edge, x, y, params.step as f32),
            color_factor: color,
            difference: Vec3::ZERO,
            variance: own * own * middle.variance,
            weight: own,
        }
    }

    /// Adds the tap `J` rows down in a column of taps, unless it is the middle, which is there
    /// already.
    #[inline(always)]
    fn add<const BY_VARIANCE: bool, const J: i32>(&mut self, column: &Column, tap: Tap) {
        let difference = tap.lit.color - self.middle.color;
        let open = if const { J == 0 } && column.is_middle { SHUT } else { tap.open };
        let left = self.stops.remaining(open, tap.edge, column.offset, J as f32);
        let kernel = column.kernel[const { J.unsigned_abs() as usize }];
        let weight = kernel * biweight(left - difference.dot(difference) * self.color_factor);
        self.difference += difference * weight;
        self.weight += weight;
        if const { BY_VARIANCE } {
            self.variance += weight * weight * tap.lit.variance;
        }
    }

    /// Returns the pixel of the next level.
    #[inline(always)]
    fn mean<const BY_VARIANCE: bool>(&self) -> FilteredPixel {
        if self.weight <= 0.0 {
            return FilteredPixel::UNKNOWN;
        }
        let by = 1.0 / self.weight;
        let variance = if const { BY_VARIANCE } { self.variance * (by * by) } else { 0.0 };
        FilteredPixel { color: self.middle.color + self.difference * by, variance }
    }
}

/// Column of taps.
struct Column {
    /// Distance from the middle in taps, to the right.
    offset: f32,
    is_middle: bool,
    /// Weights by the B3 spline at 0, 1 and 2 taps down.
    kernel: [f32; 3],
    /// Column of pixels, and whether it lies inside the image.
    x: (u32, bool),
}

impl Column {
    /// Creates the column `i` taps to the right of `x`.
    #[inline(always)]
    fn new(params: &DenoiseParams, x: u32, i: i32) -> Self {
        let of_middle = i == 0;
        let b3 = if of_middle {
            B3[0]
        } else if i * i == 1 {
            B3[1]
        } else {
            B3[2]
        };
        Self {
            offset: i as f32,
            is_middle: of_middle,
            kernel: [b3 * B3[0], b3 * B3[1], b3 * B3[2]],
            x: clamp_to_image(tap_coordinate(x, i, params.step), params.width, x),
        }
    }
}

/// A neighbour.
#[derive(Clone, Copy)]
struct Tap {
    lit: FilteredPixel,
    edge: GBufferTexel,
    /// Initial weight: [`OPEN`] or [`SHUT`].
    open: f32,
}

/// Returns the coordinate `taps` taps away; below 0 it wraps to a number that no image has.
#[inline(always)]
fn tap_coordinate(coordinate: u32, taps: i32, step: u32) -> u32 {
    coordinate.wrapping_add((taps * step as i32) as u32)
}

/// Returns a tap's coordinate and whether it lies inside the image; if not, `other`, which does.
#[inline(always)]
fn clamp_to_image(coordinate: u32, end: u32, other: u32) -> (u32, bool) {
    let inside = coordinate < end;
    (if inside { coordinate } else { other }, inside)
}

/// Returns the tap at pixel (`x`, `y`); each coordinate comes with whether the tap itself lies
/// inside the image. It has no branches, which would keep lanes apart and delay the sums.
///
/// # Safety
///
/// The pixel lies inside the image, and each slice has a record for each pixel.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn tap(
    width: u32,
    from: &[Packed<FilteredPixel>],
    edges: &[Packed<GBufferTexel>],
    (x, inside): (u32, bool),
    (y, below): (u32, bool),
) -> Tap {
    let pixel = y * width + x;
    // SAFETY: the caller's promise.
    let (lit, edge) = unsafe { (load::<FilteredPixel>(from, pixel), load::<GBufferTexel>(edges, pixel)) };
    Tap { lit, edge, open: if inside & below & lit.is_known() { OPEN } else { SHUT } }
}

/// Returns pixel (`x`, `y`) of the next level. With `BY_VARIANCE`, edge stopping by colour is
/// relative to the variance around the pixel.
///
/// A pixel without a colour gets the mean of its neighbours, and contributes to none.
///
/// # Safety
///
/// The pixel lies inside the image, and each slice has a record for each pixel.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn atrous_level<const BY_VARIANCE: bool>(
    params: &DenoiseParams,
    from: &[Packed<FilteredPixel>],
    edges: &[Packed<GBufferTexel>],
    x: u32,
    y: u32,
) -> FilteredPixel {
    // SAFETY: the caller's promise.
    let mut sums = unsafe { TapSums::new::<BY_VARIANCE>(params, from, edges, x, y) };
    // Column by column: all taps at once would take more registers than there are.
    let mut i = -2;
    while i <= 2 {
        let column = Column::new(params, x, i);
        macro_rules! rows {
            ($($j:literal)*) => {$(
                let down = clamp_to_image(tap_coordinate(y, $j, params.step), params.height, y);
                // SAFETY: the caller's promise; `clamp_to_image` keeps the tap inside the image.
                let one = unsafe { tap(params.width, from, edges, column.x, down) };
                sums.add::<BY_VARIANCE, $j>(&column, one);
            )*};
        }
        rows!(-2 -1 0 1 2);
        i += 1;
    }
    sums.mean::<BY_VARIANCE>()
}

/// Writes a set of [`PIXELS_PER_THREAD`] pixels of the next level to `to`: set number `row` of
/// column `x`, of pixels `params.step` rows apart. The bits are those of [`atrous_level`].
///
/// # Safety
///
/// The column lies inside the image, and each slice has a record for each pixel.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn atrous_levels<const BY_VARIANCE: bool>(
    params: &DenoiseParams,
    from: &[Packed<FilteredPixel>],
    edges: &[Packed<GBufferTexel>],
    to: &mut [Packed<FilteredPixel>],
    x: u32,
    row: u32,
) {
    let step = params.step.max(1); // no division by 0, which would be a panic
    let y = row / step * (PIXELS_PER_THREAD * step) + row % step;
    if y >= params.height {
        return;
    }
    // Rows beyond the image are computed as its last row, and not written.
    let last = params.height - 1;
    macro_rules! of {
        ($k:literal) => {{
            let y = y + $k * step;
            // SAFETY: the row lies inside the image.
            unsafe { TapSums::new::<BY_VARIANCE>(params, from, edges, x, if y < last { y } else { last }) }
        }};
    }
    let (mut a, mut b) = (of!(0), of!(1));
    let mut i = -2;
    while i <= 2 {
        let column = Column::new(params, x, i);
        macro_rules! rows {
            ($($r:literal: $($sums:ident $j:literal),*;)*) => {$(
                let down = clamp_to_image(tap_coordinate(y, $r, step), params.height, y);
                // SAFETY: the caller's promise; `clamp_to_image` keeps the tap inside the image.
                let one = unsafe { tap(params.width, from, edges, column.x, down) };
                $($sums.add::<BY_VARIANCE, $j>(&column, one);)*
            )*};
        }
        rows! {
            -2: a -2;
            -1: a -1, b -2;
            0: a 0, b -1;
            1: a 1, b 0;
            2: a 2, b 1;
            3: b 2;
        }
        i += 1;
    }
    macro_rules! write {
        ($($k:literal $sums:ident),*) => {$(
            if y + $k * step < params.height {
                // SAFETY: the pixel lies inside the image.
                unsafe { store(to, (y + $k * step) * params.width + x, $sums.mean::<BY_VARIANCE>()) };
            }
        )*};
    }
    write!(0 a, 1 b);
}
