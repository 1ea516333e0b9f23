//! Levels of the denoiser's filters for the host: eight pixels at a time, by instruction set.

use super::{Arguments, Kernel, NativeEntryPoint, Written, store};
use core::ops::Range;
use std::cell::RefCell;
use trisect_shared::denoise::{DenoiseParams, FilteredPixel, GBufferTexel, atrous_rows, row_numbers};
#[cfg(target_arch = "x86_64")]
use trisect_shared::simd::{Avx2, Avx512};
use trisect_shared::simd::{Portable, Simd};

thread_local! {
    /// Planes of the taps of a span, kept from span to span.
    static PLANES: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
}

/// Writes the pixels that threads `x` of row `row` of a level write.
///
/// # Safety
///
/// As [`Kernel`].
#[inline(always)]
unsafe fn level<const BY_VARIANCE: bool, L: Simd>(l: L, of: &Arguments<'_>, x: Range<u32>, row: u32) {
    // SAFETY: the caller's promise.
    let (params, from, to, edges) = unsafe {
        let to: Written<'_, FilteredPixel> = of.written(3);
        (of.params::<DenoiseParams>(), of.read::<FilteredPixel>(2), to, of.read::<GBufferTexel>(4))
    };
    let span = x.start..x.end.min(params.width);
    PLANES.with_borrow_mut(|planes| {
        let numbers = row_numbers(&params, &span);
        if planes.len() < numbers {
            planes.resize(numbers, 0.0);
        }
        atrous_rows::<BY_VARIANCE, L>(
            l,
            &params,
            from,
            edges,
            span,
            params.first_row + row,
            planes,
            // SAFETY: the pixel is inside the image, and of this thread.
            |index, pixel| unsafe { store(&to, index, pixel) },
        );
    });
}

/// [`level`] for the baseline.
///
/// # Safety
///
/// As [`Kernel`].
unsafe fn level_baseline<const BY_VARIANCE: bool>(of: &Arguments<'_>, x: Range<u32>, row: u32) {
    // SAFETY: the caller's promise.
    unsafe { level::<BY_VARIANCE, _>(Portable, of, x, row) }
}

/// [`level`] for AVX2.
///
/// # Safety
///
/// As [`Kernel`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn level_avx2<const BY_VARIANCE: bool>(of: &Arguments<'_>, x: Range<u32>, row: u32) {
    // SAFETY: the caller's promise.
    unsafe { level::<BY_VARIANCE, _>(Avx2::assume(), of, x, row) }
}

/// [`level`] for AVX-512.
///
/// # Safety
///
/// As [`Kernel`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
unsafe fn level_avx512<const BY_VARIANCE: bool>(of: &Arguments<'_>, x: Range<u32>, row: u32) {
    // SAFETY: the caller's promise.
    unsafe { level::<BY_VARIANCE, _>(Avx512::assume(), of, x, row) }
}

/// Returns the kernels of a level.
const fn entry_point<const BY_VARIANCE: bool>(name: &'static str) -> NativeEntryPoint {
    NativeEntryPoint {
        name,
        possible: 0,
        baseline: level_baseline::<BY_VARIANCE> as Kernel,
        #[cfg(target_arch = "x86_64")]
        avx2: Some(level_avx2::<BY_VARIANCE>),
        #[cfg(target_arch = "x86_64")]
        avx512: Some(level_avx512::<BY_VARIANCE>),
        #[cfg(not(target_arch = "x86_64"))]
        avx2: None,
        #[cfg(not(target_arch = "x86_64"))]
        avx512: None,
    }
}

/// Levels with edge stopping by fixed factors, and by variance.
pub(super) const LEVELS: &[NativeEntryPoint] =
    &[entry_point::<false>("denoise_atrous"), entry_point::<true>("denoise_svgf")];
