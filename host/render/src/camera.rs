//! The camera of a scene: its record in launch parameters, and what the denoiser and tile entries
//! need to know of its rays.

use glam::{DVec3, Vec3};
use trisect_scene::CameraPose;
use trisect_shared::camera::Camera;
use trisect_shared::denoise::PinholeView;
use trisect_shared::ray::Ray;
use trisect_shared::rng::Words;

/// Returns the camera record of an image. It is computed in f64; only the record's vectors are
/// rounded to f32.
pub(crate) fn record(pose: &CameraPose, width: u32, height: u32) -> Camera {
    let back = (pose.look_from - pose.look_at).normalize();
    let right = pose.up.cross(back).normalize();
    let up = back.cross(right);
    let (width, height) = (f64::from(width), f64::from(height));
    // A pinhole is in focus everywhere, so its image plane may lie at distance 1.
    let focus_distance = if pose.defocus_angle > 0.0 { pose.focus_distance } else { 1.0 };
    let is_parallel = pose.parallel_height > 0.0;
    let image_height = match is_parallel {
        true => pose.parallel_height,
        false => 2.0 * (0.5 * pose.vertical_fov).tan() * focus_distance,
    };
    // Depths are measured from the origin, in units of the view.
    let focus_distance = if is_parallel { image_height } else { focus_distance };
    let pixel = image_height / height; // square pixels
    let corner = back * -focus_distance - right * (0.5 * pixel * width) + up * (0.5 * pixel * height);
    let lens = (0.5 * pose.defocus_angle).tan() * focus_distance;
    Camera {
        origin: pose.look_from.as_vec3(),
        is_parallel: u32::from(is_parallel),
        corner: corner.as_vec3(),
        media: 0,
        step_x: (right * pixel).as_vec3(),
        first_medium: 0,
        step_y: (up * -pixel).as_vec3(),
        pad3: 0,
        lens_x: if is_parallel { back * -focus_distance } else { right * lens }.as_vec3(),
        pad4: 0,
        lens_y: (up * lens).as_vec3(),
        pad5: 0,
    }
}

/// Distance of the pinhole that stands for a parallel projection, in heights of the view. Farther
/// away its rays would be closer to parallel, and depths would lose digits: at this distance their
/// rounding is a thousandth of the view's height, and a surface up to a hundred heights before or
/// behind the scene's middle is seen within a fortieth of its place.
pub(crate) const PARALLEL_DISTANCE: f64 = 4096.0;

/// Returns the view of the pinhole camera at the middle of the lens; for a parallel projection,
/// that of a distant pinhole, whose pixels have their size at the depth of `middle`, the middle of
/// the scene.
pub(crate) fn pinhole_view(camera: &Camera, middle: Option<Vec3>) -> PinholeView {
    let [corner, right, down] = [camera.corner, camera.step_x, camera.step_y].map(Vec3::as_dvec3);
    let axis = right.cross(down).normalize_or(DVec3::NEG_Z);
    let depth = corner.dot(axis);
    let (back, focus) = match camera.is_parallel {
        0 => (0.0, depth),
        _ => {
            let middle = middle.filter(|middle| middle.is_finite()).map(Vec3::as_dvec3);
            let from_camera = middle.map(|middle| (middle - camera.origin.as_dvec3()).dot(axis));
            let distance = PARALLEL_DISTANCE * depth;
            (distance - from_camera.unwrap_or(depth).max(0.0), distance)
        }
    };
    let record = |v: DVec3| (v / focus).as_vec3();
    PinholeView {
        origin: (camera.origin.as_dvec3() - axis * back).as_vec3(),
        pad0: 0,
        first_pixel: record(corner + axis * (focus - depth) + (right + down) * 0.5),
        pad1: 0,
        right: record(right),
        pad2: 0,
        down: record(down),
        pad3: 0,
        axis: axis.as_vec3(),
        pad4: 0,
    }
}

/// Lens and image plane of a camera in the camera's own axes (right, down, forward), relative to
/// the centre of the lens.
pub(crate) struct Lens {
    pub origin: DVec3,
    pub axes: [DVec3; 3],
    /// Distance of the image plane from the lens.
    pub focus: f64,
    /// Top left corner of the image plane.
    pub corner: (f64, f64),
    /// Width and height of a pixel on the image plane.
    pub pixel: (f64, f64),
    /// Radius of the lens; 0 for a pinhole.
    pub radius: f64,
    /// Length to which a device's rounding errors are proportional.
    pub scale: f64,
}

impl Lens {
    /// Returns lens and image plane of an image's camera, or `None` for a parallel projection,
    /// whose images have no tile entries.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Option<Self> {
        if camera.is_parallel != 0 {
            return None;
        }
        let [corner, step_x, step_y] = [camera.corner, camera.step_x, camera.step_y].map(Vec3::as_dvec3);
        let (x, y) = (step_x.normalize(), step_y.normalize());
        let z = x.cross(y);
        let z = if z.dot(corner) < 0.0 { -z } else { z };
        let radius = camera.lens_x.as_dvec3().length().max(camera.lens_y.as_dvec3().length());
        let across = f64::from(width) * step_x.length() + f64::from(height) * step_y.length();
        Some(Self {
            origin: camera.origin.as_dvec3(),
            axes: [x, y, z],
            focus: z.dot(corner),
            corner: (x.dot(corner), y.dot(corner)),
            pixel: (step_x.length(), step_y.length()),
            radius,
            scale: corner.abs().element_sum() + across + radius,
        })
    }
}

/// Returns the record of a part of an image, whose upper left pixel is (`x`, `y`).
pub(crate) fn shifted(whole: Camera, x: u32, y: u32) -> Camera {
    let step = whole.step_x.as_dvec3() * f64::from(x) + whole.step_y.as_dvec3() * f64::from(y);
    Camera { corner: (whole.corner.as_dvec3() + step).as_vec3(), ..whole }
}

/// Returns the depth of a position along the camera's axis.
pub(crate) fn depth(camera: &Camera, position: DVec3) -> f64 {
    let axis = camera.step_x.as_dvec3().cross(camera.step_y.as_dvec3()).normalize_or_zero();
    (position - camera.origin.as_dvec3()).dot(axis)
}

/// Returns the ray through the middle of pixel (`x`, `y`) and of the lens.
pub(crate) fn middle_ray(camera: &Camera, x: u32, y: u32) -> Ray {
    camera.ray(x, y, Words { x: 1 << 31, y: 1 << 31, z: 0, w: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    #[test]
    fn the_image_plane_of_a_square_view() {
        let pose = CameraPose { look_from: DVec3::new(0.0, 0.0, 5.0), ..CameraPose::PINHOLE };
        let camera = record(&pose, 2, 2);
        assert!((camera.corner - Vec3::new(-1.0, 1.0, -1.0)).length() < 1e-6);
        assert!((camera.step_x - Vec3::X).length() < 1e-6 && (camera.step_y + Vec3::Y).length() < 1e-6);
        // The middle of pixel (0, 0), pinhole.
        let half = 1 << 31;
        let ray = camera.ray(0, 0, Words { x: half, y: half, z: half, w: half });
        let want = Vec3::new(-0.5, 0.5, -1.0) / 1.5f32.sqrt();
        assert!(ray.origin == Vec3::new(0.0, 0.0, 5.0) && (ray.direction - want).length() < 1e-6);
    }

    #[test]
    fn rays_of_a_parallel_projection() {
        let pose =
            CameraPose { look_from: DVec3::new(0.0, 0.0, 5.0), parallel_height: 4.0, ..CameraPose::PINHOLE };
        let camera = record(&pose, 4, 2);
        let half = 1 << 31;
        for (x, y, want) in [(0, 0, Vec3::new(-3.0, 1.0, 5.0)), (3, 1, Vec3::new(3.0, -1.0, 5.0))] {
            let ray = camera.ray(x, y, Words { x: half, y: half, z: 3, w: 5 });
            assert!((ray.origin - want).length() < 1e-5, "{}", ray.origin);
            assert!((ray.direction - Vec3::NEG_Z).length() < 1e-6);
        }
        assert!(Lens::new(&camera, 4, 2).is_none());
    }

    /// Points on the rays of a parallel projection lie on those of the pinhole that stands for it,
    /// near and far.
    #[test]
    fn the_pinhole_of_a_parallel_projection_is_far_away() {
        for away in [0.5, 5.0, 5e5] {
            let look_from = DVec3::new(1.0, 2.0, away);
            let pose = CameraPose {
                look_from,
                look_at: look_from - DVec3::Z,
                parallel_height: 4.0,
                ..CameraPose::PINHOLE
            };
            let camera = record(&pose, 400, 200);
            let view = pinhole_view(&camera, Some(Vec3::new(7.0, 0.0, 0.0)));
            for (x, y, z) in [(0.0, 0.0, 0.0), (399.0, 0.0, 0.4), (31.0, 199.0, -20.0), (0.0, 0.0, -400.0)] {
                // The middle of the pixel, on a surface at this height.
                let point = DVec3::new(1.0 - 4.0 + 0.02 * (x + 0.5), 2.0 + 2.0 - 0.02 * (y + 0.5), z);
                let to = point - view.origin.as_dvec3();
                let depth = to.dot(view.axis.as_dvec3());
                let [first, right, down] = [view.first_pixel, view.right, view.down].map(Vec3::as_dvec3);
                let seen = (first + right * x + down * y) * depth;
                let off = (seen - to).length();
                // The middle of the scene is at z = 0.
                assert!(
                    off <= 1e-2 + 4.5 * z.abs() / (4.0 * PARALLEL_DISTANCE),
                    "{away}: {x} {y} {z}: {off}"
                );
            }
        }
    }
}
