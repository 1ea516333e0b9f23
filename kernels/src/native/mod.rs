//! Entry points for the host: the same list as for devices, compiled for the CPU.
//!
//! A call runs threads next to each other in one row of a launch. Render kernels and filters of the
//! denoiser also exist for instruction sets above the baseline; render kernels trace the wide BVH
//! with them.
#![allow(unsafe_code, reason = "kernels take raw pointers, which their callers answer for")]

mod passes;
mod rows;

use crate::EntryPoint;
use core::marker::PhantomData;
use core::ops::{Deref, Range};
use core::slice::{from_raw_parts, from_raw_parts_mut};
use passes::{ACCUMULATIONS, PASSES, TEMPORAL, TOTALS};
use rows::ROWS;
pub use rows::is_by_rows;
use trisect_shared::aovs::AovSums;
use trisect_shared::buffer::SharedSlice;
#[cfg(target_arch = "x86_64")]
use trisect_shared::features::{AVX2, AVX512};
use trisect_shared::features::{
    BOOK, CHOICES, FeatureSet, Features, LINEAR, NEEDS, OF_SURFACES, RARE, REGENERATE, ROULETTE, SPHERES,
    WIDE, has_any,
};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::RenderParams;
use trisect_shared::path::{self, FirstHit};
use trisect_shared::scene::Scene;
use trisect_shared::wide::{WideChild, WideTree};

/// Array of records that a kernel reads or writes.
#[derive(Clone, Copy, Debug)]
pub struct Array {
    /// First byte, aligned for the records.
    pub first: *mut u8,
    /// Number of bytes.
    pub bytes: usize,
}

// SAFETY: it is an address and a length; kernels that share it touch different records.
unsafe impl Send for Array {}
// SAFETY: as above.
unsafe impl Sync for Array {}

/// Arguments of a launch.
#[derive(Clone, Copy, Debug)]
pub struct Arguments<'a> {
    /// Launch parameters, as the entry point's record.
    pub params: &'a [u8],
    /// Arrays, in the order of the entry point's bindings.
    pub arrays: &'a [Array],
    /// Features of a render kernel.
    pub features: Features,
}

/// Runs threads `x` of row `y` of a launch.
///
/// # Safety
///
/// Parameters and arrays are those of the entry point; the arrays hold what the kernel reads, and
/// have a place for what it writes. No other thread runs the same thread of the launch. The
/// processor has the instruction set that the kernel is compiled for.
pub type Kernel = unsafe fn(arguments: &Arguments<'_>, x: Range<u32>, y: u32);

/// Entry point, by instruction set.
#[derive(Clone, Copy, Debug)]
pub struct NativeEntryPoint {
    /// Name of the entry point, or of all render kernels.
    name: &'static str,
    /// Features that a render kernel can have.
    possible: Features,
    /// Kernel for every processor of the architecture; traces the binary BVH.
    pub baseline: Kernel,
    /// Kernel for AVX2; on x86-64 only. A render kernel traces the wide BVH.
    pub avx2: Option<Kernel>,
    /// Kernel for AVX-512; as for AVX2.
    pub avx512: Option<Kernel>,
}

/// Name of all render kernels. Threads of a CPU take their pixels from the pool, so the schedules
/// have the same kernels.
const RENDER_NAME: &str = "render";

/// Returns the kernels of an entry point: of a render kernel the first that can have all its
/// features.
pub fn native(of: EntryPoint) -> Option<&'static NativeEntryPoint> {
    let name = if crate::is_render(of.name) { RENDER_NAME } else { of.name };
    let able = |kernel: &&NativeEntryPoint| {
        kernel.name == name && of.features & (CHOICES | NEEDS | LINEAR) & !kernel.possible == 0
    };
    [RENDER, FIRST_HITS, ROWS, PASSES, ACCUMULATIONS, TEMPORAL, TOTALS].into_iter().flatten().find(able)
}

impl Arguments<'_> {
    /// Returns the launch parameters.
    ///
    /// # Safety
    ///
    /// They are of type `T`.
    unsafe fn params<T: Copy>(&self) -> T {
        debug_assert_eq!(self.params.len(), size_of::<T>());
        // SAFETY: the caller's promise.
        unsafe { self.params.as_ptr().cast::<T>().read_unaligned() }
    }

    /// Returns an array that no thread of the launch writes.
    ///
    /// # Safety
    ///
    /// The array holds records of type `T`.
    unsafe fn read<T>(&self, binding: usize) -> &[T] {
        // SAFETY: the caller's promise.
        unsafe {
            let array = self.arrays.get_unchecked(binding);
            from_raw_parts(array.first.cast(), array.bytes / size_of::<T>())
        }
    }

    /// Returns an array that threads of the launch write, each its own records.
    ///
    /// # Safety
    ///
    /// The array holds records of type `T`.
    unsafe fn written<T>(&self, binding: usize) -> Written<'_, T> {
        // SAFETY: the caller's promise.
        let array = unsafe { self.arrays.get_unchecked(binding) };
        Written { first: array.first.cast(), length: array.bytes / size_of::<T>(), arrays: PhantomData }
    }
}

/// Array of a launch whose threads write their own records, or read all.
#[derive(Clone, Copy)]
struct Written<'a, T> {
    first: *mut T,
    length: usize,
    arrays: PhantomData<&'a mut [T]>,
}

impl<'a, T> Written<'a, T> {
    /// Returns the array for code of which each thread accesses its own records.
    ///
    /// # Safety
    ///
    /// No two threads access the same record.
    unsafe fn shared(self) -> SharedSlice<'a, T> {
        // SAFETY: the caller's promise; `Arguments::written` got an array of this length.
        unsafe { SharedSlice::new(self.first, self.length) }
    }
}

/// All records, for a kernel that writes none of them.
impl<T> Deref for Written<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        // SAFETY: `Arguments::written` got an array of this length.
        unsafe { from_raw_parts(self.first, self.length) }
    }
}

/// Array of which a thread loads its own record.
trait Records<T> {
    /// # Safety
    ///
    /// The array has the record.
    unsafe fn record(self, index: u32) -> T;
}

impl<T: Copy> Records<T> for &[T] {
    #[inline(always)]
    unsafe fn record(self, index: u32) -> T {
        // SAFETY: the caller's promise.
        unsafe { *self.get_unchecked(index as usize) }
    }
}

impl<T: Copy> Records<T> for &Written<'_, T> {
    #[inline(always)]
    unsafe fn record(self, index: u32) -> T {
        debug_assert!((index as usize) < self.length);
        // SAFETY: the caller's promise.
        unsafe { *self.first.add(index as usize) }
    }
}

/// Returns record `index`.
///
/// # Safety
///
/// The array has the record.
#[inline(always)]
unsafe fn load<T>(array: impl Records<T>, index: u32) -> T {
    // SAFETY: the caller's promise.
    unsafe { array.record(index) }
}

/// Writes record `index`.
///
/// # Safety
///
/// The array has the record, and no other thread accesses it.
#[inline(always)]
unsafe fn store<T>(array: &Written<'_, T>, index: u32, value: T) {
    debug_assert!((index as usize) < array.length);
    // SAFETY: the caller's promise.
    unsafe { array.first.add(index as usize).write(value) }
}

/// First binding of the arrays that render kernels write: output, compensations, counter, AOV sums.
const WRITTEN: usize = 10;

/// First binding of the wide BVH: roots of the world and of each instance, nodes, packets of
/// spheres and of triangles.
const WIDE_TREE: usize = 14;

/// Returns the scene of a render kernel. Its wide BVH is empty for the other kernels.
///
/// # Safety
///
/// The arguments are those of a render kernel.
#[inline(always)]
unsafe fn scene<'a, const POSSIBLE: Features>(of: &'a Arguments<'_>) -> Scene<'a> {
    // SAFETY: the caller's promise.
    unsafe {
        let wide = if const { has_any(POSSIBLE, WIDE) } {
            WideTree {
                root: WideChild(*of.read::<u32>(WIDE_TREE).get_unchecked(0)),
                instance_roots: of.read::<u32>(WIDE_TREE).get_unchecked(1..),
                nodes: of.read(WIDE_TREE + 1),
                spheres: of.read(WIDE_TREE + 2),
                triangles: of.read(WIDE_TREE + 3),
            }
        } else {
            WideTree::NONE
        };
        Scene {
            spheres: of.read(0),
            nodes: of.read(1),
            materials: of.read(2),
            planars: of.read(3),
            triangles: of.read(4),
            vertices: of.read(5),
            lights: of.read(6),
            textures: of.read(7),
            texels: of.read(8),
            environment: of.read(9),
            wide,
        }
    }
}

/// Renders pixels next to each other.
///
/// # Safety
///
/// As [`Kernel`].
#[inline(always)]
unsafe fn render_span<const POSSIBLE: Features>(of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise; the guard keeps the pixels inside the film.
    unsafe {
        let params = of.params::<RenderParams>();
        if y >= params.rows {
            return;
        }
        let (scene, y) = (scene::<POSSIBLE>(of), params.row(y));
        // The instruction set and the tree are those that the kernel is compiled for.
        let features = FeatureSet::<POSSIBLE>::new(of.features | POSSIBLE & !(CHOICES | NEEDS | LINEAR));
        let film = of.written::<PixelSums>(WRITTEN);
        let compensations = of.written::<Compensation>(WRITTEN + 1);
        let aovs = of.written::<AovSums>(WRITTEN + 3);
        let mut aovs = aovs.shared();
        for x in x.start..x.end.min(params.width) {
            let pixel = y as usize * params.width as usize + x as usize;
            let sums = from_raw_parts_mut(film.first.add(pixel), 1);
            let carries = from_raw_parts_mut(compensations.first.add(pixel), 1);
            path::render_pixel(features, &params, scene, x, y, sums, carries, 0, &mut aovs);
        }
    }
}

/// [`render_span`] for the baseline.
///
/// # Safety
///
/// As [`Kernel`].
unsafe fn render_baseline<const POSSIBLE: Features>(of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise.
    unsafe { render_span::<POSSIBLE>(of, x, y) }
}

/// [`render_span`] for AVX2.
///
/// # Safety
///
/// As [`Kernel`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn render_avx2<const POSSIBLE: Features>(of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise.
    unsafe { render_span::<POSSIBLE>(of, x, y) }
}

/// [`render_span`] for AVX-512.
///
/// # Safety
///
/// As [`Kernel`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
unsafe fn render_avx512<const POSSIBLE: Features>(of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise.
    unsafe { render_span::<POSSIBLE>(of, x, y) }
}

macro_rules! render {
    ($($possible:expr,)*) => {
        &[$(NativeEntryPoint {
            name: RENDER_NAME,
            possible: $possible,
            baseline: render_baseline::<{ $possible }>,
            // LINEAR is masked out, so that it is not compiled for each instruction set.
            #[cfg(target_arch = "x86_64")]
            avx2: Some(render_avx2::<{ ($possible) & !LINEAR | WIDE | AVX2 }>),
            #[cfg(target_arch = "x86_64")]
            avx512: Some(render_avx512::<{ ($possible) & !LINEAR | WIDE | AVX512 }>),
            #[cfg(not(target_arch = "x86_64"))]
            avx2: None,
            #[cfg(not(target_arch = "x86_64"))]
            avx512: None,
        },)*]
    };
}

/// Render kernels, from cheap to general. Few suffice, because a CPU predicts the branches on
/// features; code that is left out for a choice gains up to 6 % (docs/notebook/specialisation.md).
const RENDER: &[NativeEntryPoint] = render! {
    CHOICES | ROULETTE | SPHERES | BOOK,
    NEEDS & !(OF_SURFACES | RARE),
    NEEDS & !RARE | REGENERATE,
    CHOICES | NEEDS & !RARE | LINEAR | REGENERATE,
    CHOICES | NEEDS | LINEAR | REGENERATE,
};

/// Writes first hits of pixels next to each other.
///
/// # Safety
///
/// As [`Kernel`].
unsafe fn first_hit(of: &Arguments<'_>, x: Range<u32>, y: u32) {
    // SAFETY: the caller's promise; the guard keeps the pixels inside the image.
    unsafe {
        let params = of.params::<RenderParams>();
        if y >= params.rows {
            return;
        }
        let (scene, y) = (scene::<0>(of), params.row(y));
        let hits = of.written::<FirstHit>(WRITTEN);
        for x in x.start..x.end.min(params.width) {
            store(&hits, y * params.width + x, path::first_hit(&params, scene, x, y));
        }
    }
}

/// Returns an entry point that exists for the baseline only.
const fn plain(name: &'static str, baseline: Kernel) -> NativeEntryPoint {
    NativeEntryPoint { name, possible: 0, baseline, avx2: None, avx512: None }
}

const FIRST_HITS: &[NativeEntryPoint] = &[plain(crate::FIRST_HIT, first_hit)];
