//! Instruction sets of the host processor.

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
