//! Checks rounding in the camera.
//!
//! A direction in f32 is off by an angle of about u = 2⁻²⁴; the angle of a pixel in the middle of
//! the image is 2 tan(fov / 2) / height. A point of the lens is rounded by u times its distance
//! from the origin, also sideways, so objects in focus blur by as much. Measured errors agree
//! (docs/reference/supported-ranges.md).

use super::finding::{Finding, Limit, Predicted, Severity, Supported, Unit};
use super::{PIXELS, ROUNDING, geometry};
use crate::ImageSettings;
use crate::SceneDocument;

const NARROW: &str = "move the eye nearer and widen vertical_fov, or take fewer pixels";
pub(super) const LENS: &str = "move the renderer's origin to the scene, with the field `space`: `precision::write` computes it; or set defocus_angle to 0";

pub(super) fn check(scene: &SceneDocument, image: &ImageSettings, found: &mut Vec<Finding>) {
    let Some((name, camera)) = scene.description.cameras.first() else { return };
    let what = || if name == "camera" { name.clone() } else { format!("camera \"{name}\"") };
    let pixel = 2.0 * (0.5 * camera.vertical_fov).tan() / f64::from(image.height.max(1));
    let is_parallel = camera.parallel_height > 0.0;
    // Parallel rays have one direction.
    if !is_parallel && ROUNDING / pixel > PIXELS {
        found.push(Finding {
            limit: Limit::NarrowView,
            severity: Severity::Warning,
            triangles: None,
            what: what(),
            quantity: "angle of a pixel, in radians",
            measured: pixel,
            supported: Supported::AtLeast(ROUNDING / PIXELS),
            predicted: Predicted { value: ROUNDING / pixel, of: Unit::Pixels },
            remedy: NARROW,
        });
    }
    let far = geometry::distance(scene.space, camera.look_from);
    // Starts of parallel rays are rounded as points of a lens are.
    let footprint = match is_parallel {
        true => camera.parallel_height / f64::from(image.height.max(1)),
        false => pixel * camera.focus_distance,
    };
    if (is_parallel || camera.defocus_angle > 0.0) && far * ROUNDING > PIXELS * footprint {
        found.push(Finding {
            limit: Limit::FarLens,
            severity: Severity::Warning,
            triangles: None,
            what: what(),
            quantity: "distance from the origin over a pixel's width in focus",
            measured: far / footprint,
            supported: Supported::AtMost(PIXELS / ROUNDING),
            predicted: Predicted { value: far * ROUNDING / footprint, of: Unit::Pixels },
            remedy: if is_parallel { geometry::FAR } else { LENS },
        });
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;

    /// A parallel view far from the origin is found, and one near it is not.
    #[test]
    fn parallel_views_far_away() {
        let found = |x: f64| {
            let text = format!(
                "Scene(version: 1, image: (width: 8, height: 1000), materials: {{}}, objects: [],
                camera: (look_from: ({x:?}, 0, 1), look_at: ({x:?}, 0, 0), height: 1))"
            );
            let scene = SceneDocument::parse(&text, "parallel").unwrap();
            let mut found = Vec::new();
            check(&scene, &scene.image, &mut found);
            found.iter().filter(|finding| finding.limit == Limit::FarLens).count()
        };
        assert_eq!((found(1e6), found(1.0)), (1, 0));
    }
}
