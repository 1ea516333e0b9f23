//! Entry points for PTX, compiled by rustc's NVPTX target.
//!
//! Launch records come by value: they then lie in the constant bank, and cost neither loads nor
//! registers.
#![allow(unsafe_code, reason = "kernels take raw pointers and export names")]

use core::arch::asm;
use core::arch::nvptx::{
    _block_dim_x, _block_dim_y, _block_idx_x, _block_idx_y, _thread_idx_x, _thread_idx_y, trap,
};
use core::slice::{from_raw_parts, from_raw_parts_mut};
use core::sync::atomic::AtomicU32;
use trisect_shared::aovs::AovSums;
use trisect_shared::attributes::MeshVertex;
use trisect_shared::buffer::{SharedSlice, load, store};
use trisect_shared::bvh::BvhNode;
use trisect_shared::denoise::{self, DenoiseParams, FilteredPixel, GBufferTexel, HistoryPixel};
use trisect_shared::display::{self, DisplayParams};
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::features::{
    FeatureSet, Features, OF_BOOK, OF_GPUS, OF_GPUS_WITHOUT_RARE, REGENERATE, of_words,
};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::light::Light;
use trisect_shared::material::Material;
use trisect_shared::params::{FLAG_END_OF_CHUNK, FLAG_PER_PIXEL_RANGE, RenderParams};
use trisect_shared::path::{self, FirstHit};
use trisect_shared::planar::Planar;
use trisect_shared::scene::{Scene, SceneLengths};
use trisect_shared::sphere::Sphere;
use trisect_shared::texture::{Texel, Texture};
use trisect_shared::totals::{self, TotalsParams};
use trisect_shared::triangle::Triangle;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: stops the launch with an error.
    unsafe { trap() }
}

/// Returns the position of this thread in the grid.
#[inline(always)]
fn thread() -> (u32, u32) {
    // SAFETY: these read special registers.
    unsafe {
        let x = (_block_idx_x() * _block_dim_x() + _thread_idx_x()) as u32;
        let y = (_block_idx_y() * _block_dim_y() + _thread_idx_y()) as u32;
        (x, y)
    }
}

/// Returns the pixel of this thread; its row is outside the image if the launch has no row for it.
#[inline(always)]
fn pixel_of_thread(params: &RenderParams) -> (u32, u32) {
    let (x, y) = thread();
    (x, if y < params.rows { params.row(y) } else { params.height })
}

/// Defines a render entry point: `$body` gets the launch record, the scene, the pixel, the output,
/// the compensations, the counter of the queue, and the AOV sums.
///
/// The scene's pointers are separate arguments, because only for pointers that are arguments does
/// LLVM infer that they point to global memory.
macro_rules! entry_point {
    ($name:ident, $record:ty, $persistent:expr, |$params:ident, $scene:ident, $x:ident, $y:ident, $output:ident, $compensations:ident, $counter:ident, $aovs:ident| $body:block) => {
        /// Runs a kernel over the launch's pixels. The crate's documentation lists the arguments.
        ///
        /// # Safety
        ///
        /// The pointers name device arrays of the given lengths; the output, the compensations and
        /// the AOV sums have width * height records. Only kernels with [`AOVS`] access AOV sums,
        /// and only render kernels compensations.
        #[unsafe(no_mangle)]
        #[allow(clippy::too_many_arguments, reason = "one argument per pointer")]
        pub unsafe extern "ptx-kernel" fn $name(
            $params: RenderParams,
            lengths: SceneLengths,
            spheres: *const Sphere,
            nodes: *const BvhNode,
            materials: *const Material,
            planars: *const Planar,
            triangles: *const Triangle,
            vertices: *const MeshVertex,
            lights: *const Light,
            textures: *const Texture,
            texels: *const Texel,
            environment: *const EnvironmentTexel,
            $output: *mut $record,
            $compensations: *mut Compensation,
            $counter: *mut u32,
            $aovs: *mut AovSums,
        ) {
            let ($x, $y) = pixel_of_thread(&$params);
            // Persistent threads take their pixels from the counter.
            if !$persistent && ($x >= $params.width || $y >= $params.height) {
                return;
            }
            // SAFETY: the caller's promise, and the guard.
            unsafe {
                let $scene = Scene {
                    spheres: from_raw_parts(spheres, lengths.spheres),
                    nodes: from_raw_parts(nodes, lengths.nodes),
                    materials: from_raw_parts(materials, lengths.materials),
                    planars: from_raw_parts(planars, lengths.planars),
                    triangles: from_raw_parts(triangles, lengths.triangles),
                    vertices: from_raw_parts(vertices, lengths.vertices),
                    lights: from_raw_parts(lights, lengths.lights),
                    textures: from_raw_parts(textures, lengths.textures),
                    texels: from_raw_parts(texels, lengths.texels),
                    environment: from_raw_parts(environment, lengths.environment),
                };
                $body
            }
        }
    };
}

/// Returns the features of a render kernel: the words are constants that the host replaces in the
/// text before the driver compiles it.
#[inline(always)]
fn features() -> Features {
    let (low, high): (u32, u32);
    // SAFETY: moves of constants.
    unsafe {
        asm!("mov.u32 {}, 0x7ea5e7ed;", out(reg32) low, options(pure, nomem, nostack, preserves_flags));
        asm!("mov.u32 {}, 0x7ea5e7ee;", out(reg32) high, options(pure, nomem, nostack, preserves_flags));
    }
    of_words(low, high)
}

macro_rules! render {
    ($($name:ident $text:tt: $persistent:expr, $possible:expr, $certain:expr,)*) => {$(
        entry_point!($name, PixelSums, $persistent, |params, scene, x, y, film, compensations, counter, aovs| {
            let features = FeatureSet::<{ $possible }>::new(features() | $certain);
            let pixels = params.width as usize * params.height as usize;
            let mut aovs = SharedSlice::new(aovs, pixels);
            if $persistent {
                let (mut film, mut compensations) = (SharedSlice::new(film, pixels), SharedSlice::new(compensations, pixels));
                let mut counter = AtomicU32::from_ptr(counter);
                path::render_persistent(features, &params, scene, &mut film, &mut compensations, &mut aovs, &mut counter);
                return;
            }
            let pixel = (y * params.width + x) as usize;
            let (film, compensations) = (film.add(pixel), compensations.add(pixel));
            let (mut sums, mut compensation) = ([PixelSums::ZERO], [Compensation::ZERO]);
            if params.resume != 0 || params.flags & FLAG_PER_PIXEL_RANGE != 0 {
                (sums, compensation) = ([*film], [*compensations]);
            }
            path::render_pixel(features, &params, scene, x, y, &mut sums, &mut compensation, 0, &mut aovs);
            *film = sums[0];
            if params.flags & FLAG_END_OF_CHUNK == 0 {
                *compensations = compensation[0];
            }
        });
    )*};
}

for_each_render!(render);
for_each_book_render!(render);

entry_point!(first_hit, FirstHit, false, |params, scene, x, y, hits, _compensations, _counter, _aovs| {
    *hits.add((y * params.width + x) as usize) = path::first_hit(&params, scene, x, y);
});

/// Defines a pass of the denoiser.
macro_rules! pass {
    ($name:ident: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $y:ident| $body:block) => {
        /// Runs a pass of the denoiser.
        ///
        /// # Safety
        ///
        /// The pointers name device arrays of width * height records; written arrays overlap no
        /// other.
        #[unsafe(no_mangle)]
        #[allow(unused_variables, reason = "all passes have the same arguments")]
        pub unsafe extern "ptx-kernel" fn $name(
            params: DenoiseParams,
            sums: *const PixelSums,
            aovs: *const AovSums,
            from: *const FilteredPixel,
            to: *mut FilteredPixel,
            edges: *mut GBufferTexel,
        ) {
            let $params = &params;
            let ($x, y) = thread();
            let $y = params.first_row + y;
            if $x >= params.width {
                return;
            }
            let pixels = params.width as usize * params.height as usize;
            // SAFETY: the caller's promise, and the guards.
            unsafe {
                let ($sums, $aovs) = (from_raw_parts(sums, pixels), from_raw_parts(aovs, pixels));
                let ($from, $to) = (from_raw_parts(from, pixels), from_raw_parts_mut(to, pixels));
                let $edges = from_raw_parts_mut(edges, pixels);
                $body
            }
        }
    };
}

macro_rules! passes {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $to:ident, $edges:ident, $x:ident, $y:ident, $pixel:ident| $body:block,)*) => {$(
        pass!($name: |$params, $sums, $aovs, $from, $to, $edges, $x, $y| {
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
        pass!($name: |$params, $sums, $aovs, $from, $to, $edges, $x, $row| $body);
    )*};
}

for_each_level!(levels);

/// Defines the pass that sums frames.
macro_rules! accumulations {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $kept:ident, $seen:ident, $to:ident, $edges:ident, $pixel:ident| $body:block,)*) => {$(
        /// Runs a pass that sums frames.
        ///
        /// # Safety
        ///
        /// As the other passes.
        #[unsafe(no_mangle)]
        pub unsafe extern "ptx-kernel" fn $name(
            params: DenoiseParams,
            sums: *const PixelSums,
            aovs: *const AovSums,
            kept: *mut PixelSums,
            seen: *mut AovSums,
            to: *mut FilteredPixel,
            edges: *mut GBufferTexel,
        ) {
            let $params = &params;
            let (x, y) = thread();
            let y = params.first_row + y;
            if x >= params.width || y >= params.height {
                return;
            }
            let $pixel = y * params.width + x;
            let pixels = params.width as usize * params.height as usize;
            // SAFETY: the caller's promise, and the guard.
            unsafe {
                let ($sums, $aovs) = (from_raw_parts(sums, pixels), from_raw_parts(aovs, pixels));
                let ($kept, $seen) = (from_raw_parts_mut(kept, pixels), from_raw_parts_mut(seen, pixels));
                let ($to, $edges) = (from_raw_parts_mut(to, pixels), from_raw_parts_mut(edges, pixels));
                $body
            }
        }
    )*};
}

for_each_accumulation!(accumulations);

/// Defines a pass over the history.
macro_rules! temporal {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $from:ident, $edges:ident, $past:ident, $to:ident, $next:ident, $x:ident, $y:ident, $pixel:ident| $body:block,)*) => {$(
        /// Runs a pass over the history.
        ///
        /// # Safety
        ///
        /// As the other passes; an array that a pass does not use may have any length.
        #[unsafe(no_mangle)]
        #[allow(unused_variables, reason = "all passes have the same arguments")]
        pub unsafe extern "ptx-kernel" fn $name(
            params: DenoiseParams,
            sums: *const PixelSums,
            aovs: *const AovSums,
            from: *const FilteredPixel,
            edges: *const GBufferTexel,
            past: *const HistoryPixel,
            to: *mut FilteredPixel,
            next: *mut HistoryPixel,
        ) {
            let $params = &params;
            let ($x, y) = thread();
            let $y = params.first_row + y;
            if $x >= params.width || $y >= params.height {
                return;
            }
            let $pixel = $y * params.width + $x;
            let pixels = params.width as usize * params.height as usize;
            // SAFETY: the caller's promise, and the guard.
            unsafe {
                let ($sums, $aovs) = (from_raw_parts(sums, pixels), from_raw_parts(aovs, pixels));
                let ($from, $edges) = (from_raw_parts(from, pixels), from_raw_parts(edges, pixels));
                let ($past, $to) = (from_raw_parts(past, pixels), from_raw_parts_mut(to, pixels));
                let $next = from_raw_parts_mut(next, pixels);
                $body
            }
        }
    )*};
}

for_each_temporal!(temporal);

/// Defines the display kernel.
macro_rules! displays {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $lit:ident, $to:ident, $x:ident, $pixel:ident| $body:block,)*) => {$(
        /// Writes an image for a screen.
        ///
        /// # Safety
        ///
        /// The pointers name device arrays of width * height records; the written array overlaps no
        /// other.
        #[unsafe(no_mangle)]
        pub unsafe extern "ptx-kernel" fn $name(
            params: DisplayParams,
            sums: *const PixelSums,
            lit: *const FilteredPixel,
            to: *mut u32,
        ) {
            let $params = &params;
            let ($x, y) = thread();
            let y = params.first_row + y;
            if $x >= params.width || y >= params.height {
                return;
            }
            let $pixel = y * params.width + $x;
            let pixels = params.width as usize * params.height as usize;
            // SAFETY: the caller's promise, and the guard.
            unsafe {
                let ($sums, $lit) = (from_raw_parts(sums, pixels), from_raw_parts(lit, pixels));
                let $to = from_raw_parts_mut(to, pixels);
                $body
            }
        }
    )*};
}

for_each_display!(displays);

/// Defines a kernel of the film's totals.
macro_rules! totals {
    ($($name:ident $text:tt: |$params:ident, $sums:ident, $aovs:ident, $totals:ident, $output:ident, $x:ident, $y:ident| $body:block,)*) => {$(
        /// Runs a kernel of the film's totals.
        ///
        /// # Safety
        ///
        /// The pointers name device arrays with records and words for each pixel of the image, and
        /// an output for each thread; an array that the kernel does not use may have any length.
        /// They do not overlap.
        #[unsafe(no_mangle)]
        #[allow(unused_variables, unused_mut, reason = "all these kernels have the same arguments")]
        pub unsafe extern "ptx-kernel" fn $name(
            params: TotalsParams,
            sums: *mut PixelSums,
            aovs: *mut AovSums,
            totals: *mut u32,
            output: *mut u32,
        ) {
            let $params = &params;
            let ($x, $y) = thread();
            if $x >= params.width || $y >= params.rows {
                return;
            }
            // SAFETY: the caller's promise, and the guard.
            unsafe {
                let $sums = &mut SharedSlice::new(sums, usize::MAX);
                let $aovs = &mut SharedSlice::new(aovs, usize::MAX);
                let $totals = &mut SharedSlice::new(totals, usize::MAX);
                let $output = &mut SharedSlice::new(output, usize::MAX);
                $body
            }
        }
    )*};
}

for_each_total!(totals);
