//! Records of the denoiser's pixels.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Pixel of the image between passes. 16 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FilteredPixel {
    /// Radiance over albedo, finite; after [`remodulate`](crate::denoise::remodulate), radiance.
    pub color: Vec3,
    /// Variance of the colour, summed over its channels; [`UNKNOWN_VARIANCE`] if the pixel has no
    /// colour, because it has no sample or is not finite.
    pub variance: f32,
}

const _: () = assert!(size_of::<FilteredPixel>() == 16 && align_of::<FilteredPixel>() == 16);

/// Variance of a pixel without a colour.
pub const UNKNOWN_VARIANCE: f32 = -1.0;

impl FilteredPixel {
    /// Pixel without a colour.
    pub const UNKNOWN: Self = Self { color: Vec3::ZERO, variance: UNKNOWN_VARIANCE };

    /// Returns whether the pixel has a colour.
    #[inline(always)]
    pub fn is_known(&self) -> bool {
        self.variance >= 0.0
    }
}

/// Surface that a pixel sees. 16 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct GBufferTexel {
    /// Unit normal on the camera's side; 0 if most samples hit nothing.
    pub normal: Vec3,
    /// Inverse of the distance along the camera's axis; 0 if most samples hit nothing.
    pub inverse_depth: f32,
}

const _: () = assert!(size_of::<GBufferTexel>() == 16 && align_of::<GBufferTexel>() == 16);

impl GBufferTexel {
    /// Texel without a surface.
    pub const NONE: Self = Self { normal: Vec3::ZERO, inverse_depth: 0.0 };
}

/// History of a pixel, kept for the next frame. 48 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct HistoryPixel {
    /// Mean over the samples, and the variance of one of them.
    pub filtered: FilteredPixel,
    /// Surface that the pixel sees.
    pub gbuffer: GBufferTexel,
    /// Number of samples that the history counts for.
    pub samples: f32,
    /// Unused.
    pub pad0: u32,
    /// Unused.
    pub pad1: u32,
    /// Unused.
    pub pad2: u32,
}

const _: () = assert!(size_of::<HistoryPixel>() == 48 && align_of::<HistoryPixel>() == 16);

impl HistoryPixel {
    /// Pixel without a history.
    pub const NONE: Self = Self {
        filtered: FilteredPixel::UNKNOWN,
        gbuffer: GBufferTexel::NONE,
        samples: 0.0,
        pad0: 0,
        pad1: 0,
        pad2: 0,
    };
}
