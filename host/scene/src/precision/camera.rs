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
    // Parallel rays have one direction; they start at points that are rounded as those of a lens.
    if camera.parallel_height > 0.0 {
        let pixel = camera.parallel_height / f64::from(image.height.max(1));
        let far = geometry::distance(scene.space, camera.look_from);
        if far * ROUNDING > PIXELS * pixel {
            found.push(Finding {
                limit: Limit::FarLens,
                severity: Severity::Warning,
                triangles: None,
                what: what(),
                quantity: "distance from the origin over a pixel's width",
                measured: far / pixel,
                supported: Supported::AtMost(PIXELS / ROUNDING),
                predicted: Predicted { value: far * ROUNDING / pixel, of: Unit::Pixels },
                remedy: LENS,
            });
        }
        return;
    }
    if ROUNDING / pixel > PIXELS {
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
    let footprint = pixel * camera.focus_distance;
    if camera.defocus_angle > 0.0 && far * ROUNDING > PIXELS * footprint {
        found.push(Finding {
            limit: Limit::FarLens,
            severity: Severity::Warning,
            triangles: None,
            what: what(),
            quantity: "distance from the origin over a pixel's width in focus",
            measured: far / footprint,
            supported: Supported::AtMost(PIXELS / ROUNDING),
            predicted: Predicted { value: far * ROUNDING / footprint, of: Unit::Pixels },
            remedy: LENS,
        });
    }
}
