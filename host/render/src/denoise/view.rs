//! View of a camera, as the denoiser uses it.

use glam::{DVec3, Vec3};
use trisect_shared::camera::Camera;
use trisect_shared::denoise::PinholeView;

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
