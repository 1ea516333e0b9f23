//! Random words of a path: independent ([`crate::rng`]) or from an Owen-scrambled Sobol sequence.
//!
//! Source: Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020. The four words of a
//! block are two pairs. Each pair is a point of the two-dimensional Sobol sequence, a (0,
//! 2)-sequence, with its own scrambling and its own order of the samples (padding). Like the
//! independent words they are a function of seed, pixel, sample and block, without state.

use crate::features::{FeatureSet, Features, SOBOL};
use crate::rng::{PathKey, Words, pcg4d};

/// Returns the words of `block` by the sampler of the kernel.
#[inline(always)]
pub fn words<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, key: PathKey, block: u32) -> Words {
    if features.has::<SOBOL>() { sobol(key, block) } else { key.words(block) }
}

/// Returns two scrambled points of the Sobol sequence.
#[inline(always)]
fn sobol(key: PathKey, block: u32) -> Words {
    // The keys are equal for all samples of a pixel and block; the constants tell them from the
    // keys of independent words.
    let first = pcg4d(Words { x: key.pixel, y: 0x5b8d_6f3a, z: block, w: key.seed });
    let second = pcg4d(Words { x: key.pixel, y: 0xc2f1_947d, z: block, w: key.seed });
    let (x, y) = pair(key.sample, first.x, first.y, first.z);
    let (z, w) = pair(key.sample, second.x, second.y, second.z);
    Words { x, y, z, w }
}

#[inline(always)]
fn pair(sample: u32, order: u32, scramble_x: u32, scramble_y: u32) -> (u32, u32) {
    let index = owen(sample.reverse_bits(), order).reverse_bits();
    // Dimension 0 is the bit-reversed index; scrambling takes its bits reversed once more.
    (owen(index, scramble_x).reverse_bits(), owen(pascal(index), scramble_y).reverse_bits())
}

/// Returns dimension 1 of the Sobol sequence with its bits reversed: the index times Pascal's
/// triangle modulo 2. That is the sum over supersets of bit positions (Lucas), in five steps.
#[inline(always)]
fn pascal(index: u32) -> u32 {
    let mut x = index;
    x ^= (x & 0xaaaa_aaaa) >> 1;
    x ^= (x & 0xcccc_cccc) >> 2;
    x ^= (x & 0xf0f0_f0f0) >> 4;
    x ^= (x & 0xff00_ff00) >> 8;
    x ^= (x & 0xffff_0000) >> 16;
    x
}

/// Returns a hash in which each bit depends on lower bits only; on reversed bits that is Owen's
/// nested uniform scrambling (Laine and Karras, EGSR 2011; the constants are Vegdahl's, "Building a
/// Better LK Hash", 2021).
#[inline(always)]
fn owen(x: u32, seed: u32) -> u32 {
    let mut x = x ^ x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul(seed >> 16 | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::SOBOL;

    fn key(pixel: u32, sample: u32) -> PathKey {
        PathKey { seed: 9, pixel, sample }
    }

    /// Checks against the direction numbers of dimension 1 by their definition, from the polynomial
    /// x + 1.
    #[test]
    fn pascal_is_sobols_second_dimension() {
        for index in 0..4096u32 {
            let (mut want, mut v, mut bits) = (0u32, 1u32 << 31, index);
            while bits != 0 {
                if bits & 1 != 0 {
                    want ^= v;
                }
                v ^= v >> 1;
                bits >>= 1;
            }
            assert_eq!(pascal(index).reverse_bits(), want);
        }
    }

    /// Returns whether each of the 2ᵏ elementary intervals of each shape holds one of the first 2ᵏ
    /// points, k = `log_n`.
    fn is_net(points: impl Fn(u32) -> (u32, u32), log_n: u32) -> bool {
        (0..=log_n).all(|across| {
            let mut seen = [false; 256];
            for sample in 0..1 << log_n {
                let (x, y) = points(sample);
                let column = if across == 0 { 0 } else { x >> (32 - across) };
                let row = if across == log_n { 0 } else { y >> (32 - (log_n - across)) };
                seen[(column << (log_n - across) | row) as usize] = true;
            }
            seen[..1 << log_n].iter().all(|&s| s)
        })
    }

    #[test]
    fn pairs_are_nets() {
        for pixel in 0..20 {
            for block in [0, 1, 0x8000_0001] {
                let at = |s| words(FeatureSet::<SOBOL>::ALL, key(pixel, s), block);
                for log_n in [4, 8] {
                    assert!(is_net(|s| (at(s).x, at(s).y), log_n));
                    assert!(is_net(|s| (at(s).z, at(s).w), log_n));
                    assert!(is_net(|s| (at(s + (1 << log_n)).x, at(s + (1 << log_n)).y), log_n));
                }
            }
        }
        let independent = |s| (key(3, s).words(0).x, key(3, s).words(0).y);
        assert!(!is_net(independent, 4), "a test that cannot fail");
    }

    /// Over pixels, a sample's words are uniform and its two pairs are independent: chi-square, 64
    /// × 64 cells, five sigma.
    #[test]
    fn scrambling_is_uniform() {
        let pairs: [fn(Words) -> (u32, u32); 3] = [|w| (w.x, w.y), |w| (w.x, w.z), |w| (w.y, w.w)];
        for sample in [0, 1, 77] {
            for pair in pairs {
                let mut cells = [0u32; 4096];
                for pixel in 0..1 << 18 {
                    let (a, b) = pair(words(FeatureSet::<SOBOL>::ALL, key(pixel, sample), 1));
                    cells[((a >> 26) << 6 | b >> 26) as usize] += 1;
                }
                let statistic: f64 = cells.iter().map(|&c| (f64::from(c) - 64.0).powi(2) / 64.0).sum();
                assert!(statistic < 4095.0 + 5.0 * 90.5, "{sample}: {statistic}");
            }
        }
    }
}
