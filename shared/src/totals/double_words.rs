//! An f64 as two words, for devices without one.

/// An f64 as two words: bits 0 to 31 and 32 to 63.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DoubleWords {
    /// Bits 0 to 31.
    pub low: u32,
    /// Bits 32 to 63.
    pub high: u32,
}

impl DoubleWords {
    /// Returns the bits of a finite number as an f32: the nearest, or of two the even one; an
    /// infinity beyond the greatest.
    #[inline(always)]
    pub fn single(self) -> u32 {
        let sign = self.high & 0x8000_0000;
        // Exponent as f32 has it, plus 896.
        let exponent = self.high >> 20 & 0x7ff;
        if exponent < 896 - 24 {
            return sign;
        }
        if exponent > 896 + 254 {
            return sign | 0x7f80_0000;
        }
        let mut significand = 0x0080_0000 | (self.high & 0x000f_ffff) << 3 | self.low >> 29;
        let mut below = self.low << 3;
        if exponent <= 896 {
            // Subnormal: the exponent is that of 1, and the significand has fewer bits.
            let by = 897 - exponent;
            below = significand << 1 << (31 - by) | if below != 0 { 1 } else { 0 };
            significand >>= by;
        } else {
            significand += (exponent - 897) << 23;
        }
        let rounds_up = below > 0x8000_0000 || below == 0x8000_0000 && significand & 1 != 0;
        sign | (significand + if rounds_up { 1 } else { 0 })
    }
}

/// Sets the sign of a number that is not negative; zero stays +0.
#[inline(always)]
pub(super) fn signed(magnitude: DoubleWords, is_negative: bool) -> DoubleWords {
    let sign = if is_negative && magnitude.low | magnitude.high != 0 { 0x8000_0000 } else { 0 };
    DoubleWords { high: magnitude.high | sign, ..magnitude }
}

/// Returns the number of bits up to the highest that is set.
#[inline(always)]
pub(super) fn bit_length(word: u32) -> u32 {
    let (mut rest, mut length, mut half) = (word, 0, 16);
    while half > 0 {
        if rest >> half != 0 {
            rest >>= half;
            length += half;
        }
        half >>= 1;
    }
    length + rest
}

/// Returns bits `from` to `from + 31` of two words.
#[inline(always)]
pub(super) fn window(low: u32, high: u32, from: u32) -> u32 {
    low >> from | high << 1 << (31 - from)
}

/// Returns the bits of `high` and `low`, shifted left by `by`, that the second word has.
#[inline(always)]
pub(super) fn shifted(low: u32, high: u32, by: u32) -> u32 {
    high << by | low >> 1 >> (31 - by)
}

/// Returns mantissa * 2^(shift - 149) as an f64; the mantissa is at most 2^53.
#[inline(always)]
pub(super) fn encode(mantissa: DoubleWords, shift: u32) -> DoubleWords {
    let DoubleWords { mut low, mut high } = mantissa;
    let (below, word) = if high != 0 { (32, high) } else { (0, low) };
    let length = below + bit_length(word);
    if length == 0 {
        return mantissa;
    }
    if length > 53 {
        // Rounding up made a power of two of it.
        (low, high) = (window(low, high, 1), high >> 1);
    } else {
        let by = 53 - length;
        if by >= 32 {
            (low, high) = (0, low << (by - 32));
        } else {
            (low, high) = (low << by, shifted(low, high, by));
        }
    }
    // Bit 52 is not stored; f64's exponents have a bias of 1023.
    DoubleWords { low, high: (high & 0x000f_ffff) | (length - 1 + shift + 1023 - 149) << 20 }
}

#[cfg(test)]
mod tests {
    use super::DoubleWords;
    use crate::rng::PathKey;

    /// Rounding to f32 is that of the processor, also half way, among subnormal numbers and beyond
    /// the greatest.
    #[test]
    fn rounded_to_single() {
        let round = |x: f64| {
            let bits = x.to_bits();
            f32::from_bits(DoubleWords { low: bits as u32, high: (bits >> 32) as u32 }.single())
        };
        let check = |x: f64| {
            assert_eq!(round(x).to_bits(), (x as f32).to_bits(), "{x:e}");
            assert_eq!(round(-x).to_bits(), (-x as f32).to_bits(), "-{x:e}");
        };
        for x in [0.0, 1e39, 3.5e38, f64::from(f32::MAX), 1e-46, 1e-300, 7e-46, 7.1e-46, f64::MAX] {
            check(x);
        }
        for pixel in 0..20_000u32 {
            let words = PathKey { seed: 5, pixel, sample: 0 }.words(0);
            let exponent = words.z % 300 + 860;
            // Many of them half way between two f32, or next to that.
            let low = match words.w % 4 {
                0 => 0x1000_0000,
                1 => 0x1000_0001,
                2 => 0x0fff_ffff,
                _ => words.x & 0x1fff_ffff,
            } | words.x & 0xe000_0000;
            let high = u64::from(exponent << 20 | words.y & 0x000f_ffff);
            check(f64::from_bits(high << 32 | u64::from(low)));
        }
    }
}
