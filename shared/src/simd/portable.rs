//! Lanes as arrays, for any processor; the reference for the other instruction sets.

use super::{LANES, Simd, SimdRow, StackTop};
use crate::math;

/// Scalar code, without an instruction set of its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Portable;

type F = [f32; LANES];
type M = [bool; LANES];

#[inline(always)]
fn each<A: Copy, B: Copy, C>(a: [A; LANES], b: [B; LANES], f: impl Fn(A, B) -> C) -> [C; LANES] {
    core::array::from_fn(|i| f(a[i], b[i]))
}

impl Simd for Portable {
    type F = F;
    type M = M;

    #[inline(always)]
    fn load(self, row: &SimdRow<f32>) -> F {
        row.0
    }
    #[inline(always)]
    fn load_unaligned(self, numbers: &[f32; LANES]) -> F {
        *numbers
    }
    #[inline(always)]
    fn splat(self, x: f32) -> F {
        [x; LANES]
    }
    #[inline(always)]
    fn store(self, x: F) -> SimdRow<f32> {
        SimdRow(x)
    }
    #[inline(always)]
    fn add(self, a: F, b: F) -> F {
        each(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: F, b: F) -> F {
        each(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: F, b: F) -> F {
        each(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: F, b: F) -> F {
        each(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn sqrt(self, a: F) -> F {
        a.map(math::sqrt)
    }
    #[inline(always)]
    fn neg(self, a: F) -> F {
        a.map(|a| -a)
    }
    #[inline(always)]
    fn max(self, a: F, b: F) -> F {
        each(a, b, math::max)
    }
    #[inline(always)]
    fn min(self, a: F, b: F) -> F {
        each(a, b, math::min)
    }
    #[inline(always)]
    fn lt(self, a: F, b: F) -> M {
        each(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, a: F, b: F) -> M {
        each(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn eq(self, a: F, b: F) -> M {
        each(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn eq_u32(self, row: &SimdRow<u32>, value: u32) -> M {
        row.0.map(|word| word == value)
    }
    #[inline(always)]
    fn splat_mask(self, value: bool) -> M {
        [value; LANES]
    }
    #[inline(always)]
    fn and(self, a: M, b: M) -> M {
        each(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn or(self, a: M, b: M) -> M {
        each(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn and_not(self, a: M, b: M) -> M {
        each(a, b, |a, b| !a & b)
    }
    #[inline(always)]
    fn bits(self, a: M) -> u32 {
        (0..LANES).fold(0, |bits, lane| bits | u32::from(a[lane]) << lane)
    }
    #[inline(always)]
    fn select(self, mask: M, a: F, b: F) -> F {
        core::array::from_fn(|i| if mask[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn push_sorted(self, entries: F, exits: F, children: &SimdRow<u32>, order: u32, top: StackTop) -> u32 {
        let mut count = 0;
        for place in 0..LANES {
            let lane = (order >> (3 * place) & 7) as usize;
            if entries[lane] <= exits[lane] {
                top.entries[count] = entries[lane];
                top.children[count] = children.0[lane];
                count += 1;
            }
        }
        count as u32
    }
}
