//! Entry points for SPIR-V, compiled by rust-gpu.

use spirv_std::glam::{UVec3, UVec4};
use spirv_std::spirv;
use trisect_shared::aovs::AovSums;
use trisect_shared::buffer::{RecordSlice, load, store};
use trisect_shared::buffer_layout::Packed;
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::{self, DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel};
use trisect_shared::display::{self, DisplayParams};
use trisect_shared::features::{FeatureSet, OF_GPUS, OF_GPUS_WITHOUT_RARE};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::material::Material;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::scene::{Scene, SceneLaunch};
use trisect_shared::texture::Texel;
use trisect_shared::totals::{self, TotalsParams};

/// Defines a render entry point: `$body` gets the words of the features, the launch record, the
/// scene, the pixel, the output's buffer, the compensations, the counter and the AOV sums.
macro_rules! entry_point {
    ($(#[$doc:meta])* $name:ident $text:tt, $record:ty, $persistent:expr, |$low:ident, $high:ident, $params:ident, $scene:ident, $x:ident, $y:ident, $output:ident, $compensations:ident, $counter:ident, $aovs:ident| $body:block) => {
        $(#[$doc])*
        #[spirv(compute(threads(8, 8), entry_point_name = $text))]
        #[allow(clippy::too_many_arguments, reason = "one argument per binding")]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(spec_constant(id = 0, default = 0))] $low: u32,
            #[spirv(spec_constant(id = 1, default = 0))] $high: u32,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] launch: &SceneLaunch,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] nodes: &[Packed<BvhNode>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] mesh: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] texels: &[Packed<Texel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] materials: &[Packed<Material>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] others: &[UVec4],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 6)] $output: &mut [Packed<$record>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 7)] $compensations: &mut [Packed<Compensation>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 9)] $counter: &mut [u32],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 8)] $aovs: &mut [Packed<AovSums>],
        ) {
            let ($params, first) = (&launch.params, &launch.first_rows);
            // Persistent threads take their pixels from the counter.
            if !$persistent && (id.x >= $params.width || id.y >= $params.rows) {
                return;
            }
            let ($x, $y) = (id.x, $params.row(id.y));
            let $scene = Scene {
                spheres: RecordSlice::new(others, first.spheres),
                nodes,
                materials,
                planars: RecordSlice::new(others, 0),
                triangles: RecordSlice::new(mesh, 0),
                vertices: RecordSlice::new(mesh, first.vertices),
                lights: RecordSlice::new(others, first.lights),
                textures: RecordSlice::new(others, first.textures),
                texels,
                environment: RecordSlice::new(others, first.environment),
            };
            $body
        }
    };
}

macro_rules! render {
    ($($name:ident $text:tt: $persistent:expr, $possible:expr, $certain:expr,)*) => {$(
        entry_point! {
            /// Adds samples to each pixel's sums.
            $name $text, PixelSums, $persistent, |low, high, params, scene, x, y, film, compensations, counter, aovs| {
                const { assert!($certain == 0) }; // no module of SPIR-V always has a feature
                let features = FeatureSet::<{ $possible }>::of_words(low, high);
                // SAFETY: the guard, and the host's proof of the scene, and of film, compensations
                // and AOV sums of width * height pixels.
                #[allow(unsafe_code, reason = "see buffer")]
                unsafe {
                    if $persistent {
                        let (mut film, mut compensations, mut aovs, mut counter) = (film, compensations, aovs, counter);
                        path::render_persistent(features, params, scene, &mut film, &mut compensations, &mut aovs, &mut counter);
                    } else {
                        let slot = y * params.width + x;
                        let mut aovs = aovs;
                        path::render_pixel(features, params, scene, x, y, film, compensations, slot, &mut aovs);
                    }
                }
            }
        }
    )*};
}

for_each_render!(render);

entry_point! {
    /// Writes each pixel's first hit.
    first_hit "first_hit", FirstHit, false, |_low, _high, params, scene, x, y, hits, _compensations, _counter, _aovs| {
        // SAFETY: the guard, and the host's proof of the scene and its buffer of width * height
        // records.
        #[allow(unsafe_code, reason = "see buffer")]
        unsafe {
            let hit = path::first_hit(params, scene, x, y);
            store(hits, y * params.width + x, hit);
        }
    }
}

/// Defines a pass of the denoiser with work groups of `$threads`.
macro_rules! pass {
    ($threads:tt, $name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $y:ident| $body:block) => {
        /// Runs a pass of the denoiser.
        #[spirv(compute(threads $threads, entry_point_name = $text))]
        #[allow(
            clippy::too_many_arguments,
            unused_variables,
            unsafe_code,
            reason = "one argument per binding; see buffer"
        )]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] $params: &DenoiseParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] $sums: &[Packed<PixelSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] $aovs: &[Packed<AovSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] $from: &[Packed<FilteredPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] $to: &mut [Packed<FilteredPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] $edges: &mut [Packed<GBufferTexel>],
        ) {
            let ($x, $y) = (id.x, $params.first_row + id.y);
            if $x < $params.width {
                // SAFETY: the guards, and the host's buffers of width * height records.
                unsafe { $body }
            }
        }
    };
}

macro_rules! passes {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $y:ident, $pixel:ident| $body:block,)*) => {$(
        pass!((8, 8), $name $text: |$params, $sums, $aovs, $from, $to, $edges, $x, $y| {
            if $y < $params.height {
                let $pixel = $y * $params.width + $x;
                $body
            }
        });
    )*};
}

for_each_pass!(passes);

macro_rules! levels {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $row:ident| $body:block,)*) => {$(
        pass!((64, 1), $name $text: |$params, $sums, $aovs, $from, $to, $edges, $x, $row| $body);
    )*};
}

for_each_level!(levels);

/// Defines the pass that sums frames.
macro_rules! accumulations {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $kept:ident, $seen:ident, $to:ident, $edges:ident, $pixel:ident| $body:block,)*) => {$(
        /// Runs a pass that sums frames.
        #[spirv(compute(threads(8, 8), entry_point_name = $text))]
        #[allow(clippy::too_many_arguments, unsafe_code, reason = "one argument per binding; see buffer")]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] $params: &DenoiseParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] $sums: &[Packed<PixelSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] $aovs: &[Packed<AovSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] $kept: &mut [Packed<PixelSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] $seen: &mut [Packed<AovSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] $to: &mut [Packed<FilteredPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 6)] $edges: &mut [Packed<GBufferTexel>],
        ) {
            let (x, y) = (id.x, $params.first_row + id.y);
            if x < $params.width && y < $params.height {
                let $pixel = y * $params.width + x;
                // SAFETY: the guard, and the host's buffers of width * height records.
                unsafe { $body }
            }
        }
    )*};
}

for_each_accumulation!(accumulations);

/// Defines a pass over the history.
macro_rules! temporal {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $edges:ident, $past:ident, $to:ident, $next:ident, $x:ident, $y:ident, $pixel:ident| $body:block,)*) => {$(
        /// Runs a pass over the history.
        #[spirv(compute(threads(8, 8), entry_point_name = $text))]
        #[allow(
            clippy::too_many_arguments,
            unused_variables,
            unsafe_code,
            reason = "one argument per binding; see buffer"
        )]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] $params: &DenoiseParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] $sums: &[Packed<PixelSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] $aovs: &[Packed<AovSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] $from: &[Packed<FilteredPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] $edges: &[Packed<GBufferTexel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 5)] $past: &[Packed<HistoryPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 6)] $to: &mut [Packed<FilteredPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 7)] $next: &mut [Packed<HistoryPixel>],
        ) {
            let ($x, $y) = (id.x, $params.first_row + id.y);
            if $x < $params.width && $y < $params.height {
                let $pixel = $y * $params.width + $x;
                // SAFETY: the guard, and the host's buffers of width * height records.
                unsafe { $body }
            }
        }
    )*};
}

for_each_temporal!(temporal);

/// Defines the display kernel.
macro_rules! displays {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $lit:ident, $to:ident, $x:ident, $pixel:ident| $body:block,)*) => {$(
        /// Writes an image for a screen.
        #[spirv(compute(threads(8, 8), entry_point_name = $text))]
        #[allow(unsafe_code, reason = "see buffer")]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] $params: &DisplayParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] $sums: &[Packed<PixelSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] $lit: &[Packed<FilteredPixel>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] $to: &mut [u32],
        ) {
            let ($x, y) = (id.x, $params.first_row + id.y);
            if $x < $params.width && y < $params.height {
                let $pixel = y * $params.width + $x;
                // SAFETY: the guard, and the host's buffers of width * height records.
                unsafe { $body }
            }
        }
    )*};
}

for_each_display!(displays);

/// Defines a kernel of the film's totals.
macro_rules! totals {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $totals:ident, $output:ident, $x:ident, $y:ident| $body:block,)*) => {$(
        /// Runs a kernel of the film's totals.
        #[spirv(compute(threads(8, 8), entry_point_name = $text))]
        #[allow(
            clippy::too_many_arguments,
            unused_variables,
            unused_mut,
            unsafe_code,
            reason = "one argument per binding; see buffer"
        )]
        pub fn $name(
            #[spirv(global_invocation_id)] id: UVec3,
            #[spirv(uniform, descriptor_set = 0, binding = 0)] $params: &TotalsParams,
            #[spirv(storage_buffer, descriptor_set = 0, binding = 1)] sums: &mut [Packed<PixelSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 2)] aovs: &mut [Packed<AovSums>],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 3)] totals: &mut [u32],
            #[spirv(storage_buffer, descriptor_set = 0, binding = 4)] output: &mut [u32],
        ) {
            let ($x, $y) = (id.x, id.y);
            if $x < $params.width && $y < $params.rows {
                let (mut sums, mut aovs, mut totals, mut output) = (sums, aovs, totals, output);
                let ($sums, $aovs) = (&mut sums, &mut aovs);
                let ($totals, $output) = (&mut totals, &mut output);
                // SAFETY: the guard, and the host's buffers.
                unsafe { $body }
            }
        }
    )*};
}

for_each_total!(totals);
