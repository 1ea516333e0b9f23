//! Eight lanes of f32: the operations of the wide traversal, for each instruction set of a CPU.
//!
//! Each arithmetic operation is IEEE 754's, rounded to nearest even, lane by lane, and none is
//! contracted: with each instruction set the bits are those of scalar code. An instruction set is a
//! value; code that has one may use its instructions. Called by `wide` and `denoise`.

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

/// Number of lanes, of each instruction set.
pub const LANES: usize = 8;

/// Row of a record: a number for each lane. 32 bytes.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimdRow<T>(pub [T; LANES]);

const _: () = assert!(size_of::<SimdRow<f32>>() == 32 && size_of::<SimdRow<u32>>() == 32);

/// Implementations by hand: the derive macro cannot rule out padding in a generic type.
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

/// Eight entries at the top of a traversal's stack: children, and where the ray enters them.
#[derive(Debug)]
pub struct StackTop<'a> {
    /// Distances at which the ray enters the children's boxes.
    pub entries: &'a mut [f32; LANES],
    /// Children, as [`WideChild`](crate::wide::WideChild) words.
    pub children: &'a mut [u32; LANES],
}

/// Instruction set.
pub trait Simd: Copy {
    /// Eight numbers.
    type F: Copy;
    /// Eight booleans, a mask.
    type M: Copy;

    /// Returns the numbers of a row.
    fn load(self, row: &SimdRow<f32>) -> Self::F;
    /// Returns eight numbers, which need no alignment.
    fn load_unaligned(self, numbers: &[f32; LANES]) -> Self::F;
    /// Returns `x` in each lane.
    fn splat(self, x: f32) -> Self::F;
    /// Returns the numbers as a row.
    fn store(self, x: Self::F) -> SimdRow<f32>;
    /// Returns a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a - b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a · b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a / b, correctly rounded.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns the square root, correctly rounded; NaN below zero.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// Returns -a.
    fn neg(self, a: Self::F) -> Self::F;
    /// Returns the larger of two numbers of which one is not negative; of two negative ones either.
    /// Neither may be NaN. (It compares integers, which takes a processor one cycle instead of
    /// four.)
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns the smaller of two numbers that are not negative; if one is negative, some negative
    /// number. Neither may be NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns the lanes where a < b; false for NaN.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// Returns the lanes where a <= b; false for NaN.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// Returns the lanes where a == b; false for NaN.
    fn eq(self, a: Self::F, b: Self::F) -> Self::M;
    /// Returns the lanes whose integer is `value`.
    fn eq_u32(self, row: &SimdRow<u32>, value: u32) -> Self::M;
    /// Returns `value` in each lane.
    fn splat_mask(self, value: bool) -> Self::M;
    /// Returns a and b.
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// Returns a or b.
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Returns b and not a.
    fn and_not(self, a: Self::M, b: Self::M) -> Self::M;
    /// Returns a bit for each lane, the first one lowest.
    fn bits(self, a: Self::M) -> u32;
    /// Returns `a` in the lanes of `mask`, `b` in the others.
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// Writes the lanes whose entry is at most their exit to the beginning of `top` and returns
    /// their number. They are written in the order of the lanes in `order`: three bits each, the
    /// lowest first. All of `top` may be overwritten.
    fn push_sorted(
        self,
        entries: Self::F,
        exits: Self::F,
        children: &SimdRow<u32>,
        order: u32,
        top: StackTop,
    ) -> u32;
}

/// Returns the dot product in each lane, summed in glam's order.
#[inline(always)]
pub fn dot<L: Simd>(l: L, a: [L::F; 3], b: [L::F; 3]) -> L::F {
    l.add(l.add(l.mul(a[0], b[0]), l.mul(a[1], b[1])), l.mul(a[2], b[2]))
}

/// Returns `f` of each of three values. Unlike `map` of arrays it is always inlined, so that `f`
/// has the instruction set of its caller.
#[inline(always)]
pub fn three<T: Copy, U>(of: [T; 3], f: impl Fn(T) -> U) -> [U; 3] {
    [f(of[0]), f(of[1]), f(of[2])]
}

#[cfg(test)]
mod tests;
