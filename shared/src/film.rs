//! What a pixel gathers.

use crate::math::is_finite;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Samples that may be summed in f32 before the host merges the sums in f64: 256 terms of like size lose at most
/// 256 rounding errors, 1.5e-5 relative in the worst case, 2.4e-6 measured for a constant 0.1.
pub const CHUNK_SAMPLES: u32 = 256;

/// Sums over samples of one pixel, in index order. 32 bytes.
///
/// Fresh memory holds [`PixelSums::UNWRITTEN`], so that a pixel that no kernel wrote shows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PixelSums {
    /// Of the radiance.
    pub radiance: Vec3,
    /// How many samples were added; those with a NaN or infinite radiance are not.
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

    /// Adds one sample of radiance, unless it is NaN or infinite.
    #[inline(always)]
    pub fn add(&mut self, radiance: Vec3) {
        if is_finite(radiance.x) && is_finite(radiance.y) && is_finite(radiance.z) {
            self.radiance += radiance;
            self.squares += radiance * radiance;
            self.samples += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_out_what_is_not_finite() {
        let mut sums = PixelSums::ZERO;
        sums.add(Vec3::new(1.0, 2.0, 3.0));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            sums.add(Vec3::new(bad, 0.0, 0.0));
            sums.add(Vec3::new(0.0, bad, 0.0));
            sums.add(Vec3::new(0.0, 0.0, bad));
        }
        assert_eq!((sums.radiance, sums.samples), (Vec3::new(1.0, 2.0, 3.0), 1));
        assert_eq!(sums.squares, Vec3::new(1.0, 4.0, 9.0));
    }

    #[test]
    fn unwritten_is_all_ones() {
        assert!(bytemuck::bytes_of(&PixelSums::UNWRITTEN).iter().all(|&b| b == 0xff));
        assert!(PixelSums::UNWRITTEN.radiance.x.is_nan());
    }
}
