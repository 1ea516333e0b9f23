//! Thin-lens or parallel camera: makes the camera ray of each sample.

use crate::math::{sqrt, unit_circle, unit_f32};
use crate::ray::{OriginPrimitive, Ray};
use crate::rng::Words;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Camera as launch parameters: a thin lens, or a parallel projection. Its vectors, in scene units,
/// start at `origin`, so that a camera far from the world's origin loses no digits. 96 bytes, 6
/// rows; the fourth word of the last rows is unused.
///
/// The image plane lies in the focal plane: `corner` points at the outer corner of the top left
/// pixel, `step_x` and `step_y` lead to the next pixel to the right and below. Rays of a parallel
/// projection start at the plane of the origin, a distance before the image plane.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Camera {
    /// Centre of the lens, in world coordinates.
    pub origin: Vec3,
    /// 1 for a parallel projection, 0 for a lens.
    pub is_parallel: u32,
    /// Vector from the lens centre to the image's top left corner.
    pub corner: Vec3,
    /// [`MediumStack`](crate::medium::MediumStack) of the media around the camera.
    pub media: u32,
    /// Vector from a pixel to the next one to the right.
    pub step_x: Vec3,
    /// Index of the record of medium 1 among the materials.
    pub first_medium: u32,
    /// Vector from a pixel to the next one below.
    pub step_y: Vec3,
    /// Unused.
    pub pad3: u32,
    /// Vector from the lens centre to its rim, to the right; zero for a pinhole. In a parallel
    /// projection, the vector from the origin to the middle of the image.
    pub lens_x: Vec3,
    /// Unused.
    pub pad4: u32,
    /// Vector from the lens centre to its rim, upwards; zero for a pinhole.
    pub lens_y: Vec3,
    /// Unused.
    pub pad5: u32,
}

const _: () = assert!(size_of::<Camera>() == 96 && align_of::<Camera>() == 16);

impl Camera {
    /// Returns the ray through pixel (`x`, `y`). `random.x` and `random.y` (dimensions 0 and 1)
    /// choose the point in the pixel, by a box filter of one pixel; `random.z` and `random.w`
    /// (dimensions 2 and 3) choose a point of the lens, uniformly.
    #[inline(always)]
    pub fn ray(&self, x: u32, y: u32, random: Words) -> Ray {
        let across = x as f32 + unit_f32(random.x);
        let down = y as f32 + unit_f32(random.y);
        let radius = sqrt(unit_f32(random.z));
        let (cos, sin) = unit_circle(random.w);
        let lens = self.lens_x * (radius * cos) + self.lens_y * (radius * sin);
        let target = self.corner + self.step_x * across + self.step_y * down;
        let is_parallel = self.is_parallel != 0;
        let start = if is_parallel { target - self.lens_x } else { lens };
        let along = if is_parallel { self.lens_x } else { target - lens };
        Ray::in_world(self.origin + start, crate::math::normalize(along), OriginPrimitive::NONE)
    }
}
