//! Camera record of the launch parameters, from the camera's pose and the image's size.

use trisect_scene::CameraPose;
use trisect_shared::camera::Camera;

/// Returns the camera record of an image. It is computed in f64; only the record's vectors are
/// rounded to f32.
pub(super) fn record(pose: &CameraPose, width: u32, height: u32) -> Camera {
    let back = (pose.look_from - pose.look_at).normalize();
    let right = pose.up.cross(back).normalize();
    let up = back.cross(right);
    let (width, height) = (f64::from(width), f64::from(height));
    // A pinhole is in focus everywhere, so its image plane may lie at distance 1.
    let focus_distance = if pose.defocus_angle > 0.0 { pose.focus_distance } else { 1.0 };
    let image_height = 2.0 * (0.5 * pose.vertical_fov).tan() * focus_distance;
    let pixel = image_height / height; // square pixels
    let corner = back * -focus_distance - right * (0.5 * pixel * width) + up * (0.5 * pixel * height);
    let lens = (0.5 * pose.defocus_angle).tan() * focus_distance;
    Camera {
        origin: pose.look_from.as_vec3(),
        pad0: 0,
        corner: corner.as_vec3(),
        pad1: 0,
        step_x: (right * pixel).as_vec3(),
        pad2: 0,
        step_y: (up * -pixel).as_vec3(),
        pad3: 0,
        lens_x: (right * lens).as_vec3(),
        pad4: 0,
        lens_y: (up * lens).as_vec3(),
        pad5: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};
    use trisect_shared::rng::Words;

    #[test]
    fn the_image_plane_of_a_square_view() {
        let pose = CameraPose {
            look_from: DVec3::new(0.0, 0.0, 5.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            vertical_fov: std::f64::consts::FRAC_PI_2,
            defocus_angle: 0.0,
            focus_distance: 1.0,
        };
        let camera = record(&pose, 2, 2);
        assert!((camera.corner - Vec3::new(-1.0, 1.0, -1.0)).length() < 1e-6);
        assert!((camera.step_x - Vec3::X).length() < 1e-6 && (camera.step_y + Vec3::Y).length() < 1e-6);
        // The middle of pixel (0, 0), pinhole.
        let half = 1 << 31;
        let ray = camera.ray(0, 0, Words { x: half, y: half, z: half, w: half });
        let want = Vec3::new(-0.5, 0.5, -1.0) / 1.5f32.sqrt();
        assert!(ray.origin == Vec3::new(0.0, 0.0, 5.0) && (ray.direction - want).length() < 1e-6);
    }
}
