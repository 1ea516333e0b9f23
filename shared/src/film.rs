//! Sums over the samples of a pixel, with compensation of their rounding errors.
//!
//! Render kernels add samples to them; they add up chunk by chunk to exact sums, on the device
//! ([`totals`](crate::totals)) or on the host (docs/explanation/exact-sums.md).

use crate::math::all_finite;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Maximum number of samples in a chunk. A kernel sums a chunk in f32 and keeps the rounding errors
/// in a [`Compensation`]; then the host adds the chunk's sum to its own.
pub const CHUNK_SAMPLES: u32 = 256;

/// Sums over samples of one pixel, in index order. 32 bytes.
///
/// A fresh film holds [`PixelSums::UNWRITTEN`], so that a pixel that no kernel wrote is visible.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PixelSums {
    /// Sum of the radiance.
    pub radiance: Vec3,
    /// Number of samples added. A sample that would make the radiance NaN or infinite is not added.
    pub samples: u32,
    /// Sum of the squared radiance by channel, for the pixel's variance.
    pub squares: Vec3,
    /// Number of path segments traced for all samples.
    pub segments: u32,
}

const _: () = assert!(size_of::<PixelSums>() == 32 && align_of::<PixelSums>() == 16);

impl PixelSums {
    /// Sums over no samples.
    pub const ZERO: Self = Self { radiance: Vec3::ZERO, samples: 0, squares: Vec3::ZERO, segments: 0 };

    /// Value of all pixels before a launch: NaN sums. Each byte is 0xff, as a device's memset can
    /// write it.
    pub const UNWRITTEN: Self = Self {
        radiance: Vec3::splat(f32::from_bits(u32::MAX)),
        samples: u32::MAX,
        squares: Vec3::splat(f32::from_bits(u32::MAX)),
        segments: u32::MAX,
    };

    /// Adds one sample of radiance, unless the sum would be NaN or infinite, and adds the rounding
    /// error of the sum to `compensation`.
    ///
    /// Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen", ZAMM 54,
    /// 1974, with the error of each addition by Knuth's TwoSum, which has no branch. A compiler
    /// that may reassociate would find each error to be 0. It must not see that a number is
    /// subtracted that was just added, so both pass through an exclusive or with `zero`, a word
    /// that is 0, which no compiler can know. The squares are summed plainly: the variance is not
    /// needed to 1e-5.
    #[inline(always)]
    pub fn add(&mut self, radiance: Vec3, compensation: &mut Compensation, zero: u32) {
        let sum = hide_from_compiler(self.radiance + radiance, zero);
        // The sum is not finite if the sample is NaN or infinite, or too bright for the sum.
        if all_finite(sum) {
            let added = hide_from_compiler(sum - self.radiance, zero);
            compensation.radiance += (self.radiance - (sum - added)) + (radiance - added);
            self.radiance = sum;
            self.squares += radiance * radiance;
            self.samples += 1;
        }
    }

    /// Adds the compensation, so that the sum is rounded once; after the chunk's last sample.
    #[inline(always)]
    pub fn compensate(&mut self, compensation: Compensation) {
        self.radiance += compensation.radiance;
    }
}

/// Returns `v` if `zero` is 0, hidden from optimisers that reassociate. No compiler of PTX does:
/// there it costs nothing.
#[inline(always)]
fn hide_from_compiler(v: Vec3, zero: u32) -> Vec3 {
    if cfg!(target_arch = "nvptx64") {
        return v;
    }
    let hide = |x: f32| f32::from_bits(x.to_bits() ^ zero);
    Vec3::new(hide(v.x), hide(v.y), hide(v.z))
}

/// Rounding errors of the f32 sums of an unfinished chunk. 16 bytes. It stays on the device for the
/// launch that continues the chunk.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Compensation {
    /// Rounding error to add to [`PixelSums::radiance`].
    pub radiance: Vec3,
    /// Unused.
    pub pad: u32,
}

const _: () = assert!(size_of::<Compensation>() == 16 && align_of::<Compensation>() == 16);

impl Compensation {
    /// No rounding error.
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
        // Each summand is finite, the sum is not.
        let mut bright = PixelSums::ZERO;
        (0..3).for_each(|_| bright.add(Vec3::splat(f32::MAX), &mut Compensation::ZERO.clone(), 0));
        assert_eq!((bright.radiance, bright.samples), (Vec3::splat(f32::MAX), 1));
        assert_eq!((sums.radiance, sums.samples), (Vec3::new(1.0, 2.0, 3.0), 1));
        assert_eq!(sums.squares, Vec3::new(1.0, 4.0, 9.0));
    }

    /// Torture tests 21 and 22 within one chunk.
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
        // Negative control: without the compensation.
        assert_ne!((0..256).fold(0.0, |sum, _| sum + 0.1f32), 0.1 * 256.0);
    }

    #[test]
    fn unwritten_is_all_ones() {
        assert!(bytemuck::bytes_of(&PixelSums::UNWRITTEN).iter().all(|&b| b == 0xff));
        assert!(PixelSums::UNWRITTEN.radiance.x.is_nan());
    }
}
