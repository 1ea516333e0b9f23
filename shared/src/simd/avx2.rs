//! Lanes by AVX2.
#![allow(
    unsafe_code,
    reason = "audited: instructions are used only through a value whose creator promised that the CPU has them"
)]

use super::{LANES, Simd, SimdRow, StackTop};
use core::arch::x86_64::*;

/// AVX2 instruction set.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

impl Avx2 {
    /// Creates the value that allows the use of AVX2.
    ///
    /// # Safety
    ///
    /// The CPU has AVX2, and the caller's `target_feature` says so (else each instruction is a
    /// call).
    #[inline(always)]
    pub unsafe fn assume() -> Self {
        Self(())
    }
}

/// For each mask: the lanes whose bit is set, in ascending order, then zeros.
const COMPRESSED: [[u8; LANES]; 256] = {
    let mut table = [[0; LANES]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            if mask >> lane & 1 == 1 {
                table[mask][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

impl Simd for Avx2 {
    type F = __m256;
    type M = __m256;

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
    fn lt(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(a, b) }
    }
    #[inline(always)]
    fn le(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(a, b) }
    }
    #[inline(always)]
    fn eq(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(a, b) }
    }
    #[inline(always)]
    fn eq_u32(self, row: &SimdRow<u32>, value: u32) -> __m256 {
        // SAFETY: a row is 32 aligned bytes.
        unsafe {
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(
                _mm256_load_si256(row.0.as_ptr().cast()),
                _mm256_set1_epi32(value as i32),
            ))
        }
    }
    #[inline(always)]
    fn splat_mask(self, value: bool) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_castsi256_ps(_mm256_set1_epi32(-i32::from(value))) }
    }
    #[inline(always)]
    fn and(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_and_ps(a, b) }
    }
    #[inline(always)]
    fn or(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_or_ps(a, b) }
    }
    #[inline(always)]
    fn and_not(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_andnot_ps(a, b) }
    }
    #[inline(always)]
    fn bits(self, a: __m256) -> u32 {
        // SAFETY: see the module.
        unsafe { _mm256_movemask_ps(a) as u32 }
    }
    #[inline(always)]
    fn select(self, mask: __m256, a: __m256, b: __m256) -> __m256 {
        // SAFETY: see the module.
        unsafe { _mm256_blendv_ps(b, a, mask) }
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
        // SAFETY: a row is 32 aligned bytes, each half of the top is as long, and a mask of eight
        // bits is below 256.
        unsafe {
            let order = _mm256_srlv_epi32(
                _mm256_set1_epi32(order as i32),
                _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21),
            );
            // The permutation takes the lowest three bits of each index.
            let entries = _mm256_permutevar8x32_ps(entries, order);
            let exits = _mm256_permutevar8x32_ps(exits, order);
            let children = _mm256_permutevar8x32_epi32(_mm256_load_si256(children.0.as_ptr().cast()), order);
            let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entries, exits)) as u32;
            let row = COMPRESSED.get_unchecked(mask as usize);
            let places = _mm256_cvtepu8_epi32(_mm_loadl_epi64(row.as_ptr().cast()));
            _mm256_storeu_ps(top.entries.as_mut_ptr(), _mm256_permutevar8x32_ps(entries, places));
            let children = _mm256_permutevar8x32_epi32(children, places);
            _mm256_storeu_si256(top.children.as_mut_ptr().cast(), children);
            mask.count_ones()
        }
    }
}
