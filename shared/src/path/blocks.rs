//! Numbers of the blocks of random words that a path takes.
//!
//! The kind of a block is in the low bits: words of blocks that differ in the highest bits only
//! would be correlated, because the hash of [`crate::rng`] carries differences upwards.

/// Block of the camera ray.
pub(super) const CAMERA: u32 = 0;

/// Number of bits of the kind.
const KIND_BITS: u32 = 3;

/// Returns the block for scattering at the vertex where segment `segment`, from 1 on, ends.
#[inline(always)]
pub(super) fn scattering(segment: u32) -> u32 {
    segment << KIND_BITS
}

/// Returns the block for the point of a light.
#[inline(always)]
pub(super) fn light(segment: u32) -> u32 {
    segment << KIND_BITS | 1
}

/// Returns the block for the choice between the sky and other lights, and of how to sample the sky.
#[inline(always)]
pub(super) fn environment(segment: u32) -> u32 {
    segment << KIND_BITS | 2
}

/// Returns the block for passing a surface that is not opaque, after `passes` others.
#[inline(always)]
pub(super) fn passing(segment: u32, passes: u32) -> u32 {
    (segment << 10 | passes) << KIND_BITS | 3
}

/// Returns the block for the colour of the light that a transmission keeps.
#[inline(always)]
pub(super) fn color(segment: u32) -> u32 {
    segment << KIND_BITS | 4
}

/// Returns the block for the choice of a refracted connection, or for the start of one of its
/// walks, up to 1023.
#[inline(always)]
pub(super) fn refracted(segment: u32, walk: u32) -> u32 {
    (segment << 10 | walk) << KIND_BITS | 5
}

/// Returns the block for the flight of a path's ray through a medium, after `passes` surfaces that
/// the path passed.
#[inline(always)]
pub(super) fn flight(segment: u32, passes: u32) -> u32 {
    (segment << 10 | passes) << KIND_BITS | 6
}

/// Returns the block for the flight of a shadow ray, as [`flight`].
#[inline(always)]
pub(super) fn shadow_flight(segment: u32, passes: u32) -> u32 {
    (segment << 10 | passes) << KIND_BITS | 7
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::{FeatureSet, SOBOL};
    use crate::rng::{PathKey, Words};
    use crate::sampler::words;

    /// Returns how many standard deviations Pearson's statistic of two words lies above its mean,
    /// over 16 x 16 cells and 2^16 keys.
    fn deviation(pair: impl Fn(u32) -> (u32, u32)) -> f64 {
        let mut cells = [0u32; 256];
        for index in 0..1 << 16 {
            let (a, b) = pair(index);
            cells[(a >> 28 << 4 | b >> 28) as usize] += 1;
        }
        let statistic: f64 = cells.iter().map(|&c| (f64::from(c) - 256.0).powi(2) / 256.0).sum();
        (statistic - 255.0) / 510f64.sqrt()
    }

    /// Words of different blocks are independent: over pixels for independent words, over tiles for
    /// the Sobol sequence.
    #[test]
    fn blocks_are_independent() {
        let key = |pixel| PathKey { seed: 5, pixel, sample: 1 };
        let independent = |i, block| words(FeatureSet::<0>::ALL, key(i), block);
        let sobol = |i: u32, block| words(FeatureSet::<SOBOL>::ALL, key(i << 16), block);
        let samplers: [&dyn Fn(u32, u32) -> Words; 2] = [&independent, &sobol];
        let parts: [fn(Words) -> u32; 4] = [|w| w.x, |w| w.y, |w| w.z, |w| w.w];
        let blocks = [
            CAMERA,
            scattering(1),
            scattering(2),
            light(1),
            light(2),
            environment(1),
            passing(1, 0),
            color(1),
            refracted(1, 0),
            refracted(1, 1),
            refracted(2, 0),
            flight(1, 0),
            shadow_flight(1, 0),
        ];
        for words in samplers {
            for part in parts {
                for (index, &a) in blocks.iter().enumerate() {
                    for &b in &blocks[..index] {
                        let off = deviation(|i| (part(words(i, a)), part(words(i, b))));
                        assert!(off < 6.0, "blocks {a:x} and {b:x}: {off} sigma");
                    }
                }
            }
        }
        // Negative control: the kind in the highest bits.
        let off = deviation(|i| (independent(i, 1).x, independent(i, 0x8000_0001).x));
        assert!(off > 100.0, "a test that cannot fail: {off}");
    }
}
