//! View of a camera, as the denoiser uses it, and launch parameters of an image.

use super::stop_factor;
use crate::camera;
use glam::Vec3;
use trisect_shared::camera::Camera;
use trisect_shared::denoise::{DenoiseParams, PinholeView, STOP_FACTORS};

/// Size of a frame's image, and the view that it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameView {
    pub view: PinholeView,
    /// True if the view is that of the camera's rays, by which frames are reprojected.
    pub reprojects: bool,
    /// Depth of the view in the unit of the depth parameter: 1 for the distance from a lens; a
    /// parallel projection measures in heights of the view, which its distance does not change.
    depth_scale: f32,
    pub width: u32,
    pub height: u32,
}

impl FrameView {
    /// Returns the image that a camera shows, of a scene with this middle.
    pub fn by(camera: &Camera, middle: Option<Vec3>, width: u32, height: u32) -> Self {
        let reprojects = camera.is_parallel == 0;
        let depth_scale = if reprojects { 1.0 } else { camera::PARALLEL_DISTANCE as f32 };
        Self { view: camera::pinhole_view(camera, middle), reprojects, depth_scale, width, height }
    }

    /// Returns the factor in edge stopping for a maximum distance from the tangent plane.
    pub(super) fn depth_factor(&self, depth: f32) -> f32 {
        let factor = stop_factor(f64::from(depth).powi(2)).sqrt();
        (factor * self.depth_scale).clamp(STOP_FACTORS.0, STOP_FACTORS.1)
    }

    /// Returns launch parameters without a filter: colours stop nothing, normals and depths stop as
    /// by default in SVGF.
    pub(super) fn params(&self) -> DenoiseParams {
        DenoiseParams {
            view: self.view,
            width: self.width,
            height: self.height,
            step: 1,
            first_row: 0,
            color_factor: STOP_FACTORS.0,
            normal_factor: stop_factor(1.0 - f64::from(30.0f32).to_radians().cos()),
            depth_factor: self.depth_factor(0.02),
            trusted_samples: MIN_VARIANCE_SAMPLES,
            previous_view: self.view,
            max_history: 0.0,
            expired_history: 0.0,
            clamp_deviations: STOP_FACTORS.1,
            accumulate: 0,
        }
    }
}

/// Minimum number of samples for which a pixel's own variance is used, as in SVGF.
pub(crate) const MIN_VARIANCE_SAMPLES: u32 = 4;
