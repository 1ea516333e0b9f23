//! Exact sums of f32 in fixed point, by integers of 32 bits.
//!
//! Each finite f32 is a multiple of 2^-149 and less than 2^128. So a sum of them is an integer in
//! units of 2^-149, which an accumulator of [`LIMBS`] words holds in two's complement (Kulisch,
//! "Computer Arithmetic and Validity", 2nd edition, 2013, section 8.2). Additions are exact, so
//! their order does not matter; and integers have the same bits on each device, whatever its
//! compiler does to floating-point operations or its hardware to subnormal numbers.
//!
//! A pixel's accumulators lie apart in memory, so that lanes next to each other access words next
//! to each other.
#![allow(unsafe_code, reason = "see buffer")]

use super::double_words::{DoubleWords, bit_length, encode, shifted, signed, window};
use crate::buffer::{SharedSlice, load_local, load_shared, store_local, store_shared};
use core::mem::MaybeUninit;

/// Number of words of an accumulator. A term takes 277 bits, so that 2^42 terms fit.
pub const LIMBS: u32 = 10;

/// Words of an accumulator in an array.
#[derive(Clone, Copy, Debug)]
pub struct Accumulator {
    /// Index of the lowest word.
    pub first: u32,
    /// Number of words from one of its words to the next.
    pub stride: u32,
}

impl Accumulator {
    /// Adds a finite number.
    ///
    /// # Safety
    ///
    /// The array has these words, and no other lane accesses them.
    #[inline(always)]
    pub unsafe fn add(self, words: &mut SharedSlice<u32>, x: f32) {
        let bits = x.to_bits();
        let (exponent, fraction) = (bits >> 23 & 0xff, bits & 0x007f_ffff);
        let (significand, shift) =
            if exponent == 0 { (fraction, 0) } else { (fraction | 0x0080_0000, exponent - 1) };
        let (mut limb, by) = (shift >> 5, shift & 31);
        // Two shifts, because one by 32 is not defined.
        let (low, high) = (significand << by, significand >> 1 >> (31 - by));
        let is_negative = bits >> 31 != 0;
        // SAFETY: the caller's promise; an exponent of 254 leaves two words for carries.
        unsafe {
            let mut carry = self.add_to_limb(words, limb, low, is_negative);
            carry = self.add_to_limb(words, limb + 1, high + carry, is_negative);
            limb += 2;
            while carry != 0 && limb < LIMBS {
                carry = self.add_to_limb(words, limb, carry, is_negative);
                limb += 1;
            }
        }
    }

    /// Adds `term` to a word, or subtracts it, and returns the carry for the next word.
    ///
    /// # Safety
    ///
    /// As [`add`](Self::add).
    #[inline(always)]
    unsafe fn add_to_limb(
        self,
        words: &mut SharedSlice<u32>,
        limb: u32,
        term: u32,
        is_negative: bool,
    ) -> u32 {
        let at = self.first + limb * self.stride;
        // SAFETY: the caller's promise.
        unsafe {
            let old = load_shared::<u32>(words, at);
            let (new, carries) = if is_negative {
                (old.wrapping_sub(term), old < term)
            } else {
                let new = old.wrapping_add(term);
                (new, new < term)
            };
            store_shared::<u32>(words, at, new);
            if carries { 1 } else { 0 }
        }
    }

    /// Returns the sum as an unevaluated pair of f64: the nearest f64, or of two the even one, and
    /// the f64 nearest to the rest, which is the rest itself if it has at most 53 bits. Zero is +0.
    ///
    /// # Safety
    ///
    /// As [`add`](Self::add).
    #[inline(always)]
    pub unsafe fn pair(self, words: &SharedSlice<u32>) -> (DoubleWords, DoubleWords) {
        let mut limbs = Limbs::uninit();
        // SAFETY: the caller's promise.
        unsafe {
            self.load(words, &mut limbs);
            let zero = DoubleWords { low: 0, high: 0 };
            let (mut high, mut low, mut is_negative, mut rest) = (zero, zero, false, 0);
            // A loop, so that the kernel has the code once.
            while rest < 2 {
                is_negative = make_positive(&mut limbs) != is_negative;
                high = low;
                low = signed(take_nearest(&mut limbs), is_negative);
                rest += 1;
            }
            (high, low)
        }
    }

    /// Returns the bits of the sum as an f32: the nearest f64, rounded to the nearest f32, or of
    /// two the even one. Zero is +0.
    ///
    /// # Safety
    ///
    /// As [`add`](Self::add).
    #[inline(always)]
    pub unsafe fn single(self, words: &SharedSlice<u32>) -> u32 {
        let mut limbs = Limbs::uninit();
        // SAFETY: the caller's promise.
        unsafe {
            self.load(words, &mut limbs);
            let is_negative = make_positive(&mut limbs);
            signed(take_nearest(&mut limbs), is_negative).single()
        }
    }

    /// Reads all limbs.
    #[inline(always)]
    unsafe fn load(self, words: &SharedSlice<u32>, limbs: &mut Limbs) {
        let mut index = 0;
        while index < LIMBS {
            // SAFETY: the caller's promise.
            unsafe {
                let word = load_shared::<u32>(words, self.first + index * self.stride);
                store_local(limbs, index, word);
            }
            index += 1;
        }
    }
}

/// Words of an integer in two's complement, in a lane's own memory.
type Limbs = MaybeUninit<[u32; LIMBS as usize]>;

/// Negates a negative integer. Returns whether it was one.
///
/// # Safety
///
/// All limbs were written.
#[inline(always)]
unsafe fn make_positive(limbs: &mut Limbs) -> bool {
    // SAFETY: the caller's promise.
    unsafe {
        let is_negative = load_local(limbs, LIMBS - 1) >> 31 != 0;
        if is_negative {
            let (mut carry, mut index) = (1u32, 0);
            while index < LIMBS {
                let word = (!load_local(limbs, index)).wrapping_add(carry);
                store_local(limbs, index, word);
                carry = if word < carry { 1 } else { 0 };
                index += 1;
            }
        }
        is_negative
    }
}

/// Returns limb `index`; 0 beyond the last.
///
/// # Safety
///
/// All limbs were written.
#[inline(always)]
unsafe fn limb(limbs: &Limbs, index: u32) -> u32 {
    // SAFETY: the guard, and the caller's promise.
    if index < LIMBS { unsafe { load_local(limbs, index) } } else { 0 }
}

/// Returns the f64 nearest to an integer that is not negative, in units of 2^-149; of two the even
/// one. Subtracts it from the integer.
///
/// # Safety
///
/// All limbs were written.
#[inline(always)]
unsafe fn take_nearest(limbs: &mut Limbs) -> DoubleWords {
    // SAFETY: the caller's promise; the first word of the mantissa is not beyond the last limb.
    unsafe {
        let mut top = LIMBS - 1;
        while top > 0 && load_local(limbs, top) == 0 {
            top -= 1;
        }
        let length = top * 32 + bit_length(load_local(limbs, top));
        // The integer is close to mantissa * 2^shift.
        #[allow(clippy::implicit_saturating_sub, reason = "rust-gpu has no saturating subtraction")]
        let shift = if length > 53 { length - 53 } else { 0 };
        let (first, by) = (shift >> 5, shift & 31);
        let words = (load_local(limbs, first), limb(limbs, first + 1), limb(limbs, first + 2));
        let mut mantissa =
            DoubleWords { low: window(words.0, words.1, by), high: window(words.1, words.2, by) };
        if rounds_up(limbs, shift, mantissa.low & 1 != 0) {
            mantissa.low = mantissa.low.wrapping_add(1);
            if mantissa.low == 0 {
                mantissa.high += 1;
            }
        }
        let mut borrow = subtract(limbs, first, mantissa.low << by, 0);
        borrow = subtract(limbs, first + 1, shifted(mantissa.low, mantissa.high, by), borrow);
        borrow = subtract(limbs, first + 2, shifted(mantissa.high, 0, by), borrow);
        let mut index = first + 3;
        while borrow != 0 && index < LIMBS {
            borrow = subtract(limbs, index, 0, borrow);
            index += 1;
        }
        encode(mantissa, shift)
    }
}

/// Subtracts from a limb, and returns what the next one owes. There is no limb beyond the last.
///
/// # Safety
///
/// All limbs were written.
#[inline(always)]
unsafe fn subtract(limbs: &mut Limbs, index: u32, term: u32, borrow: u32) -> u32 {
    if index >= LIMBS {
        return 0;
    }
    // SAFETY: the guard, and the caller's promise.
    unsafe {
        let old = load_local(limbs, index);
        let less = old.wrapping_sub(term);
        store_local(limbs, index, less.wrapping_sub(borrow));
        if old < term || less < borrow { 1 } else { 0 }
    }
}

/// Returns whether the bits below bit `shift` are more than half of it, or half of it where
/// `is_odd`.
///
/// # Safety
///
/// All limbs were written.
#[inline(always)]
unsafe fn rounds_up(limbs: &Limbs, shift: u32, is_odd: bool) -> bool {
    if shift == 0 {
        return false;
    }
    // SAFETY: the caller's promise.
    unsafe {
        let (half, bit) = ((shift - 1) >> 5, (shift - 1) & 31);
        let word = load_local(limbs, half);
        let mut below = word & ((1 << bit) - 1);
        let mut index = 0;
        while index < half {
            below |= load_local(limbs, index);
            index += 1;
        }
        word >> bit & 1 != 0 && (below != 0 || is_odd)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::PathKey;

    /// Accumulator of a lane among three.
    fn sum(terms: &[f32]) -> (f64, f64) {
        let mut memory = [0u32; 3 * LIMBS as usize];
        // SAFETY: nothing else accesses the memory.
        let mut words = unsafe { SharedSlice::new(memory.as_mut_ptr(), memory.len()) };
        let accumulator = Accumulator { first: 1, stride: 3 };
        // SAFETY: the words lie in the memory.
        let (high, low) = unsafe {
            terms.iter().for_each(|&x| accumulator.add(&mut words, x));
            accumulator.pair(&words)
        };
        for (index, word) in memory.iter().enumerate() {
            assert!(index % 3 == 1 || *word == 0, "the word of another lane was written");
        }
        let double = |words: DoubleWords| f64::from_bits(u64::from(words.high) << 32 | u64::from(words.low));
        (double(high), double(low))
    }

    #[test]
    fn one_number_is_itself() {
        let smallest = f32::from_bits(1);
        for x in [1.0, 0.1, f32::MAX, f32::MIN_POSITIVE, smallest, f32::from_bits(0x7f_ffff), 3e-39] {
            assert_eq!(sum(&[x]), (f64::from(x), 0.0), "{x}");
            assert_eq!(sum(&[-x]), (-f64::from(x), 0.0), "-{x}");
            assert_eq!(sum(&[x, -x]).0.to_bits(), 0, "{x} - {x}");
        }
        assert_eq!(sum(&[-0.0]).0.to_bits(), 0);
    }

    /// The extremes of f32, whose sum has 277 bits: the pair holds the first 53, and the first of
    /// the rest.
    #[test]
    fn nothing_is_lost() {
        let (most, least) = (f32::MAX, f32::from_bits(1));
        assert_eq!(sum(&[most, least]), (f64::from(most), f64::from(least)));
        assert_eq!(sum(&[most, -least]), (f64::from(most), -f64::from(least)));
        assert_eq!(sum(&[least, -most, most]), (f64::from(least), 0.0));
        assert_eq!(sum(&[-least, 1.0, -1.0]), (-f64::from(least), 0.0));
        // Carries and borrows through all words.
        assert_eq!(sum(&[1.0, -least, least, -1.0, -least]), (-f64::from(least), 0.0));
        // 2^53 + 1 is half way between two numbers: the even one, and the rest.
        let half = 9_007_199_254_740_992.0;
        assert_eq!(sum(&[half as f32, 1.0]), (half, 1.0));
        assert_eq!(sum(&[half as f32, 1.0, 2.0]), (half + 4.0, -1.0));
        assert_eq!(sum(&[-half as f32, -1.0, -2.0]), (-half - 4.0, 1.0));
        // All 53 bits are set, and round up to a power of two.
        assert_eq!(sum(&[half as f32, half as f32, -1.0]), (2.0 * half, -1.0));
    }

    /// Sums of random numbers of 60 binades, against integers of 128 bits.
    #[test]
    fn sums_are_those_of_integers() {
        let mut terms = [0.0f32; 200];
        let (mut want, unit) = (0i128, 2f64.powi(-54));
        for (i, term) in (0u32..).zip(&mut terms) {
            let w = PathKey { seed: 3, pixel: i, sample: 0 }.words(0);
            let exponent = 127 - 30 + w.x % 60;
            *term = f32::from_bits(w.y & 0x8000_0000 | exponent << 23 | w.z & 0x007f_ffff);
            want += (f64::from(*term) / unit) as i128;
        }
        let (high, low) = sum(&terms);
        assert_eq!(high, want as f64 * unit, "the nearest f64");
        assert_eq!((high / unit) as i128 + (low / unit) as i128, want);
        terms.reverse();
        assert_eq!(sum(&terms), (high, low));
        // Negative control: f64 alone rounds.
        assert_ne!(
            terms.iter().map(|&x| f64::from(x)).sum::<f64>(),
            terms.iter().rev().map(|&x| f64::from(x)).sum()
        );
    }
}
