//! The camera of a scene file, with its checks.

use crate::CameraPose;
use crate::limits::check_camera;
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
        check_camera(&camera.pose()).map_err(|fault| D::Error::custom(format!("camera: {fault}")))?;
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
