//! Where a filter stops.

use super::{DenoiseParams, STOP_FACTORS};
use crate::math::max;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A surface that a pixel sees. 16 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct GBufferTexel {
    /// Unit normal on the camera's side; 0 where mostly nothing is seen.
    pub normal: Vec3,
    /// 1 over the distance along the camera's axis; 0 where mostly nothing is seen.
    pub inverse_depth: f32,
}

const _: () = assert!(size_of::<GBufferTexel>() == 16 && align_of::<GBufferTexel>() == 16);

impl GBufferTexel {
    /// Nothing.
    pub const NONE: Self = Self { normal: Vec3::ZERO, inverse_depth: 0.0 };
}

/// The pinhole of a camera. 80 bytes, five rows; the fourth word of each row is unused.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PinholeView {
    /// In the world.
    pub origin: Vec3,
    /// Unused.
    pub pad0: u32,
    /// To the middle of the top left pixel, at distance 1 along the axis.
    pub first_pixel: Vec3,
    /// Unused.
    pub pad1: u32,
    /// One pixel to the right, there.
    pub right: Vec3,
    /// Unused.
    pub pad2: u32,
    /// One pixel down, there.
    pub down: Vec3,
    /// Unused.
    pub pad3: u32,
    /// Unit vector along the axis.
    pub axis: Vec3,
    /// Unused.
    pub pad4: u32,
}

const _: () = assert!(size_of::<PinholeView>() == 80 && align_of::<PinholeView>() == 16);

/// What a pixel lets through of its neighbours, but for their colours. Factors are multiplied in:
/// all is in units of the stops.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeStopping {
    normal: Vec3,
    /// Of the normal alone.
    normal_factor: f32,
    /// The tangent plane: cosine of normal and direction, its change a tap to the right and a tap
    /// down, and over the inverse depth.
    cosine: f32,
    across: f32,
    along: f32,
    distance: f32,
}

impl EdgeStopping {
    /// Of pixel (`x`, `y`), for taps `step` pixels apart.
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

    /// Of a surface through `point`, for pixels of another view, counted from its pixel (`x`, `y`).
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

    /// What is left of `open` behind the stops between the surfaces of this pixel and of the tap
    /// (`i`, `j`).
    #[inline(always)]
    pub(super) fn remaining(&self, open: f32, texel: GBufferTexel, i: f32, j: f32) -> f32 {
        let turned = max(self.normal_factor - self.normal.dot(texel.normal), 0.0);
        let off = (self.cosine + self.across * i + self.along * j) - self.distance * texel.inverse_depth;
        open - turned - off * off
    }
}

/// What stops begin with: for a pixel that has a colour, and for none.
pub(super) const OPEN: f32 = 1.0;
pub(super) const SHUT: f32 = -3e38;

/// The weight of what stops have left: Tukey's biweight.
#[inline(always)]
pub(super) fn biweight(left: f32) -> f32 {
    let t = max(left, 0.0);
    t * t
}

/// A stop's factor within [`STOP_FACTORS`].
#[inline(always)]
pub(super) fn bounded_factor(factor: f32) -> f32 {
    if factor > STOP_FACTORS.0 {
        if factor < STOP_FACTORS.1 { factor } else { STOP_FACTORS.1 }
    } else {
        STOP_FACTORS.0
    }
}
