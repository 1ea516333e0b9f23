//! Surface that a pixel of a frame shows.

use glam::DVec3;

/// Surface that a pixel shows, by its camera rays that hit something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// Number of the object that the first of them hits, from 1 on, as
    /// [`Renderer::object`](crate::render::Renderer::object) counts.
    pub object: u32,
    /// Mean position, in the renderer's space.
    pub position: DVec3,
    /// Mean shading normal, on the camera's side.
    pub normal: DVec3,
    /// Mean albedo.
    pub albedo: DVec3,
    /// Depth of the position along the camera's axis, in the renderer's space.
    pub depth: f64,
    /// Mean radiance of the pixel, before any filter.
    pub radiance: DVec3,
}
