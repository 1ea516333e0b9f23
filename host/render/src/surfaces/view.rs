//! Projection of positions to an image.

use glam::{DMat3, DVec2, DVec3, Vec3};
use trisect_shared::camera::Camera;

/// Projection of positions to the image of a camera, by the middle of its lens.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    origin: DVec3,
    /// Columns: the vector to the corner of the image, or along parallel rays, and those to the
    /// next pixels to the right and below.
    vectors: DMat3,
    /// Inverse of `vectors`.
    inverse: DMat3,
    is_parallel: bool,
}

impl View {
    /// Makes the projection of a camera.
    pub fn new(camera: &Camera) -> Self {
        let vectors = [camera.origin, camera.corner, camera.step_x, camera.step_y, camera.lens_x];
        let [origin, corner, right, down, along] = vectors.map(Vec3::as_dvec3);
        let is_parallel = camera.is_parallel != 0;
        let (origin, first) = if is_parallel { (origin + corner, along) } else { (origin, corner) };
        let vectors = DMat3::from_cols(first, right, down);
        Self { origin, vectors, inverse: vectors.inverse(), is_parallel }
    }

    /// Returns the place of a position in the image, in pixels from its upper left corner; `None`
    /// for a position that is not before the lens.
    pub fn pixel(&self, position: DVec3) -> Option<DVec2> {
        let DVec3 { x: depth, y, z } = self.inverse * (position - self.origin);
        match self.is_parallel {
            true => Some(DVec2::new(y, z)),
            false => (depth > 0.0).then(|| DVec2::new(y, z) / depth),
        }
    }

    /// Returns the place of a position that is infinitely far away in a direction; `None` for
    /// parallel rays, and for a direction that does not point to the image's side.
    pub fn pixel_of_direction(&self, direction: DVec3) -> Option<DVec2> {
        let DVec3 { x: depth, y, z } = self.inverse * direction;
        (!self.is_parallel && depth > 0.0).then(|| DVec2::new(y, z) / depth)
    }

    /// Returns the direction, not of unit length, of the ray through a place of the image.
    pub fn direction(&self, DVec2 { x, y }: DVec2) -> DVec3 {
        if self.is_parallel { self.vectors.x_axis } else { self.vectors * DVec3::new(1.0, x, y) }
    }

    /// Returns the direction, not of unit length, of the ray to a position.
    pub fn direction_to(&self, position: DVec3) -> DVec3 {
        if self.is_parallel { self.vectors.x_axis } else { position - self.origin }
    }
}
