//! View of a camera, as the denoiser uses it, and launch parameters of an image.

use super::stop_factor;
use crate::camera;
use trisect_shared::camera::Camera;
use trisect_shared::denoise::{DenoiseParams, PinholeView, STOP_FACTORS};

/// Size of a frame's image, and the view that it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameView {
    pub view: PinholeView,
    /// True if the view is that of the camera's rays, by which frames are reprojected.
    pub reprojects: bool,
    pub width: u32,
    pub height: u32,
}

impl FrameView {
    /// Returns the image that a camera shows.
    pub fn by(camera: &Camera, width: u32, height: u32) -> Self {
        let reprojects = camera.is_parallel == 0;
        Self { view: camera::pinhole_view(camera), reprojects, width, height }
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
            depth_factor: stop_factor(f64::from(0.02f32).powi(2)).sqrt(),
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
