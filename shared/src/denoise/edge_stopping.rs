//! Edge stopping: the weight of a neighbour, by the differences of normal, depth and colour.
//!
//! A neighbour weighs (1 - x/2)², and nothing from x = 2 on; x is the sum of its squared
//! differences, each relative to its parameter: Tukey's biweight (Black et al., "Robust Anisotropic
//! Diffusion", IEEE Transactions on Image Processing 7(3), 1998). Unlike the exponential of
//! Dammertz et al. and Schied et al., its few operations round identically everywhere. Depth is
//! kept as its inverse, which is linear in the image over a plane: a relative distance from a
//! tangent plane takes a few products and sums, and a scene's scale and position do not matter.

use super::{DenoiseParams, GBufferTexel, STOP_FACTORS};
use crate::math::max;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Pinhole of a camera. 80 bytes, 5 rows; the fourth word of each row is unused.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PinholeView {
    /// Position of the pinhole, in world coordinates.
    pub origin: Vec3,
    /// Unused.
    pub pad0: u32,
    /// Vector to the middle of the top left pixel, at distance 1 along the axis.
    pub first_pixel: Vec3,
    /// Unused.
    pub pad1: u32,
    /// Vector from a pixel to the next one to the right, at distance 1.
    pub right: Vec3,
    /// Unused.
    pub pad2: u32,
    /// Vector from a pixel to the next one below, at distance 1.
    pub down: Vec3,
    /// Unused.
    pub pad3: u32,
    /// Unit vector along the axis.
    pub axis: Vec3,
    /// Unused.
    pub pad4: u32,
}

const _: () = assert!(size_of::<PinholeView>() == 80 && align_of::<PinholeView>() == 16);

/// Edge stopping of a pixel by normal and depth; colour is added by the filter. The factors of
/// [`DenoiseParams`] are multiplied in, so differences are relative to their parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeStopping {
    normal: Vec3,
    /// Factor of the normal.
    normal_factor: f32,
    /// Tangent plane: dot product of the normal with the vector to the pixel, its change for a tap
    /// to the right and for a tap down, and its product with the depth. All are times the factor of
    /// the depth.
    cosine: f32,
    across: f32,
    along: f32,
    distance: f32,
}

impl EdgeStopping {
    /// Creates the edge stopping of pixel (`x`, `y`), for taps `step` pixels apart.
    #[inline(always)]
    pub(super) fn new(params: &DenoiseParams, texel: GBufferTexel, x: u32, y: u32, step: f32) -> Self {
        let PinholeView { first_pixel: first, right, down, .. } = params.view;
        let cosine = texel.normal.dot(first + right * x as f32 + down * y as f32) * params.depth_factor;
        let by = params.depth_factor * step;
        Self {
            normal: texel.normal * params.normal_factor,
            normal_factor: params.normal_factor,
            cosine,
            across: texel.normal.dot(right) * by,
            along: texel.normal.dot(down) * by,
            distance: if texel.inverse_depth > 0.0 { cosine / texel.inverse_depth } else { 0.0 },
        }
    }

    /// Creates the edge stopping of a surface through `point` for pixels of another view, counted
    /// from that view's pixel (`x`, `y`).
    #[inline(always)]
    pub(super) fn of_plane(
        params: &DenoiseParams,
        view: &PinholeView,
        normal: Vec3,
        point: Vec3,
        x: f32,
        y: f32,
    ) -> Self {
        let by = normal * params.depth_factor;
        Self {
            normal: normal * params.normal_factor,
            normal_factor: params.normal_factor,
            cosine: by.dot(view.first_pixel + view.right * x + view.down * y),
            across: by.dot(view.right),
            along: by.dot(view.down),
            distance: by.dot(point - view.origin),
        }
    }

    /// Returns what is left of `open` after the differences between this pixel's surface and that
    /// of the tap (`i`, `j`).
    #[inline(always)]
    pub(super) fn remaining(&self, open: f32, texel: GBufferTexel, i: f32, j: f32) -> f32 {
        let turned = max(self.normal_factor - self.normal.dot(texel.normal), 0.0);
        let off = (self.cosine + self.across * i + self.along * j) - self.distance * texel.inverse_depth;
        open - turned - off * off
    }
}

/// Initial value of [`EdgeStopping::remaining`] for a tap that counts.
pub(super) const OPEN: f32 = 1.0;
/// Initial value for a tap that does not count: outside of the image, or without a colour.
pub(super) const SHUT: f32 = -3e38;

/// Returns the weight for what edge stopping has left: Tukey's biweight.
#[inline(always)]
pub(super) fn biweight(left: f32) -> f32 {
    let t = max(left, 0.0);
    t * t
}

/// Returns a factor of edge stopping, clamped to [`STOP_FACTORS`].
#[inline(always)]
pub(super) fn bounded_factor(factor: f32) -> f32 {
    if factor > STOP_FACTORS.0 {
        if factor < STOP_FACTORS.1 { factor } else { STOP_FACTORS.1 }
    } else {
        STOP_FACTORS.0
    }
}
