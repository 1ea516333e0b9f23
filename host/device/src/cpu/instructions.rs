//! Instruction sets of the host processor, and each kernel variant compiled for them.
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

/// Instruction set of the CPU's kernels. The image does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// Baseline, which every processor of the architecture has; traces the binary BVH.
    Baseline,
    /// AVX2 with BMI1, BMI2, LZCNT and POPCNT; traces the wide BVH.
    Avx2,
    /// AVX-512 (F, VL, DQ and BW) in its 256-bit form; traces the wide BVH.
    Avx512,
}

impl InstructionSet {
    /// Returns the best instruction set of this processor.
    pub fn best() -> Self {
        [Self::Avx512, Self::Avx2].into_iter().find(|set| set.is_available()).unwrap_or(Self::Baseline)
    }

    /// Returns whether this processor has the instruction set.
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

    /// Returns the name to print.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline if cfg!(target_arch = "x86_64") => "SSE2",
            Self::Baseline => std::env::consts::ARCH,
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }
}

/// [`path::render_pixel`] of one variant, compiled for an instruction set that the processor must
/// have.
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

/// Functions of one kernel variant, by instruction set.
struct Compiled {
    name: &'static str,
    baseline: Kernel,
    #[cfg(target_arch = "x86_64")]
    avx2: Kernel,
    #[cfg(target_arch = "x86_64")]
    avx512: Kernel,
}

/// Returns the kernel of this name. For sets above the baseline it traces the wide BVH.
pub(super) fn kernel(name: &str, set: InstructionSet) -> Option<Kernel> {
    macro_rules! table {
        ($($name:ident $text:tt: $mask:expr,)*) => {
            [$(Compiled {
                name: $text,
                // The thread pool is persistent already: a variant and its persistent form share a
                // function.
                baseline: render_pixel::<{ ($mask) & !PERSISTENT }>,
                // LINEAR is masked out, so that its variant is not compiled for each set.
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

/// [`path::render_pixel`] for the baseline.
///
/// # Safety
///
/// The requirements of [`path::render_pixel`] hold.
#[allow(clippy::too_many_arguments, reason = "the parameters of the kernel")]
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

/// [`path::render_pixel`] for AVX2.
///
/// # Safety
///
/// The requirements of [`path::render_pixel`] hold, and the processor has these features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
#[allow(clippy::too_many_arguments, reason = "the parameters of the kernel")]
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

/// [`path::render_pixel`] for AVX-512.
///
/// # Safety
///
/// The requirements of [`path::render_pixel`] hold, and the processor has these features.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw")]
#[allow(clippy::too_many_arguments, reason = "the parameters of the kernel")]
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
