//! Exact sums, which do not depend on the order or grouping of their terms.

use bytemuck::{Pod, Zeroable};

/// A sum as an unevaluated pair of f64: `high` is the sum rounded to nearest, `low` the rest.
///
/// Each addition is Knuth's TwoSum (The Art of Computer Programming, vol. 2, section 4.2.2, theorem
/// B), which gives the rounded sum of two numbers and its error, both exactly, whatever their
/// magnitudes. A second TwoSum normalises the pair. (Kahan's algorithm does not suffice: it assumes
/// that the sum is larger than the term.)
///
/// # When it is exact
///
/// Let each term be a multiple of 2^q, and each partial sum less than 2^E in magnitude. Then `low`
/// and TwoSum's error are at most 2^(E - 54) each, half a unit in the last place below 2^E, and
/// multiples of 2^q. So is their sum, at most 2^(E - 53), which f64 holds exactly as long as that
/// is at most 2^(53 + q). So the pair is the exact sum while **E - q ≤ 106**.
///
/// An f32 of magnitude 2^l or more is a multiple of 2^(l - 23). n of them below 2^m sum to less
/// than 2^E with E = m + log2 n. So the pair is exact while its terms, except zeros, span a ratio
/// of at most 2^(m - l) = 2^(83 - log2 n): 2^66 for the 2^17 chunks of 2^25 samples, 2^59 for the
/// maximum number of samples of a render. For sums of squares this is the ratio of the squares.
///
/// An exact sum has only one pair: `high` is its nearest f64, `low` the rest. So equal sums have
/// equal bits, however they were grouped. Beyond that ratio each addition may be off by 2^-106 of
/// the sum, and two groupings may differ by that.
///
/// Zero is +0. An infinite or NaN term makes the sum infinite or NaN (one bit pattern) with a `low`
/// of 0, in any order, too.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ExactSum {
    high: f64,
    low: f64,
}

/// Returns `a + b` rounded, and its error: Knuth's TwoSum, without a branch.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

impl ExactSum {
    /// Sum of no terms.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// Sum that is not known; it stays NaN whatever is added.
    pub const NAN: Self = Self { high: f64::NAN, low: 0.0 };

    /// Adds a number.
    #[inline(always)]
    pub fn add(&mut self, x: f64) {
        let (sum, error) = two_sum(self.high, x);
        if sum.is_finite() {
            let (high, low) = two_sum(sum, self.low + error);
            *self = Self { high, low };
        } else {
            // The sign and the payload of a NaN depend on the processor and on the order.
            *self = Self { high: if sum.is_nan() { f64::NAN } else { sum }, low: 0.0 };
        }
    }

    /// Adds another sum.
    #[inline(always)]
    pub fn merge(&mut self, other: Self) {
        self.add(other.high);
        self.add(other.low);
    }

    /// Returns the sum, rounded to nearest.
    #[inline]
    pub fn value(self) -> f64 {
        self.high
    }

    /// Returns the sum of these [parts](Self::parts).
    pub fn of_parts(high: f64, low: f64) -> Self {
        Self { high, low }
    }

    /// Returns the rounded sum, and the rest.
    pub fn parts(self) -> (f64, f64) {
        (self.high, self.low)
    }
}

impl From<f64> for ExactSum {
    #[inline]
    fn from(x: f64) -> Self {
        // -0 + 0 is +0.
        if x.is_nan() { Self::NAN } else { Self { high: x + 0.0, low: 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trisect_shared::rng::PathKey;

    /// Returns `count` f32s of random sign whose exponents span `bits`.
    fn numbers(seed: u32, count: u32, bits: u32) -> Vec<f32> {
        let number = |i| {
            let w = PathKey { seed, pixel: i, sample: 0 }.words(0);
            let exponent = 127 - bits / 2 + w.x % (bits + 1);
            f32::from_bits(w.y & 0x8000_0000 | exponent << 23 | w.z & 0x007f_ffff)
        };
        (0..count).map(number).collect()
    }

    /// Returns the numbers in an order that depends on `seed`.
    fn shuffled(numbers: &[f32], seed: u32) -> Vec<f32> {
        let mut numbers = numbers.to_vec();
        for i in (1..numbers.len()).rev() {
            let w = PathKey { seed, pixel: i as u32, sample: 1 }.words(0);
            numbers.swap(i, w.x as usize % (i + 1));
        }
        numbers
    }

    /// Returns the sum of the sums of two parts, and so on: another grouping than one by one.
    fn tree(numbers: &[f32], cut: usize) -> ExactSum {
        if let [x] = *numbers {
            return f64::from(x).into();
        }
        let (a, b) = numbers.split_at((cut % (numbers.len() - 1)) + 1);
        let mut sum = tree(a, cut / 2 + 1);
        sum.merge(tree(b, cut / 3 + 7));
        sum
    }

    fn one_by_one(numbers: &[f32]) -> ExactSum {
        let mut sum = ExactSum::ZERO;
        numbers.iter().for_each(|&x| sum.add(f64::from(x)));
        sum
    }

    fn bits(sum: ExactSum) -> (u64, u64) {
        (sum.high.to_bits(), sum.low.to_bits())
    }

    /// Returns whether ten orders and groupings give the same bits.
    fn agree(numbers: &[f32]) -> bool {
        let want = bits(one_by_one(numbers));
        (0..10).all(|seed| {
            let other = shuffled(numbers, seed);
            bits(one_by_one(&other)) == want && bits(tree(&other, 977 * seed as usize)) == want
        })
    }

    #[test]
    fn order_and_grouping_do_not_matter() {
        for bits in [0, 8, 30, 72] {
            // 2^10 numbers may span a ratio of 2^73.
            assert!(agree(&numbers(bits, 1 << 10, bits)), "{bits}");
        }
        // Negative control: far beyond the derived ratio the sum is not exact, and its grouping
        // shows.
        assert!(!agree(&numbers(5, 1 << 10, 180)), "the comparison detects nothing");
        // Sums in a single f64 differ where the pairs agree.
        let numbers = numbers(6, 1 << 10, 72);
        let plain = |numbers: &[f32]| numbers.iter().fold(0.0, |sum, &x| sum + f64::from(x));
        assert!((0..10).any(|seed| plain(&shuffled(&numbers, seed)) != plain(&numbers)));
    }

    /// The sum equals that of integers, for multiples of 2^-43 below 2^41 in magnitude.
    #[test]
    fn the_sum_is_exact() {
        let numbers: Vec<f32> = numbers(9, 1 << 12, 60).into_iter().map(|x| x * 1024.0).collect();
        let unit = f64::from(2f32.powi(-43));
        let want: i128 = numbers.iter().map(|&x| (f64::from(x) / unit) as i128).sum();
        let (high, low) = one_by_one(&numbers).parts();
        assert_eq!((high / unit) as i128 + (low / unit) as i128, want);
        assert!(low != 0.0, "the numbers need one f64 only");
    }

    #[test]
    fn cancellation_leaves_what_is_left() {
        for order in [[16_777_216.0f32, 1e-30, -16_777_216.0], [1e-30, 16_777_216.0, -16_777_216.0]] {
            assert_eq!(one_by_one(&order).value(), f64::from(1e-30f32));
        }
        assert_eq!(bits(one_by_one(&[-0.0, -0.0])), (0, 0));
        assert_eq!(bits(one_by_one(&[2.5, -2.5])), (0, 0));
    }

    #[test]
    fn what_is_not_finite_stays_so_in_any_order() {
        let (inf, nan) = (f32::INFINITY, f32::NAN);
        for order in [[1.0, inf, 2.0], [inf, 1.0, 2.0], [1.0, 2.0, inf]] {
            assert_eq!(bits(one_by_one(&order)), (f64::INFINITY.to_bits(), 0));
            assert_eq!(bits(tree(&order, 1)), (f64::INFINITY.to_bits(), 0));
        }
        for order in [[inf, -inf, 1.0], [1.0, -nan, 2.0], [nan, 1.0, inf]] {
            assert_eq!(bits(one_by_one(&order)), bits(ExactSum::NAN));
            assert_eq!(bits(tree(&order, 1)), bits(ExactSum::NAN));
        }
    }
}
