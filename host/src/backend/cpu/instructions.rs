//! Instruction sets of the processor that runs this, and each kernel variant compiled for them.
#![allow(unsafe_code, reason = "calls the shared crate, which reads without bounds checks")]

use trisect_shared::aovs::AovSums;
use trisect_shared::buffer::SharedSlice;
use trisect_shared::features::{
    ALL, AOVS, Features, LINEAR, MICROFACETS, PERSISTENT, REGENERATE, ROULETTE, SCHLICK, SOBOL, TEXTURES,
};
#[cfg(target_arch = "x86_64")]
use trisect_shared::features::{AVX2, AVX512, WIDE};
use trisect_shared::film::{Compensation, PixelSums};
use trisect_shared::params::RenderParams;
use trisect_shared::path;
use trisect_shared::scene::Scene;

/// What kernels may use. All give the same image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// What every processor of the architecture has; traces the binary tree.
    Baseline,
    /// AVX2 and what came with it; traces the wide tree.
    Avx2,
    /// AVX-512 in its 256-bit form; traces the wide tree.
    Avx512,
}

impl InstructionSet {
    /// The best that this processor has.
    pub fn best() -> Self {
        [Self::Avx512, Self::Avx2].into_iter().find(|set| set.is_available()).unwrap_or(Self::Baseline)
    }

    /// Whether this processor has it.
    pub fn is_available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            match self {
                Self::Baseline => true,
                Self::Avx2 => avx2,
                Self::Avx512 => {
                    avx2 && is_x86_feature_detected!("avx512f")
                        && is_x86_feature_detected!("avx512vl")
                        && is_x86_feature_detected!("avx512dq")
                        && is_x86_feature_detected!("avx512bw")
                }
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        return self == Self::Baseline;
    }

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline if cfg!(target_arch = "x86_64") => "SSE2",
            Self::Baseline => std::env::consts::ARCH,
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// [`path::render_pixel`], for a variant and an instruction set, which the processor must have.
pub(super) type Kernel = unsafe fn(
    &RenderParams,
    Scene,
    u32,
    u32,
    &mut [PixelSums],
    &mut [Compensation],
    u32,
    &mut SharedSlice<AovSums>,
);

/// Of one variant.
struct Compiled {
    name: &'static str,
    baseline: Kernel,
    #[cfg(target_arch = "x86_64")]
    avx2: Kernel,
    #[cfg(target_arch = "x86_64")]
    avx512: Kernel,
}

/// The kernel of this name: for more than the baseline the one that traces the wide tree.
pub(super) fn kernel(name: &str, set: InstructionSet) -> Option<Kernel> {
    macro_rules! table {
        ($($name:ident $text:tt: $mask:expr,)*) => {
            [$(Compiled {
                name: $text,
                // A pool of threads is persistent as it is: one function for both.
                baseline: render_pixel::<{ ($mask) & !PERSISTENT }>,
                // Without LINEAR, so that its variant is not compiled for each set.
                #[cfg(target_arch = "x86_64")]
                avx2: render_avx2::<{ ($mask) & !(LINEAR | PERSISTENT) | WIDE | AVX2 }>,
                #[cfg(target_arch = "x86_64")]
                avx512: render_avx512::<{ ($mask) & !(LINEAR | PERSISTENT) | WIDE | AVX512 }>,
            },)*]
        };
    }
    let table = trisect_kernels::for_each_variant!(table);
    let compiled = table.into_iter().find(|compiled| compiled.name == name)?;
    Some(match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => compiled.avx2,
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 => compiled.avx512,
        _ => compiled.baseline,
    })
}

/// # Safety
///
/// As [`path::render_pixel`].
#[allow(clippy::too_many_arguments, reason = "those of the kernel")]
pub(super) unsafe fn render_pixel<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    film: &mut [PixelSums],
    carries: &mut [Compensation],
    slot: u32,
    guides: &mut SharedSlice<AovSums>,
) {
    // SAFETY: the caller's promise.
    unsafe { path::render_pixel::<FEATURES>(params, scene, x, y, film, carries, slot, guides) }
}

/// # Safety
///
/// As [`path::render_pixel`], and the processor has these features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
#[allow(clippy::too_many_arguments, reason = "those of the kernel")]
unsafe fn render_avx2<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    film: &mut [PixelSums],
    carries: &mut [Compensation],
    slot: u32,
    guides: &mut SharedSlice<AovSums>,
) {
    // SAFETY: the caller's promise.
    unsafe { path::render_pixel::<FEATURES>(params, scene, x, y, film, carries, slot, guides) }
}

/// # Safety
///
/// As [`path::render_pixel`], and the processor has these features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
#[allow(clippy::too_many_arguments, reason = "those of the kernel")]
unsafe fn render_avx512<const FEATURES: Features>(
    params: &RenderParams,
    scene: Scene,
    x: u32,
    y: u32,
    film: &mut [PixelSums],
    carries: &mut [Compensation],
    slot: u32,
    guides: &mut SharedSlice<AovSums>,
) {
    // SAFETY: the caller's promise.
    unsafe { path::render_pixel::<FEATURES>(params, scene, x, y, film, carries, slot, guides) }
}
