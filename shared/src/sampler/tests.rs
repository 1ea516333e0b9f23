//! Tests of the sampler: nets of a pixel and of blocks of pixels, uniformity, independence.

use super::*;

/// Width of the images of these tests, in pixels: two tiles and a part of a third.
const WIDTH: u32 = 600;

fn key(x: u32, y: u32, sample: u32) -> PathKey {
    PathKey { seed: 9, pixel: screen_code(WIDTH, x, y), sample }
}

fn sobol_words(key: PathKey, block: u32) -> Words {
    words(FeatureSet::<SOBOL>::ALL, key, block)
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

/// Returns whether each of the 2ᵏ elementary intervals of each shape holds one of these 2ᵏ points.
/// Shapes are those whose number of columns is a power of 2 to the `step`.
fn is_net(points: &[(u32, u32)], step: usize) -> bool {
    let log_n = points.len().ilog2();
    (0..=log_n).step_by(step).all(|across| {
        let mut seen = [false; 4096];
        for (x, y) in points {
            let column = if across == 0 { 0 } else { x >> (32 - across) };
            let row = if across == log_n { 0 } else { y >> (32 - (log_n - across)) };
            seen[(column << (log_n - across) | row) as usize] = true;
        }
        seen[..points.len()].iter().all(|&s| s)
    })
}

const FIRST: fn(Words) -> (u32, u32) = |w| (w.x, w.y);
const SECOND: fn(Words) -> (u32, u32) = |w| (w.z, w.w);

#[test]
fn pairs_are_nets() {
    for pixel in 0..20 {
        for block in [0, 1, 0x8000_0001] {
            for (n, start) in [(16u32, 0), (256, 0), (16, 16), (256, 256), (8, 24)] {
                for pair in [FIRST, SECOND] {
                    let at = |s: u32| pair(sobol_words(key(37 * pixel, 11 * pixel, start + s), block));
                    let mut points = [(0, 0); 256];
                    (0..n).for_each(|s| points[s as usize] = at(s));
                    assert!(is_net(&points[..n as usize], 1), "{pixel} {block} {n}");
                }
            }
        }
    }
    let independent = core::array::from_fn::<_, 16, _>(|s| FIRST(key(3, 0, s as u32).words(0)));
    assert!(!is_net(&independent, 1), "a test that cannot fail");
}

/// Returns the points of samples `start` to `start` + `n` of the block of `edge` x `edge` pixels at
/// (`x`, `y`), and their number. Each pixel has seed 9, or with `apart` its own.
fn block_of_pixels(
    (x, y, edge): (u32, u32, u32),
    (start, n): (u32, u32),
    pair: fn(Words) -> (u32, u32),
    apart: bool,
) -> ([(u32, u32); 4096], usize) {
    let (mut points, mut count) = ([(0, 0); 4096], 0);
    for pixel in 0..edge * edge {
        for sample in start..start + n {
            let key = key(x + pixel % edge, y + pixel / edge, sample);
            let seed = if apart { pixel } else { key.seed };
            points[count] = pair(sobol_words(PathKey { seed, ..key }, 17));
            count += 1;
        }
    }
    (points, count)
}

/// The first 1, 4, 16, 64 samples of the pixels of an aligned block are together a net in base 4.
#[test]
fn blocks_of_pixels_are_nets() {
    for edge in [1, 2, 4, 8, 16] {
        for n in [1, 4, 16, 64, 256] {
            if edge * edge * n > 4096 {
                continue;
            }
            for (x, y) in [(0, 0), (3 * edge, 5 * edge), (256 + 2 * edge, 256 + edge)] {
                for pair in [FIRST, SECOND] {
                    for start in [0, 3 * n] {
                        let (points, count) = block_of_pixels((x, y, edge), (start, n), pair, false);
                        assert!(is_net(&points[..count], 2), "{edge} pixels, {n} samples at {x}, {y}");
                    }
                    // Negative controls: pixels with scramblings of their own; a block that is not
                    // aligned.
                    if edge >= 4 {
                        let (points, count) = block_of_pixels((x, y, edge), (0, n), pair, true);
                        assert!(!is_net(&points[..count], 2), "a test that cannot fail");
                        let (points, count) = block_of_pixels((x + 1, y, edge), (0, n), pair, false);
                        assert!(!is_net(&points[..count], 2), "a test that cannot fail");
                    }
                }
            }
        }
    }
}

/// The pixels of a block of 2 x 2 are together a net in base 2 for each power of two of samples.
#[test]
fn four_pixels_are_nets_in_base_two() {
    for n in [1, 2, 4, 8, 16, 32] {
        let (points, count) = block_of_pixels((38, 14, 2), (0, n), FIRST, false);
        assert!(is_net(&points[..count], 1), "{n} samples");
    }
}

/// No two pixels of an image have the same number.
#[test]
fn pixels_have_numbers_of_their_own() {
    let features = FeatureSet::<SOBOL>::ALL;
    for (width, height) in [(1, 600), (257, 300), (512, 256), (600, 3)] {
        let mut seen = [[0u64; 1024]; 9];
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let number = pixel_number(features, width, x, y);
            let (word, bit) =
                (&mut seen[(number >> 16) as usize][(number & PLACE) as usize / 64], number % 64);
            assert_eq!(*word >> bit & 1, 0, "({x}, {y}) of {width} x {height}");
            *word |= 1 << bit;
        }
    }
    assert_eq!(pixel_number(FeatureSet::<0>::ALL, 600, 7, 2), 1207);
}

/// Returns Pearson's statistic of pairs of words over 64 x 64 cells.
fn chi_square(pair: impl Fn(u32) -> (u32, u32)) -> f64 {
    let mut cells = [0u32; 4096];
    for i in 0..1 << 18 {
        let (a, b) = pair(i);
        cells[((a >> 26) << 6 | b >> 26) as usize] += 1;
    }
    cells.iter().map(|&c| (f64::from(c) - 64.0).powi(2) / 64.0).sum()
}

/// 4095 degrees of freedom: mean 4095, standard deviation 90.5; five standard deviations.
const CHI_SQUARE_LIMIT: f64 = 4095.0 + 5.0 * 90.5;

/// Over tiles and seeds, a sample's words are uniform and its two pairs are independent.
#[test]
fn scrambling_is_uniform() {
    let pairs: [fn(Words) -> (u32, u32); 3] = [|w| (w.x, w.y), |w| (w.x, w.z), |w| (w.y, w.w)];
    for sample in [0, 1, 77] {
        for pair in pairs {
            let statistic = chi_square(|i| {
                let key = PathKey { seed: i >> 16, pixel: i << 16 | 1234, sample };
                pair(sobol_words(key, 1))
            });
            assert!(statistic < CHI_SQUARE_LIMIT, "{sample}: {statistic}");
        }
    }
}

/// Over the pixels of four tiles, each pair fills the square more evenly than independent points,
/// and words of different pairs and blocks as evenly as these.
#[test]
fn pixels_fill_the_square() {
    let pixel = |i: u32| key(i & 511, i >> 9, 0);
    for block in [8, 9] {
        let even = chi_square(|i| FIRST(sobol_words(pixel(i), block)));
        assert!(even < 0.01 * 4095.0, "{even}");
        let across = chi_square(|i| {
            let w = sobol_words(pixel(i), block);
            (w.x, w.w)
        });
        let blocks = chi_square(|i| (sobol_words(pixel(i), block).y, sobol_words(pixel(i), block + 1).y));
        assert!(across < 2.0 * 4095.0 && blocks < 2.0 * 4095.0, "{across} {blocks}");
    }
    // Negative control: the same pair twice.
    assert!(chi_square(|i| (sobol_words(pixel(i), 8).x, sobol_words(pixel(i), 8).x)) > 10.0 * 4095.0);
}
