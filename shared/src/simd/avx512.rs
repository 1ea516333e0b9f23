//! Lanes by AVX-512, in its 256-bit form.
#![allow(
    unsafe_code,
    reason = "audited: instructions are used only through a value whose creator promised that the CPU has them"
)]

use super::{LANES, Simd, SimdRow, StackTop};
use core::arch::x86_64::*;

/// AVX-512 instruction set: mask registers, permutations, compression.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

impl Avx512 {
    /// Creates the value that allows the use of AVX-512.
    ///
    /// # Safety
    ///
    /// The CPU has AVX2, AVX-512F and AVX-512VL, and the caller's `target_feature` says so (else
    /// each instruction is a call).
    #[inline(always)]
    pub unsafe fn assume() -> Self {
        Self(())
    }
}

impl Simd for Avx512 {
    type F = __m256;
    type M = u8;

    #[inline(always)]
    fn load(self, row: &SimdRow<f32>) -> __m256 {
        // SAFETY: a row is 32 aligned bytes.
        unsafe { _mm256_load_ps(row.0.as_ptr()) }
    }
    #[inline(always)]
    fn load_unaligned(self, numbers: &[f32; LANES]) -> __m256 {
        // SAFETY: see the module; there are eight numbers.
        unsafe { _mm256_loadu_ps(numbers.as_ptr()) }
    }
    #[inline(always)]
    fn splat(self, x: f32) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_set1_ps(x) }
    }
    #[inline(always)]
    fn store(self, x: __m256) -> SimdRow<f32> {
        let mut row = SimdRow([0.0; LANES]);
        // SAFETY: as for `load`.
        unsafe { _mm256_store_ps(row.0.as_mut_ptr(), x) };
        row
    }
    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_div_ps(a, b) }
    }
    #[inline(always)]
    fn sqrt(self, a: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_sqrt_ps(a) }
    }
    #[inline(always)]
    fn neg(self, a: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_xor_ps(a, _mm256_set1_ps(-0.0)) }
    }
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_castsi256_ps(_mm256_max_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b))) }
    }
    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_castsi256_ps(_mm256_min_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b))) }
    }
    #[inline(always)]
    fn lt(self, a: __m256, b: __m256) -> u8 {
        // SAFETY: see the module.
        unsafe { _mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> u8 {
        // SAFETY: see the module.
        unsafe { _mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
    }
    #[inline(always)]
    fn eq(self, a: __m256, b: __m256) -> u8 {
        // SAFETY: see the module.
        unsafe { _mm256_cmp_ps_mask::<_CMP_EQ_OQ>(a, b) }
    }
    #[inline(always)]
    fn eq_u32(self, row: &SimdRow<u32>, value: u32) -> u8 {
        // SAFETY: a row is 32 aligned bytes.
        unsafe {
            _mm256_cmpeq_epi32_mask(_mm256_load_si256(row.0.as_ptr().cast()), _mm256_set1_epi32(value as i32))
        }
    }
    #[inline(always)]
    fn splat_mask(self, value: bool) -> u8 {
        if value { 0xff } else { 0 }
    }
    #[inline(always)]
    fn and(self, a: u8, b: u8) -> u8 {
        a & b
    }
    #[inline(always)]
    fn or(self, a: u8, b: u8) -> u8 {
        a | b
    }
    #[inline(always)]
    fn and_not(self, a: u8, b: u8) -> u8 {
        !a & b
    }
    #[inline(always)]
    fn bits(self, a: u8) -> u32 {
        u32::from(a)
    }
    #[inline(always)]
    fn select(self, mask: u8, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_mask_blend_ps(mask, b, a) }
    }
    #[inline(always)]
    fn push_sorted(
        self,
        entries: __m256,
        exits: __m256,
        children: &SimdRow<u32>,
        order: u32,
        top: StackTop,
    ) -> u32 {
        // SAFETY: a row is 32 aligned bytes, and each half of the top is as long.
        unsafe {
            let order = _mm256_srlv_epi32(
                _mm256_set1_epi32(order as i32),
                _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21),
            );
            // The permutation takes the lowest three bits of each index.
            let entries = _mm256_permutexvar_ps(order, entries);
            let exits = _mm256_permutexvar_ps(order, exits);
            let children = _mm256_permutexvar_epi32(order, _mm256_load_si256(children.0.as_ptr().cast()));
            let mask = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(entries, exits);
            _mm256_storeu_ps(top.entries.as_mut_ptr(), _mm256_maskz_compress_ps(mask, entries));
            _mm256_storeu_si256(
                top.children.as_mut_ptr().cast(),
                _mm256_maskz_compress_epi32(mask, children),
            );
            mask.count_ones()
        }
    }
}
