//! Entry points of the GPU kernels: each unpacks its bindings, guards its index and calls the
//! shared crate.
//!
//! Compiled for a device, this crate is the entry points in `spirv` or `ptx`. Compiled for the
//! host, it has the result, the prebuilt artifacts and their names, from which GPUs take kernels,
//! and in `native` the entry points for the CPU. All come from the same lists, such as
//! `for_each_render`. The features of a render kernel are a constant of its module, which the host
//! sets (`specialise`).
//!
//! # Bindings of render kernels
//!
//! | binding | SPIR-V, set 0 | PTX argument | content |
//! |---|---|---|---|
//! | 0 | uniform | by value | [`RenderParams`], in SPIR-V in a [`SceneLaunch`] |
//! | 1 to 5 | storage, read | [`SceneLengths`] by value, ten pointers | arrays of a [`Scene`] |
//! | 6 | storage | pointer | `[PixelSums]`, or `[FirstHit]` of `first_hit`; the whole image |
//! | 7 | storage | pointer | `[Compensation]`, the whole image; for parts of a chunk |
//! | 8 | storage | pointer | `[AovSums]`, the whole image; only used by kernels with `AOVS` |
//! | 9 | storage | pointer | counter of persistent threads only, 0 when a launch begins |
//!
//! PTX takes the counter before the AOV sums.
//!
//! A thread serves pixel (x, y) of the launch's share of the rows, in work groups of 8 × 8.
//! Persistent threads serve the pixels that they take from the counter, in any number of work
//! groups. All kernels are listed in `docs/reference/kernels.md`.
//!
//! [`RenderParams`]: trisect_shared::params::RenderParams
//! [`Scene`]: trisect_shared::scene::Scene
//! [`SceneLaunch`]: trisect_shared::scene::SceneLaunch
//! [`SceneLengths`]: trisect_shared::scene::SceneLengths
#![cfg_attr(any(target_arch = "spirv", target_arch = "nvptx64"), no_std)]
#![cfg_attr(target_arch = "nvptx64", feature(abi_ptx, asm_experimental_arch, stdarch_nvptx))]

/// Calls a macro with each render kernel: entry point, its name (attributes take literals only),
/// whether its lanes take their pixels from a queue, the features that it can have, and those that
/// it always has.
#[macro_export]
macro_rules! for_each_render {
    ($render:ident) => {
        $render! {
            render "render": false, OF_GPUS_WITHOUT_RARE, 0,
            render_persistent "render_persistent": true, OF_GPUS_WITHOUT_RARE, 0,
            render_general "render_general": false, OF_GPUS, 0,
            render_general_persistent "render_general_persistent": true, OF_GPUS, 0,
        }
    };
}

/// Calls a macro with each render kernel that CUDA has in place of another for scenes of the book,
/// as [`for_each_render!`] does. What LLVM knows of the features makes them one to three percent
/// faster than what the driver removes (docs/notebook/specialisation.md); on Vulkan it does not.
#[macro_export]
macro_rules! for_each_book_render {
    ($render:ident) => {
        $render! {
            render_book "render_book": false, OF_BOOK, REGENERATE,
            render_book_persistent "render_book_persistent": true, OF_BOOK, REGENERATE,
        }
    };
}

/// Calls a macro with each pass of the denoiser: entry point, its name, and its code for one pixel.
/// A thread serves pixel (x, y).
///
/// | binding | SPIR-V | PTX | content |
/// |---|---|---|---|
/// | 0 | uniform | by value | [`DenoiseParams`](trisect_shared::denoise::DenoiseParams) |
/// | 1 | storage | pointer | `[PixelSums]` |
/// | 2 | storage | pointer | `[AovSums]` |
/// | 3 | storage | pointer | `[FilteredPixel]`, read |
/// | 4 | storage | pointer | `[FilteredPixel]`, written |
/// | 5 | storage | pointer | `[GBufferTexel]` |
#[macro_export]
macro_rules! for_each_pass {
    ($pass:ident) => {
        $pass! {
            denoise_gather "denoise_gather": |params, sums, aovs, from, to, edges, x, y, pixel| {
                let (lit, edge) = denoise::demodulate(params, load::<PixelSums>(sums, pixel), load::<AovSums>(aovs, pixel));
                store(to, pixel, lit);
                store(edges, pixel, edge);
            },
            denoise_estimate "denoise_estimate": |params, sums, aovs, from, to, edges, x, y, pixel| {
                let samples = load::<PixelSums>(sums, pixel).samples;
                store(to, pixel, denoise::estimate_variance(params, from, edges, samples, x, y));
            },
            denoise_finish "denoise_finish": |params, sums, aovs, from, to, edges, x, y, pixel| {
                store(to, pixel, denoise::remodulate(load::<FilteredPixel>(from, pixel), load::<AovSums>(aovs, pixel)));
            },
        }
    };
}

/// Calls a macro with each level of the filter: entry point, its name, and its code for one thread.
/// The bindings are those of [`for_each_pass!`]. A thread serves
/// [`PIXELS_PER_THREAD`](trisect_shared::denoise::PIXELS_PER_THREAD) pixels of column x; y is the
/// number of their set.
#[macro_export]
macro_rules! for_each_level {
    ($level:ident) => {
        $level! {
            denoise_atrous "denoise_atrous": |params, sums, aovs, from, to, edges, x, row| {
                denoise::atrous_levels::<false>(params, from, edges, to, x, row);
            },
            denoise_svgf "denoise_svgf": |params, sums, aovs, from, to, edges, x, row| {
                denoise::atrous_levels::<true>(params, from, edges, to, x, row);
            },
        }
    };
}

/// Calls a macro with the pass that sums frames: entry point, its name, and its code for one pixel.
/// A thread serves pixel (x, y).
///
/// | binding | SPIR-V | PTX | content |
/// |---|---|---|---|
/// | 0 | uniform | by value | [`DenoiseParams`](trisect_shared::denoise::DenoiseParams) |
/// | 1 | storage | pointer | `[PixelSums]` |
/// | 2 | storage | pointer | `[AovSums]` |
/// | 3 | storage | pointer | `[PixelSums]`, of all frames since the camera came to rest |
/// | 4 | storage | pointer | `[AovSums]`, of all frames since the camera came to rest |
/// | 5 | storage | pointer | `[FilteredPixel]`, written |
/// | 6 | storage | pointer | `[GBufferTexel]`, written |
#[macro_export]
macro_rules! for_each_accumulation {
    ($pass:ident) => {
        $pass! {
            denoise_add "denoise_add": |params, sums, aovs, kept, seen, to, edges, pixel| {
                let before = (load::<PixelSums>(kept, pixel), load::<AovSums>(seen, pixel));
                let all = denoise::accumulate(params, load::<PixelSums>(sums, pixel), load::<AovSums>(aovs, pixel), before);
                store(kept, pixel, all.0);
                store(seen, pixel, all.1);
                let found = denoise::demodulate(params, all.0, all.1);
                store(to, pixel, found.0);
                store(edges, pixel, found.1);
            },
        }
    };
}

/// Calls a macro with each pass over the history: entry point, its name, and its code for one
/// pixel. A thread serves pixel (x, y).
///
/// | binding | SPIR-V | PTX | content |
/// |---|---|---|---|
/// | 0 | uniform | by value | [`DenoiseParams`](trisect_shared::denoise::DenoiseParams) |
/// | 1 | storage | pointer | `[PixelSums]` |
/// | 2 | storage | pointer | `[AovSums]` |
/// | 3 | storage | pointer | `[FilteredPixel]`, read |
/// | 4 | storage | pointer | `[GBufferTexel]`, read |
/// | 5 | storage | pointer | `[HistoryPixel]`, read |
/// | 6 | storage | pointer | `[FilteredPixel]`, written |
/// | 7 | storage | pointer | `[HistoryPixel]`, written |
#[macro_export]
macro_rules! for_each_temporal {
    ($pass:ident) => {
        $pass! {
            denoise_reproject "denoise_reproject": |params, sums, aovs, from, edges, past, to, next, x, y, pixel| {
                let samples = load::<PixelSums>(sums, pixel).samples;
                let found = denoise::reproject(params, from, edges, past, samples, load::<AovSums>(aovs, pixel), x, y);
                store(to, pixel, found.0);
                store(next, pixel, found.1);
            },
        }
    };
}

/// Calls a macro with the entry point that makes an image for a screen: entry point, its name, and
/// its code for one pixel. A thread serves pixel (x, y).
///
/// | binding | SPIR-V | PTX | content |
/// |---|---|---|---|
/// | 0 | uniform | by value | [`DisplayParams`](trisect_shared::display::DisplayParams) |
/// | 1 | storage | pointer | `[PixelSums]` |
/// | 2 | storage | pointer | `[FilteredPixel]` |
/// | 3 | storage | pointer | `[u32]`, written |
#[macro_export]
macro_rules! for_each_display {
    ($pass:ident) => {
        $pass! {
            display "display": |params, sums, lit, to, x, pixel| {
                let shown = display::display(params, load::<PixelSums>(sums, pixel), load::<FilteredPixel>(lit, pixel), x);
                store(to, pixel, shown);
            },
        }
    };
}

/// Calls a macro with each kernel of the film's totals: entry point, its name, and its code for one
/// thread (x, y), where y is a row of the launch.
///
/// | binding | SPIR-V | PTX | content |
/// |---|---|---|---|
/// | 0 | uniform | by value | [`TotalsParams`](trisect_shared::totals::TotalsParams) |
/// | 1 | storage | pointer | `[PixelSums]` of a chunk, or of two halves |
/// | 2 | storage | pointer | `[AovSums]` of a chunk |
/// | 3 | storage | pointer | `[u32]`, totals, or AOV totals |
/// | 4 | storage | pointer | `[u32]`, what the host reads; or numbers of samples, by tile |
#[macro_export]
macro_rules! for_each_total {
    ($total:ident) => {
        $total! {
            film_add "film_add": |params, sums, aovs, totals, output, x, y| {
                totals::add_chunk(params, sums, aovs, totals, output, x, y);
            },
            film_read "film_read": |params, sums, aovs, totals, output, x, y| {
                totals::write_totals(params, totals, output, x, y);
            },
            film_request "film_request": |params, sums, aovs, totals, output, x, y| {
                totals::request_samples(params, sums, output, x, y);
            },
            film_sums "film_sums": |params, sums, aovs, totals, output, x, y| {
                totals::write_sums(params, totals, sums, x, y);
            },
            film_noise "film_noise": |params, sums, aovs, totals, output, x, y| {
                totals::write_noise(params, sums, output, x, y);
            },
            film_count "film_count": |params, sums, aovs, totals, output, x, y| {
                totals::count_chunk(params, sums, output, x, y);
            },
        }
    };
}

#[cfg(target_arch = "nvptx64")]
pub mod ptx;
#[cfg(target_arch = "spirv")]
pub mod spirv;

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod branch_free;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod fast_math;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod feature_names;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod native;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod prebuilt;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
mod ptx_text;
#[cfg(test)]
mod ptxas;
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub mod specialise;
#[cfg(all(feature = "wgsl", not(any(target_arch = "spirv", target_arch = "nvptx64"))))]
mod wgsl;
#[cfg(all(feature = "wgsl", not(any(target_arch = "spirv", target_arch = "nvptx64"))))]
pub use wgsl::wgsl;

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub use {fast_math::FAST_MATH, feature_names::*, prebuilt::*};
