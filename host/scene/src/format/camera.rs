//! The camera of a scene file, with its checks.

use crate::CameraPose;
use crate::values::{Coordinate, Defocus, FieldOfView, Length, Point, vector};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A thin-lens camera; angles in degrees, lengths in scene units.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct Camera {
    /// Centre of the lens.
    pub look_from: Point,
    /// A point on the optical axis.
    pub look_at: Point,
    /// Up direction of the image; default: +y.
    #[serde(default = "default_up")]
    pub up: Point,
    /// Vertical angle of the whole image.
    pub vertical_fov: FieldOfView,
    /// Cone angle from a point in focus to the lens; 0, the default, for a pinhole.
    #[serde(default = "default_defocus")]
    pub defocus_angle: Defocus,
    /// Distance from the lens to the plane in focus; default: 1.
    #[serde(default = "default_focus")]
    pub focus_distance: Length,
}

fn default_up() -> Point {
    (Coordinate(0.0), Coordinate(1.0), Coordinate(0.0))
}

fn default_defocus() -> Defocus {
    Defocus(0.0)
}

fn default_focus() -> Length {
    Length(1.0)
}

impl<'de> Deserialize<'de> for Camera {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let camera = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        check(&camera.pose()).map_err(|fault| D::Error::custom(format!("camera: {fault}")))?;
        Ok(camera)
    }
}

impl Camera {
    /// Returns the camera with angles in radians.
    pub fn pose(&self) -> CameraPose {
        CameraPose {
            look_from: vector(self.look_from),
            look_at: vector(self.look_at),
            up: vector(self.up),
            vertical_fov: self.vertical_fov.0.to_radians(),
            defocus_angle: self.defocus_angle.0.to_radians(),
            focus_distance: self.focus_distance.0,
        }
    }
}

/// Checks values of a camera that are valid on their own but may not be together.
pub fn check(camera: &CameraPose) -> Result<(), String> {
    let axis = camera.look_at - camera.look_from;
    if axis.length() == 0.0 {
        return Err("look_from and look_at are the same point; move one of them".to_owned());
    }
    let sine = axis.normalize().cross(camera.up.normalize_or_zero()).length();
    if sine.is_nan() || sine < 1e-6 {
        return Err("up points along the view (or is zero); choose another direction".to_owned());
    }
    // The rays of a lens are differences of vectors of this length, and their squares must stay
    // finite in f32.
    let widest = (0.5 * camera.vertical_fov).tan().max((0.5 * camera.defocus_angle).tan()).max(1.0);
    if camera.defocus_angle > 0.0 && camera.focus_distance * widest > 1e15 {
        return Err(format!(
            "focus_distance {} is too large for these angles; it times the tangent of half an angle must be at most 1e15",
            camera.focus_distance
        ));
    }
    Ok(())
}
