//! Metadata of image files: what decides the image, its camera and its render.

use crate::render::Fingerprint;
use crate::stats::RenderStats;
use glam::{DMat4, DVec3, DVec4, Vec3};
use serde_json::Value;
use std::path::Path;
use trisect_image::output::{CameraMetadata, Metadata, ToneMap};
use trisect_scene::Rebase;
use trisect_shared::camera::Camera;
use web_time::SystemTime;

/// Returns what decides an image of the scene `scene`, of whose path the file's name is kept, with
/// `samples` per pixel, the mean over the image. Renders of one fingerprint with equal samples
/// have equal metadata.
pub fn of_image(scene: &str, samples: f64, fingerprint: &Fingerprint) -> Metadata {
    let setting = |name: &str| match fingerprint.settings.get(name) {
        Some(Value::String(text)) => text.clone(),
        Some(value) => value.to_string(),
        None => String::new(),
    };
    let file_name = Path::new(scene).file_name().map_or(scene.into(), |name| name.to_string_lossy());
    let hash: String = fingerprint.sha256().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    let entries = vec![
        ("Scene", file_name.into_owned()),
        ("Samples", format!("{}", (samples * 1000.0).round() / 1000.0)),
        ("Seed", setting("seed")),
        ("Max Depth", setting("depth")),
        ("Fingerprint", hash),
    ];
    let software = Some(format!("Trisect {}", fingerprint.version));
    Metadata { software, entries, ..Metadata::default() }
}

/// Adds the exposure in stops and the tone map, unless they leave the image unchanged.
pub fn add_display(metadata: &mut Metadata, stops: f32, tone_map: ToneMap) {
    if stops != 0.0 {
        metadata.entries.push(("Exposure", stops.to_string()));
    }
    if tone_map != ToneMap::None {
        metadata.entries.push(("Tone Map", tone_map.name().to_owned()));
    }
}

/// Adds the device, the seconds of the render and the current date, RFC 3339 in UTC.
pub fn add_run(metadata: &mut Metadata, stats: &RenderStats) {
    let seconds = stats.phases.render_seconds;
    // The time of a browser's clock is another type.
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let now = std::time::UNIX_EPOCH + now;
    metadata.entries.extend([
        ("Device", format!("{}: {}", stats.device.backend, stats.device.name)),
        ("Render Time", format!("{seconds:.3} s")),
        ("Creation Time", humantime::format_rfc3339_seconds(now).to_string()),
    ]);
}

/// Returns the camera of an image of this size, in the units of the scene's file, which was
/// rendered in `space`.
pub fn camera(camera: &Camera, space: Rebase, (width, height): (u32, u32)) -> CameraMetadata {
    let [corner, step_x, step_y] = [camera.corner, camera.step_x, camera.step_y].map(Vec3::as_dvec3);
    let (right, up) = (step_x.normalize_or(DVec3::X), -step_y.normalize_or(DVec3::NEG_Y));
    let back = right.cross(up);
    let origin = camera.origin.as_dvec3() / space.scale + space.origin;
    let row = |axis: DVec3| axis.extend(-axis.dot(origin));
    // Rows of the matrix that multiplies column vectors.
    let world_to_camera = [row(right), row(up), row(-back), DVec4::W];
    let is_parallel = camera.is_parallel != 0;
    // Half of the image's extent at distance 1, or everywhere in a parallel projection.
    let distance = if is_parallel { space.scale } else { -corner.dot(back) };
    let half_width = 0.5 * f64::from(width) * step_x.length() / distance;
    let half_height = 0.5 * f64::from(height) * step_y.length() / distance;
    // What a perspective divides by, and a half of it: the middle of the image.
    let divisor = if is_parallel { DVec4::W } else { DVec4::Z };
    let projection = [
        DVec4::X * (0.5 / half_width) + divisor * 0.5,
        DVec4::Y * (-0.5 / half_height) + divisor * 0.5,
        DVec4::Z,
        divisor,
    ];
    // glam's columns are the rows of a matrix for row vectors, as OpenEXR's are stored.
    let columns = |rows: [DVec4; 4]| DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
    let (view, projection) = (columns(world_to_camera), columns(projection));
    // Adding 0 makes -0 a 0.
    let stored = |matrix: DMat4| matrix.as_mat4().to_cols_array_2d().map(|row| row.map(|x| x + 0.0));
    CameraMetadata {
        world_to_camera: stored(view),
        world_to_ndc: stored(projection * view),
        vertical_fov: (!is_parallel).then(|| (2.0 * half_height.atan()).to_degrees() as f32),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::render::{Renderer, Settings};
    use trisect_device::cpu::Cpu;
    use trisect_scene::{CameraPose, Scene};

    fn times(point: DVec3, matrix: [[f32; 4]; 4]) -> [f64; 4] {
        let point = point.extend(1.0).to_array();
        std::array::from_fn(|column| (0..4).map(|row| point[row] * f64::from(matrix[row][column])).sum())
    }

    /// The corner of the image is at 0, in both projections and in a scaled space.
    #[test]
    fn the_image_is_from_zero_to_one() {
        for parallel_height in [0.0, 4.0] {
            let look_from = DVec3::new(1.0, 2.0, 5.0);
            let pose = CameraPose {
                look_from,
                look_at: DVec3::new(0.5, 1.0, -2.0),
                parallel_height,
                ..CameraPose::PINHOLE
            };
            let record = crate::camera::record(&pose, 400, 200);
            let space = Rebase { origin: DVec3::new(2.0, -1.0, 4.0), scale: 4.0 };
            let found = camera(&record, space, (400, 200));
            let own = camera(&record, Rebase::IDENTITY, (400, 200));
            let corner = record.origin + record.corner * if parallel_height > 0.0 { 1.0 } else { 3.0 };
            let corner = corner.as_dvec3();
            for (matrix, corner) in
                [(own.world_to_ndc, corner), (found.world_to_ndc, corner / space.scale + space.origin)]
            {
                let [x, y, _, w] = times(corner, matrix);
                assert!((x / w).abs() < 1e-5 && (y / w).abs() < 1e-5, "{x} {y} {w}");
            }
            let [x, y, _, w] = times(pose.look_at, own.world_to_ndc);
            assert!((x / w - 0.5).abs() < 1e-5 && (y / w - 0.5).abs() < 1e-5 && w > 0.0, "{x} {y} {w}");
            let at = times(look_from, own.world_to_camera);
            assert!(at.iter().take(3).all(|x| x.abs() < 1e-5), "{at:?}");
            let ahead = times(pose.look_at, own.world_to_camera);
            let length = (pose.look_at - look_from).length();
            assert!(ahead[0].abs() < 1e-5 && (ahead[2] - length).abs() < 1e-5, "{ahead:?}");
            let fov = own.vertical_fov.map(|fov| f64::from(fov).to_radians());
            assert_eq!(fov.is_some(), parallel_height == 0.0);
            assert!(fov.is_none_or(|fov| (fov - pose.vertical_fov).abs() < 1e-6), "{fov:?}");
        }
    }

    #[test]
    fn another_seed_is_another_fingerprint() {
        let scene = Scene::hello_world().unwrap();
        let renderer = Renderer::new(Cpu::open(Some(1)).unwrap(), &scene).unwrap();
        let of = |seed| {
            let settings = Settings { seed, ..Settings::of(&scene) };
            of_image("a.ron", 16.0, &renderer.fingerprint(&scene.digest(), &settings))
        };
        assert_eq!(of(7), of(7));
        let (one, two) = (of(7), of(8));
        let value = |of: &Metadata, name| of.entries.iter().find(|entry| entry.0 == name).unwrap().1.clone();
        assert_eq!((value(&one, "Samples"), value(&one, "Seed")), ("16".to_owned(), "7".to_owned()));
        assert_ne!(value(&one, "Fingerprint"), value(&two, "Fingerprint"));
    }
}
