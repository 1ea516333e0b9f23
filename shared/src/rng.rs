//! Stateless random numbers for [`crate::sampler`] and [`crate::path`].
//!
//! A number is a function of (seed, pixel, sample, dimension), of integers only, so tiles, ranks,
//! resumed renders and backends draw the same numbers in any order. The hash is pcg4d (Jarzynski
//! and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020): four words in, four out, 20
//! integer operations. One call therefore serves a block of four dimensions, as many as a path
//! vertex needs.

/// Four random words of 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words {
    /// Word of dimension 4 b, for block b.
    pub x: u32,
    /// Word of dimension 4 b + 1.
    pub y: u32,
    /// Word of dimension 4 b + 2.
    pub z: u32,
    /// Word of dimension 4 b + 3.
    pub w: u32,
}

/// Key of a path: the three parts of a random number's argument that are constant along the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathKey {
    /// Seed of the render.
    pub seed: u32,
    /// Number of the pixel in the whole image, whichever tile or rank renders it, as
    /// [`pixel_number`](crate::sampler::pixel_number) returns it.
    pub pixel: u32,
    /// Index among all samples of the pixel.
    pub sample: u32,
}

impl PathKey {
    /// Returns the random words of dimensions 4 `block` to 4 `block` + 3. A path's blocks are
    /// numbered by vertex and use.
    #[inline(always)]
    pub fn words(self, block: u32) -> Words {
        pcg4d(Words { x: self.pixel, y: self.sample, z: block, w: self.seed })
    }
}

/// Returns the pcg4d hash of four words. Each word of the result depends on every word of the
/// argument.
#[inline(always)]
pub fn pcg4d(v: Words) -> Words {
    let mut x = v.x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let mut y = v.y.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let mut z = v.z.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let mut w = v.w.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
    w ^= w >> 16;
    x = x.wrapping_add(y.wrapping_mul(w));
    y = y.wrapping_add(z.wrapping_mul(x));
    z = z.wrapping_add(x.wrapping_mul(y));
    w = w.wrapping_add(y.wrapping_mul(z));
    Words { x, y, z, w }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::unit_f32;

    #[test]
    fn values_are_frozen() {
        // Films, checkpoints and ranks rely on these values: another value needs a new format.
        let w = PathKey { seed: 1, pixel: 2, sample: 3 }.words(4);
        assert_eq!((w.x, w.y, w.z, w.w), (951_139_602, 3_329_564_249, 363_923_550, 2_788_619_312));
    }

    /// Returns Pearson's statistic over 64 × 64 cells for a pair of dimensions.
    fn chi_square(pair: impl Fn(u32) -> (u32, u32), n: u32) -> f64 {
        let mut cells = [0u32; 64 * 64];
        for i in 0..n {
            let (a, b) = pair(i);
            let cell = (unit_f32(a) * 64.0) as usize * 64 + (unit_f32(b) * 64.0) as usize;
            cells[cell] += 1;
        }
        let expected = f64::from(n) / cells.len() as f64;
        cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum()
    }

    /// 4095 degrees of freedom: mean 4095, standard deviation 90.5. Five standard deviations,
    /// because 12 statistics are tested.
    const CHI_SQUARE_LIMIT: f64 = 4095.0 + 5.0 * 90.5;

    #[test]
    fn pairs_of_dimensions_fill_the_square() {
        type Walk = fn(u32) -> Words;
        let along: [(&str, Walk); 4] = [
            ("pixel", |i| PathKey { seed: 0, pixel: i, sample: 0 }.words(0)),
            ("sample", |i| PathKey { seed: 0, pixel: 12_345, sample: i }.words(1)),
            ("block", |i| PathKey { seed: 7, pixel: 1, sample: 0 }.words(i)),
            ("seed", |i| PathKey { seed: i, pixel: 1, sample: 0 }.words(2)),
        ];
        for (name, words) in along {
            let pairs: [fn(Words) -> (u32, u32); 3] = [|w| (w.x, w.y), |w| (w.z, w.w), |w| (w.y, w.z)];
            for pair in pairs {
                let statistic = chi_square(|i| pair(words(i)), 1 << 18);
                assert!(statistic < CHI_SQUARE_LIMIT, "along {name}: {statistic}");
            }
        }
    }

    #[test]
    fn negative_control_chi_square_finds_a_bias() {
        let words = |i| PathKey { seed: 0, pixel: i, sample: 0 }.words(0);
        let biased = |i| {
            let w: Words = words(i);
            (w.x | if i % 8 == 0 { 0x8000_0000 } else { 0 }, w.y)
        };
        assert!(chi_square(biased, 1 << 18) > CHI_SQUARE_LIMIT);
    }

    #[test]
    fn neighbouring_samples_are_uncorrelated() {
        // Product moment of dimension 0 over neighbouring pixels, samples, blocks; 5 sigma of 2^18
        // products.
        let value = |key: PathKey, block| f64::from(unit_f32(key.words(block).x)) - 0.5;
        let n = 1u32 << 18;
        for step in 0..3 {
            let sum: f64 = (0..n)
                .map(|i| {
                    let key = PathKey { seed: 3, pixel: i & 511, sample: i >> 9 };
                    let next = match step {
                        0 => value(PathKey { pixel: key.pixel + 1, ..key }, 0),
                        1 => value(PathKey { sample: key.sample + 1, ..key }, 0),
                        _ => value(key, 1),
                    };
                    value(key, 0) * next * 12.0
                })
                .sum();
            let sigmas = sum / f64::from(n).sqrt();
            assert!(sigmas.abs() < 5.0, "step {step}: {sigmas}");
        }
    }
}
