//! Filters of the denoiser for the host: eight pixels of a row at a time, by instruction set.

use super::{Arguments, Kernel, NativeEntryPoint, Written, load, store};
use core::ops::Range;
use std::cell::RefCell;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{
    self, DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel, NeighbourhoodRow, NeighbourhoodStats,
    Reprojection, atrous_rows, level_numbers, neighbourhood_numbers,
};
use trisect_shared::display::{self, DisplayParams};
use trisect_shared::film::PixelSums;
#[cfg(target_arch = "x86_64")]
use trisect_shared::simd::{Avx2, Avx512};
use trisect_shared::simd::{Portable, Simd};

thread_local! {
    /// Planes of the taps of a span, kept from span to span.
    static PLANES: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
}

/// Calls `f` with planes of this many numbers.
#[inline(always)]
fn with_planes<T>(numbers: usize, f: impl FnOnce(&mut [f32]) -> T) -> T {
    PLANES.with_borrow_mut(|planes| {
        if planes.len() < numbers {
            planes.resize(numbers, 0.0);
        }
        f(planes)
    })
}

/// Writes the pixels that threads `x` of row `row` of a level write.
///
/// # Safety
///
/// As [`Kernel`].
#[inline(always)]
unsafe fn level<const BY_VARIANCE: bool, L: Simd>(l: L, of: &Arguments<'_>, x: Range<u32>, row: u32) {
    // SAFETY: the caller's promise.
    let (params, from, edges) =
        unsafe { (of.params::<DenoiseParams>(), of.read::<FilteredPixel>(2), of.read::<GBufferTexel>(4)) };
    // SAFETY: the caller's promise.
    let to: Written<'_, FilteredPixel> = unsafe { of.written(3) };
    let span = x.start..x.end.min(params.width);
    with_planes(level_numbers(&params, &span), |planes| {
        let row = params.first_row + row;
        // SAFETY: the pixel is inside the image, and of this thread.
        let write = |index, pixel| unsafe { store(&to, index, pixel) };
        atrous_rows::<BY_VARIANCE, L>(l, &params, from, edges, span, row, planes, write);
    });
}

/// Estimates the variance of pixels with few samples.
///
/// # Safety
///
/// As [`Kernel`].
#[inline(always)]
unsafe fn estimate<L: Simd>(l: L, of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise; the guards keep the pixels inside the image.
    unsafe {
        let params = of.params::<DenoiseParams>();
        let (y, span) = (params.first_row + y, x.start..x.end.min(params.width));
        if y >= params.height {
            return;
        }
        let (sums, from) = (of.read::<PixelSums>(0), of.read::<FilteredPixel>(2));
        let (to, edges) = (of.written::<FilteredPixel>(3), of.read::<GBufferTexel>(4));
        with_planes(neighbourhood_numbers(&span), |planes| {
            let mut shown = NeighbourhoodRow::new(l, &params, from, edges, span.clone(), y, planes);
            for x in span {
                let pixel = y * params.width + x;
                let samples = load(sums, pixel).samples;
                let middle = load(from, pixel);
                let variance = match denoise::has_variance(&params, middle, samples) {
                    true => middle.variance,
                    false => shown.stats(x).total_variance(),
                };
                store(&to, pixel, FilteredPixel { variance, ..middle });
            }
        });
    }
}

/// Combines pixels with the history of their surface.
///
/// # Safety
///
/// As [`Kernel`].
#[inline(always)]
unsafe fn reproject<L: Simd>(l: L, of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise; the guards keep the pixels inside the image.
    unsafe {
        let params = of.params::<DenoiseParams>();
        let (y, span) = (params.first_row + y, x.start..x.end.min(params.width));
        if y >= params.height {
            return;
        }
        let (sums, aovs, from) =
            (of.read::<PixelSums>(0), of.read::<AovSums>(1), of.read::<FilteredPixel>(2));
        let (edges, past) = (of.read::<GBufferTexel>(3), of.read::<HistoryPixel>(4));
        let (to, next) = (of.written::<FilteredPixel>(5), of.written::<HistoryPixel>(6));
        with_planes(neighbourhood_numbers(&span), |planes| {
            let mut shown = NeighbourhoodRow::new(l, &params, from, edges, span.clone(), y, planes);
            for x in span {
                let pixel = y * params.width + x;
                let (samples, aovs) = (load(sums, pixel).samples, load(aovs, pixel));
                let (middle, edge) = (load(from, pixel), load(edges, pixel));
                let found = Reprojection::new(&params, middle, edge, past, samples, aovs, x, y);
                let stats = match found.needs_neighbourhood() {
                    true => shown.stats(x),
                    false => NeighbourhoodStats::NONE,
                };
                let (lit, history) = found.combine(&params, stats);
                store(&to, pixel, lit);
                store(&next, pixel, history);
            }
        });
    }
}

/// Writes pixels for a screen.
///
/// # Safety
///
/// As [`Kernel`].
#[inline(always)]
unsafe fn display<L: Simd>(_: L, of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise; the guards keep the pixels inside the image.
    unsafe {
        let params = of.params::<DisplayParams>();
        let (y, span) = (params.first_row + y, x.start..x.end.min(params.width));
        if y >= params.height {
            return;
        }
        let (sums, lit) = (of.read::<PixelSums>(0), of.read::<FilteredPixel>(1));
        let to = of.written::<u32>(2);
        display::display_rows(&params, sums, lit, span, y, |pixel, shown| store(&to, pixel, shown));
    }
}

/// Defines an entry point: a filter for the baseline, AVX2 and AVX-512.
macro_rules! entry_point {
    ($name:literal, $filter:ident $(, $by_variance:literal)?) => {{
        unsafe fn baseline(of: &Arguments<'_>, x: Range<u32>, y: u32) {
            // SAFETY: the caller's promise.
            unsafe { $filter::<$($by_variance,)? Portable>(Portable, of, x, y) }
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        unsafe fn avx2(of: &Arguments<'_>, x: Range<u32>, y: u32) {
            // SAFETY: the caller's promise.
            unsafe { $filter::<$($by_variance,)? Avx2>(Avx2::assume(), of, x, y) }
        }
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
        unsafe fn avx512(of: &Arguments<'_>, x: Range<u32>, y: u32) {
            // SAFETY: the caller's promise.
            unsafe { $filter::<$($by_variance,)? Avx512>(Avx512::assume(), of, x, y) }
        }
        NativeEntryPoint {
            name: $name,
            possible: 0,
            baseline: baseline as Kernel,
            #[cfg(target_arch = "x86_64")]
            avx2: Some(avx2),
            #[cfg(target_arch = "x86_64")]
            avx512: Some(avx512),
            #[cfg(not(target_arch = "x86_64"))]
            avx2: None,
            #[cfg(not(target_arch = "x86_64"))]
            avx512: None,
        }
    }};
}

/// Filters that read neighbours, and the conversion for a screen. They stand before the passes of
/// the same names for one pixel.
pub(super) const ROWS: &[NativeEntryPoint] = &[
    entry_point!("denoise_atrous", level, false),
    entry_point!("denoise_svgf", level, true),
    entry_point!("denoise_estimate", estimate),
    entry_point!("denoise_reproject", reproject),
    entry_point!("display", display),
];

/// Returns whether an entry point runs by rows, of which a task should have many pixels.
pub fn is_by_rows(entry_point: &str) -> bool {
    ROWS.iter().any(|of| of.name == entry_point)
}
