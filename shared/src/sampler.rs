//! Random words of a path: independent ([`crate::rng`]) or from a Sobol sequence with the error of
//! blue noise over the screen.
//!
//! The four words of a block are two pairs. Each pair is a point of the two-dimensional Sobol
//! sequence, a (0, 2)-sequence, with its own scrambling and its own order of the samples (Burley,
//! "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). Like the independent words they are a
//! function of seed, pixel, sample and block, without state.
//!
//! The pixels of a tile of 256 x 256 share this sequence, and each has a digital shift of its own.
//! The shifts make the samples of neighbours complement each other: the first 4ᵏ samples of all
//! pixels of an aligned block of 2ᵐ x 2ᵐ pixels are together a (0, k + m, 2)-net in base 4, for all
//! k + m up to 8. So the errors of neighbours differ, and a filter, or the eye, averages them out.
//! The number of samples of the render is not needed (as it is by Ahmed and Wonka, "Screen-Space
//! Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels", 2020).
//!
//! The construction: let P be Pascal's triangle and w a generator of GF(4). The Faure sequences of
//! P⁰, P¹ and P to the power w over GF(4), and the index, are the four coordinates of a (0, n,
//! 4)-net in base 4. One of them is read as the number of the pixel along the Morton curve, one as
//! the index of the sample, two as the point. With other orders of samples and pixels, which keep
//! aligned blocks, the two become the Sobol sequence of the sample plus a linear function of the
//! digits a of the pixel: w Pʷ a for dimension 0, and P w² Pʷ a for dimension 1.

use crate::features::{FeatureSet, Features, SOBOL};
use crate::rng::{PathKey, Words, pcg4d};

/// Binary logarithm of the edge of the tiles whose pixels share a sequence.
const LOG_TILE: u32 = 8;

/// Bits of a [`screen_code`] that are the place of a pixel in its tile.
const PLACE: u32 = 0xffff;

/// Returns the words of `block` by the sampler of the kernel. `key.pixel` is a [`pixel_number`].
#[inline(always)]
pub fn words<const POSSIBLE: Features>(features: FeatureSet<POSSIBLE>, key: PathKey, block: u32) -> Words {
    if features.has::<SOBOL>() { sobol(key, block) } else { key.words(block) }
}

/// Returns the number by which the sampler of the kernel knows pixel (`x`, `y`) of an image `width`
/// pixels wide: the row-major index for independent words, else the `screen_code`.
#[inline(always)]
pub fn pixel_number<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    width: u32,
    x: u32,
    y: u32,
) -> u32 {
    if features.has::<SOBOL>() { screen_code(width, x, y) } else { y * width + x }
}

/// Returns the index of a pixel's tile in the high half, and in the low half the pixel's place in
/// the tile along the Morton curve, its most significant bit first. Two pixels have the same code
/// only if the image has more than 65,536 tiles.
#[inline(always)]
fn screen_code(width: u32, x: u32, y: u32) -> u32 {
    let tiles_across = (width.wrapping_sub(1) >> LOG_TILE) + 1;
    let tile = (y >> LOG_TILE) * tiles_across + (x >> LOG_TILE);
    // Both coordinates at once: a zero before each bit.
    let mut bits = x & 0xff | (y & 0xff) << 16;
    bits = (bits | bits << 4) & 0x0f0f_0f0f;
    bits = (bits | bits << 2) & 0x3333_3333;
    bits = (bits | bits << 1) & 0x5555_5555;
    tile << 16 | (bits | bits >> 15).reverse_bits() >> 16
}

/// Returns two scrambled points of the Sobol sequence.
#[inline(always)]
fn sobol(key: PathKey, block: u32) -> Words {
    // The keys are equal for all samples and pixels of a tile; the constants tell them from the
    // keys of independent words.
    let (tile, place) = (key.pixel >> 16, key.pixel & PLACE);
    let first = pcg4d(Words { x: tile, y: 0x5b8d_6f3a, z: block, w: key.seed });
    let second = pcg4d(Words { x: tile, y: 0xc2f1_947d, z: block, w: key.seed });
    // Each pair has its own order of the pixels. The bits above the place are a hash of it.
    let (a, b) = (owen(place, first.w), owen(place, second.w));
    let (shift_x, shift_y) = shifts(a & PLACE | b << 16);
    let (x, y) = pair(key.sample, first, shift_x & PLACE, shift_y & PLACE, a & !PLACE);
    let (z, w) = pair(key.sample, second, shift_x >> 16, shift_y >> 16, b & !PLACE);
    Words { x, y, z, w }
}

/// Returns the digital shifts of dimension 0, and of dimension 1 before its matrix, for the eight
/// digits of a pixel in the low half of `digits`; and those of another in the high half. Digits are
/// elements of GF(4), the most significant one is lowest.
#[inline(always)]
fn shifts(digits: u32) -> (u32, u32) {
    // P to the power w: digit j adds w^(j - i) times itself to each digit i whose bits are a subset
    // of those of j. The powers of w for a step of 1, 2 and 4 digits are w, w² and w.
    let mut v = digits;
    v ^= times_w((v & 0xcccc_cccc) >> 2);
    let pairs = (v & 0xf0f0_f0f0) >> 4;
    v ^= times_w(pairs) ^ pairs;
    v ^= times_w((v & 0xff00_ff00) >> 8);
    let product = times_w(v);
    (product, product ^ v)
}

/// Returns each digit of two bits times w, where w² = w + 1.
#[inline(always)]
fn times_w(v: u32) -> u32 {
    (v ^ v << 1) & 0xaaaa_aaaa | v >> 1 & 0x5555_5555
}

/// Returns a point of the sequence of `keys`, with the shifts of the pixel. `low` has random bits
/// for the digits below those of the shifts.
#[inline(always)]
fn pair(sample: u32, keys: Words, shift_x: u32, shift_y: u32, low: u32) -> (u32, u32) {
    let index = owen(sample.reverse_bits(), keys.x).reverse_bits();
    // Dimension 0 is the bit-reversed index; scrambling takes its bits reversed once more.
    let x = owen(index ^ shift_x ^ low, keys.y).reverse_bits();
    let y = owen(pascal(index ^ shift_y) ^ low, keys.z).reverse_bits();
    (x, y)
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
mod tests;
