//! Eight lanes of f32: the operations of the wide traversal, once for each instruction set of a CPU.
//!
//! Each arithmetic operation is IEEE 754's, rounded to nearest even, lane by lane, and none is contracted: whatever the instruction
//! set, the bits are those of scalar code. An instruction set is a value; whoever has one may use its instructions.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
pub use portable::Portable;

use bytemuck::{Pod, Zeroable};

/// Lanes of each set.
pub const LANES: usize = 8;

/// A row of a record: a number for each lane. 32 bytes.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimdRow<T>(pub [T; LANES]);

const _: () = assert!(size_of::<SimdRow<f32>>() == 32 && size_of::<SimdRow<u32>>() == 32);

/// The implementations that the derive macro does not know to be sound for one type.
#[allow(unsafe_code, reason = "audited: eight numbers of four bytes fill the 32 bytes of the alignment")]
mod pod {
    use super::{Pod, SimdRow, Zeroable};

    // SAFETY: no padding, and any bits are a value.
    unsafe impl Zeroable for SimdRow<f32> {}
    // SAFETY: as above.
    unsafe impl Pod for SimdRow<f32> {}
    // SAFETY: as above.
    unsafe impl Zeroable for SimdRow<u32> {}
    // SAFETY: as above.
    unsafe impl Pod for SimdRow<u32> {}
}

/// What waits to be visited, and where the ray enters it: eight entries at the top of a traversal's stack.
#[derive(Debug)]
pub struct StackTop<'a> {
    /// Distances.
    pub entries: &'a mut [f32; LANES],
    /// Children.
    pub children: &'a mut [u32; LANES],
}

/// An instruction set.
pub trait Simd: Copy {
    /// Eight numbers.
    type F: Copy;
    /// Eight truths.
    type M: Copy;

    /// The numbers of a row.
    fn load(self, row: &SimdRow<f32>) -> Self::F;
    /// The same number in each lane.
    fn splat(self, x: f32) -> Self::F;
    /// Back to memory.
    fn store(self, x: Self::F) -> SimdRow<f32>;
    /// a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// a - b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// a · b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// a / b, correctly rounded.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// Correctly rounded; NaN below zero.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// The other sign.
    fn neg(self, a: Self::F) -> Self::F;
    /// The larger of two numbers of which one is not negative; of two negative ones either. Neither is NaN. (Compared as integers, which
    /// takes a processor one cycle instead of four.)
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// The smaller of two numbers that are not negative; if one is negative, some negative number. Neither is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// a < b; false for NaN, as the next two.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// a <= b.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// a == b.
    fn eq(self, a: Self::F, b: Self::F) -> Self::M;
    /// Lanes whose integer is `value`.
    fn eq_u32(self, row: &SimdRow<u32>, value: u32) -> Self::M;
    /// The same truth in each lane.
    fn splat_mask(self, value: bool) -> Self::M;
    /// Both.
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// One of both, or both.
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// `b`, and not `a`.
    fn and_not(self, a: Self::M, b: Self::M) -> Self::M;
    /// A bit for each lane, the first lowest.
    fn bits(self, a: Self::M) -> u32;
    /// `a` where the truth holds, else `b`.
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// Writes the lanes whose entry is at most their exit to the beginning of `top`, all of which may be overwritten, and returns how many.
    /// Their order is that of the lanes in `order`: three bits each, the lowest first.
    fn push_sorted(
        self,
        entries: Self::F,
        exits: Self::F,
        children: &SimdRow<u32>,
        order: u32,
        top: StackTop,
    ) -> u32;
}

#[cfg(test)]
mod tests;
