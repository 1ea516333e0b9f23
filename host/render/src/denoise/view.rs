//! View of a camera, as the denoiser uses it, and launch parameters of an image.

use super::stop_factor;
use glam::{DVec3, Vec3};
use trisect_shared::camera::Camera;
use trisect_shared::denoise::{DenoiseParams, PinholeView, STOP_FACTORS};

/// Size of a frame's image, and the view that it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameView {
    pub view: PinholeView,
    pub width: u32,
    pub height: u32,
}

impl FrameView {
    /// Returns the image that a camera shows.
    pub fn by(camera: &Camera, width: u32, height: u32) -> Self {
        Self { view: of(camera), width, height }
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
const MIN_VARIANCE_SAMPLES: u32 = 4;

/// Returns the view of the pinhole camera at the middle of the lens.
pub(super) fn of(camera: &Camera) -> PinholeView {
    let [corner, right, down] = [camera.corner, camera.step_x, camera.step_y].map(Vec3::as_dvec3);
    let axis = right.cross(down).normalize_or(DVec3::NEG_Z);
    let focus = corner.dot(axis);
    let record = |v: DVec3| (v / focus).as_vec3();
    PinholeView {
        origin: camera.origin,
        pad0: 0,
        first_pixel: record(corner + (right + down) * 0.5),
        pad1: 0,
        right: record(right),
        pad2: 0,
        down: record(down),
        pad3: 0,
        axis: axis.as_vec3(),
        pad4: 0,
    }
}
