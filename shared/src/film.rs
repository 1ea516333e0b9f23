//! What a pixel gathers.

use crate::math::all_finite;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Samples that a kernel sums in f32, with the rounding errors kept in a [`Compensation`], before the host adds the sum to its own.
pub const CHUNK_SAMPLES: u32 = 256;

/// Sums over samples of one pixel, in index order. 32 bytes.
///
/// Fresh memory holds [`PixelSums::UNWRITTEN`], so that a pixel that no kernel wrote shows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PixelSums {
    /// Of the radiance.
    pub radiance: Vec3,
    /// How many samples were added; those that would make the radiance NaN or infinite are not.
    pub samples: u32,
    /// Of the squared radiance, by channel: the pixel's variance.
    pub squares: Vec3,
    /// Path segments traced, of all samples.
    pub segments: u32,
}

const _: () = assert!(size_of::<PixelSums>() == 32 && align_of::<PixelSums>() == 16);

impl PixelSums {
    /// No sample yet.
    pub const ZERO: Self = Self { radiance: Vec3::ZERO, samples: 0, squares: Vec3::ZERO, segments: 0 };

    /// What a film is filled with before a launch: NaN sums (each byte is 0xff, as a device's memset can write).
    pub const UNWRITTEN: Self = Self {
        radiance: Vec3::splat(f32::from_bits(u32::MAX)),
        samples: u32::MAX,
        squares: Vec3::splat(f32::from_bits(u32::MAX)),
        segments: u32::MAX,
    };

    /// Adds one sample of radiance, unless the sum would be NaN or infinite, and to `compensation` what the sum rounded off.
    ///
    /// Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen", ZAMM 54, 1974, with the error of each addition
    /// by Knuth's TwoSum, which has no branch. A compiler that may reassociate would find each error to be 0: it must not see that
    /// what is subtracted was just added, and so both pass through an exclusive or with `zero`, a word that is 0 and that no compiler
    /// knows. The squares are summed plainly: they tell the variance, which no one needs to 1e-5.
    #[inline(always)]
    pub fn add(&mut self, radiance: Vec3, compensation: &mut Compensation, zero: u32) {
        let sum = hide_from_compiler(self.radiance + radiance, zero);
        // A NaN or an infinity makes the sum one, and so does what is too bright for it.
        if all_finite(sum) {
            let added = hide_from_compiler(sum - self.radiance, zero);
            compensation.radiance += (self.radiance - (sum - added)) + (radiance - added);
            self.radiance = sum;
            self.squares += radiance * radiance;
            self.samples += 1;
        }
    }

    /// After the chunk's last sample: the sum rounded once.
    #[inline(always)]
    pub fn compensate(&mut self, compensation: Compensation) {
        self.radiance += compensation.radiance;
    }
}

/// `v`, if `zero` is 0. LLVM does not reassociate: there it costs nothing.
#[inline(always)]
fn hide_from_compiler(v: Vec3, zero: u32) -> Vec3 {
    if cfg!(target_arch = "nvptx64") {
        return v;
    }
    let hide = |x: f32| f32::from_bits(x.to_bits() ^ zero);
    Vec3::new(hide(v.x), hide(v.y), hide(v.z))
}

/// What the f32 sums of an unfinished chunk rounded off. 16 bytes; it stays on the device, for the launch that goes on.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Compensation {
    /// To add to [`PixelSums::radiance`].
    pub radiance: Vec3,
    /// Unused.
    pub pad: u32,
}

const _: () = assert!(size_of::<Compensation>() == 16 && align_of::<Compensation>() == 16);

impl Compensation {
    /// Nothing yet.
    pub const ZERO: Self = Self { radiance: Vec3::ZERO, pad: 0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_out_what_is_not_finite() {
        let (mut sums, mut compensation) = (PixelSums::ZERO, Compensation::ZERO);
        sums.add(Vec3::new(1.0, 2.0, 3.0), &mut compensation, 0);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            sums.add(Vec3::new(bad, 0.0, 0.0), &mut compensation, 0);
            sums.add(Vec3::new(0.0, bad, 0.0), &mut compensation, 0);
            sums.add(Vec3::new(0.0, 0.0, bad), &mut compensation, 0);
        }
        // Finite alone, not together.
        let mut bright = PixelSums::ZERO;
        (0..3).for_each(|_| bright.add(Vec3::splat(f32::MAX), &mut Compensation::ZERO.clone(), 0));
        assert_eq!((bright.radiance, bright.samples), (Vec3::splat(f32::MAX), 1));
        assert_eq!((sums.radiance, sums.samples), (Vec3::new(1.0, 2.0, 3.0), 1));
        assert_eq!(sums.squares, Vec3::new(1.0, 4.0, 9.0));
    }

    /// Torture tests 21 and 22 within a chunk.
    #[test]
    fn sums_round_once() {
        let sum = |values: &mut dyn Iterator<Item = f32>| {
            let (mut sums, mut compensation) = (PixelSums::ZERO, Compensation::ZERO);
            values.for_each(|value| sums.add(Vec3::splat(value), &mut compensation, 0));
            sums.compensate(compensation);
            sums.radiance.x
        };
        assert_eq!(sum(&mut core::iter::repeat_n(0.1, 256)), 0.1 * 256.0);
        assert_eq!(sum(&mut [16_777_216.0, 1.0, -16_777_216.0].into_iter()), 1.0);
        // The twin: without the carry.
        assert_ne!((0..256).fold(0.0, |sum, _| sum + 0.1f32), 0.1 * 256.0);
    }

    #[test]
    fn unwritten_is_all_ones() {
        assert!(bytemuck::bytes_of(&PixelSums::UNWRITTEN).iter().all(|&b| b == 0xff));
        assert!(PixelSums::UNWRITTEN.radiance.x.is_nan());
    }
}
