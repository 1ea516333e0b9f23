//! Passes over pixels for the host: those of the denoiser for one pixel, and the film's totals.

use super::{Arguments, Kernel, NativeEntryPoint, load, plain, store};
use core::ops::Range;
use trisect_shared::aovs::AovSums;
use trisect_shared::denoise::{self, DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel};
use trisect_shared::film::PixelSums;
use trisect_shared::totals::{self, TotalsParams};

/// Defines the kernel of a pass: `$body` gets the parameters, the arrays and the thread.
macro_rules! kernel {
    ($record:ty: |$params:ident, $arrays:ident, $x:ident, $y:ident| $body:block) => {{
        unsafe fn run($arrays: &Arguments<'_>, x: Range<u32>, y: u32) {
            // SAFETY: the caller's promise; guards keep the pixels inside the image.
            unsafe {
                let $params = &$arrays.params::<$record>();
                let $y = $params.first_row + y;
                for $x in x.start..x.end.min($params.width) {
                    $body
                }
            }
        }
        run as Kernel
    }};
}

/// Defines the kernel of a pass of the denoiser.
macro_rules! pass {
    (|$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $y:ident| $body:block) => {
        kernel!(DenoiseParams: |$params, arrays, $x, $y| {
            #[allow(unused_variables, reason = "all passes have the same arrays")]
            let ($sums, $aovs, $from, $to, $edges) = (
                arrays.read::<PixelSums>(0),
                arrays.read::<AovSums>(1),
                arrays.read::<FilteredPixel>(2),
                &arrays.written::<FilteredPixel>(3),
                &arrays.written::<GBufferTexel>(4),
            );
            $body
        })
    };
}

macro_rules! passes {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $y:ident, $pixel:ident| $body:block,)*) => {
        &[$(plain($text, pass!(|$params, $sums, $aovs, $from, $to, $edges, $x, $y| {
            if $y < $params.height {
                let $pixel = $y * $params.width + $x;
                $body
            }
        })),)*]
    };
}

pub(super) const PASSES: &[NativeEntryPoint] = for_each_pass!(passes);

macro_rules! accumulations {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $kept:ident, $seen:ident, $to:ident, $edges:ident, $pixel:ident| $body:block,)*) => {
        &[$(plain($text, kernel!(DenoiseParams: |$params, arrays, x, y| {
            let ($sums, $aovs) = (arrays.read::<PixelSums>(0), arrays.read::<AovSums>(1));
            let ($kept, $seen, $to, $edges) = (
                &arrays.written::<PixelSums>(2),
                &arrays.written::<AovSums>(3),
                &arrays.written::<FilteredPixel>(4),
                &arrays.written::<GBufferTexel>(5),
            );
            if y < $params.height {
                let $pixel = y * $params.width + x;
                $body
            }
        })),)*]
    };
}

pub(super) const ACCUMULATIONS: &[NativeEntryPoint] = for_each_accumulation!(accumulations);

macro_rules! temporal {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $edges:ident, $past:ident, $to:ident, $next:ident, $x:ident, $y:ident, $pixel:ident| $body:block,)*) => {
        &[$(plain($text, kernel!(DenoiseParams: |$params, arrays, $x, y| {
            #[allow(unused_variables, reason = "all passes have the same arrays")]
            let ($sums, $aovs, $from, $edges, $past) = (
                arrays.read::<PixelSums>(0),
                arrays.read::<AovSums>(1),
                arrays.read::<FilteredPixel>(2),
                arrays.read::<GBufferTexel>(3),
                arrays.read::<HistoryPixel>(4),
            );
            #[allow(unused_variables, reason = "all passes have the same arrays")]
            let ($to, $next) =
                (&arrays.written::<FilteredPixel>(5), &arrays.written::<HistoryPixel>(6));
            if y < $params.height {
                #[allow(unused_variables, reason = "all passes have the same arguments")]
                let ($y, $pixel) = (y, y * $params.width + $x);
                $body
            }
        })),)*]
    };
}

pub(super) const TEMPORAL: &[NativeEntryPoint] = for_each_temporal!(temporal);

macro_rules! totals {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $totals:ident, $output:ident, $x:ident, $y:ident| $body:block,)*) => {
        &[$(plain($text, {
            unsafe fn run(arrays: &Arguments<'_>, x: Range<u32>, y: u32) {
                // SAFETY: the caller's promise; the guard keeps the threads inside the launch.
                unsafe {
                    let $params = &arrays.params::<TotalsParams>();
                    if y >= $params.rows {
                        return;
                    }
                    #[allow(unused_variables, reason = "all these kernels have the same arrays")]
                    let ($sums, $aovs, $totals, $output, $y) = (
                        &mut arrays.written::<PixelSums>(0).shared(),
                        &mut arrays.written::<AovSums>(1).shared(),
                        &mut arrays.written::<u32>(2).shared(),
                        &mut arrays.written::<u32>(3).shared(),
                        y,
                    );
                    for $x in x.start..x.end.min($params.width) {
                        $body
                    }
                }
            }
            run as Kernel
        }),)*]
    };
}

pub(super) const TOTALS: &[NativeEntryPoint] = for_each_total!(totals);
