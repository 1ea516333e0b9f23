//! The camera: its pose, and how scene files and scenes between ranks write it.

use crate::values::{
    Coordinate, Defocus, FieldOfView, Length, MAX_MAGNITUDE, MIN_MAGNITUDE, Point, point_text, some, vector,
};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::f64::consts::FRAC_PI_2;

/// A camera in the world, of a thin lens or a parallel projection; lengths in scene units, angles
/// in radians. Its bytes are sent between ranks and are part of a scene's digest.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct CameraPose {
    /// Centre of the lens.
    pub look_from: DVec3,
    /// A point on the optical axis.
    pub look_at: DVec3,
    /// Up direction of the image; not along the axis.
    pub up: DVec3,
    /// Vertical angle of the whole image, in (0, π).
    pub vertical_fov: f64,
    /// Cone angle from a point in focus to the lens, in [0, π); 0 for a pinhole.
    pub defocus_angle: f64,
    /// Distance from the lens to the plane in focus.
    pub focus_distance: f64,
    /// Height of the view of a parallel (orthographic) projection, whose rays start at the plane of
    /// `look_from`; 0 for a perspective.
    pub parallel_height: f64,
}

impl CameraPose {
    /// A pinhole camera at the origin that looks along -z, upright, with a vertical angle of 90
    /// degrees.
    pub const PINHOLE: Self = Self {
        look_from: DVec3::ZERO,
        look_at: DVec3::NEG_Z,
        up: DVec3::Y,
        vertical_fov: FRAC_PI_2,
        defocus_angle: 0.0,
        focus_distance: 1.0,
        parallel_height: 0.0,
    };

    /// Checks that the camera is valid.
    ///
    /// # Errors
    ///
    /// A message that says what would be valid.
    pub fn check(&self) -> Result<(), String> {
        let Self { look_from, look_at, up, vertical_fov, defocus_angle, focus_distance, parallel_height } =
            *self;
        let far = MAX_MAGNITUDE;
        if ![look_from, look_at, up].iter().all(|v| v.abs().cmple(DVec3::splat(far)).all()) {
            return Err(format!("look_from, look_at and up must be numbers within {far:e}"));
        }
        let angle = |a: f64| (0.0..std::f64::consts::PI).contains(&a);
        if !(angle(vertical_fov) && vertical_fov > 0.0 && angle(defocus_angle)) {
            return Err("vertical_fov must lie between 0 and 180 degrees, defocus_angle below 180".to_owned());
        }
        if parallel_height != 0.0 && !(MIN_MAGNITUDE..=far).contains(&parallel_height) {
            let least = MIN_MAGNITUDE;
            return Err(format!(
                "the height of the view is {parallel_height:e}; it must lie between {least:e} and {far:e}"
            ));
        }
        // First, because a builder's distance of focus is that of the two points.
        self.check_together()?;
        if !(MIN_MAGNITUDE..=far).contains(&focus_distance) {
            let least = MIN_MAGNITUDE;
            return Err(format!(
                "focus_distance is {focus_distance:e}; it must lie between {least:e} and {far:e}"
            ));
        }
        Ok(())
    }

    /// Checks values that are valid on their own but may not be together.
    ///
    /// # Errors
    ///
    /// A message that says what would be valid.
    pub(crate) fn check_together(&self) -> Result<(), String> {
        let axis = self.look_at - self.look_from;
        if axis.length() == 0.0 {
            return Err("look_from and look_at are the same point; move one of them".to_owned());
        }
        let sine = axis.normalize().cross(self.up.normalize_or_zero()).length();
        if sine.is_nan() || sine < 1e-6 {
            return Err("up points along the view (or is zero); choose another direction".to_owned());
        }
        if self.parallel_height > 0.0 && self.defocus_angle > 0.0 {
            return Err("a parallel projection (height) has no lens; leave defocus_angle out".to_owned());
        }
        // The rays of a lens are differences of vectors of this length, and their squares must stay
        // finite in f32.
        let widest = (0.5 * self.vertical_fov).tan().max((0.5 * self.defocus_angle).tan()).max(1.0);
        if self.defocus_angle > 0.0 && self.focus_distance * widest > 1e15 {
            return Err(format!(
                "focus_distance {} is too large for these angles; it times the tangent of half an angle must be at most 1e15",
                self.focus_distance
            ));
        }
        Ok(())
    }

    /// Returns the pose with `length` applied to each length that is not between its points. A
    /// pinhole has everything in focus, so its focus distance stays in range.
    pub(crate) fn map_lengths(&self, length: impl Fn(f64) -> f64) -> Self {
        let focus_distance = match length(self.focus_distance) {
            distance if self.defocus_angle == 0.0 => distance.clamp(MIN_MAGNITUDE, MAX_MAGNITUDE),
            distance => distance,
        };
        let parallel_height = length(self.parallel_height);
        Self { focus_distance, parallel_height, ..*self }
    }

    /// Returns whether this is `other`, up to the rounding of degrees.
    pub(crate) fn is_near(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        let Self { vertical_fov, defocus_angle, .. } = *self;
        let angles = [(vertical_fov, other.vertical_fov), (defocus_angle, other.defocus_angle)];
        *self == Self { vertical_fov, defocus_angle, ..*other } && angles.into_iter().all(|(a, b)| near(a, b))
    }

    /// Returns the pose between two others: `self` for a share of 0, `to` for 1.
    pub(crate) fn mix(&self, to: &Self, share: f64) -> Self {
        let line = |a: f64, b: f64| a + (b - a) * share;
        Self {
            look_from: self.look_from.lerp(to.look_from, share),
            look_at: self.look_at.lerp(to.look_at, share),
            up: self.up.lerp(to.up, share),
            vertical_fov: line(self.vertical_fov, to.vertical_fov),
            defocus_angle: line(self.defocus_angle, to.defocus_angle),
            focus_distance: line(self.focus_distance, to.focus_distance),
            parallel_height: line(self.parallel_height, to.parallel_height),
        }
    }
}

/// A camera; angles in degrees, lengths in scene units.
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
    /// Vertical angle of the whole image, for a perspective.
    #[serde(default, deserialize_with = "some")]
    pub vertical_fov: Option<FieldOfView>,
    /// Height of the view, for a parallel projection.
    #[serde(default, deserialize_with = "some")]
    pub height: Option<Length>,
    /// Cone angle from a point in focus to the lens; 0, the default, for a pinhole.
    #[serde(default = "default_defocus")]
    pub defocus_angle: Defocus,
    /// Distance from the lens to the plane in focus; default: that of `look_at`.
    #[serde(default, deserialize_with = "some")]
    pub focus_distance: Option<Length>,
}

fn default_up() -> Point {
    (Coordinate(0.0), Coordinate(1.0), Coordinate(0.0))
}

fn default_defocus() -> Defocus {
    Defocus(0.0)
}

impl<'de> Deserialize<'de> for Camera {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let camera = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        let fault = match (&camera.vertical_fov, &camera.height) {
            (None, None) => Some("vertical_fov is missing; state it, or height for a parallel projection"),
            (Some(_), Some(_)) => {
                Some("vertical_fov is for a perspective, height for a parallel projection; leave one out")
            }
            _ => None,
        };
        if let Some(fault) = fault {
            return Err(D::Error::custom(format!("camera: {fault}")));
        }
        camera.pose().check_together().map_err(|fault| D::Error::custom(format!("camera: {fault}")))?;
        Ok(camera)
    }
}

impl Camera {
    /// Returns the camera with angles in radians.
    pub fn pose(&self) -> CameraPose {
        let (look_from, look_at) = (vector(self.look_from), vector(self.look_at));
        let focus_distance = self.focus_distance.map(|distance| distance.0);
        CameraPose {
            look_from,
            look_at,
            up: vector(self.up),
            vertical_fov: self.vertical_fov.as_ref().map_or(FRAC_PI_2, |angle| angle.0.to_radians()),
            parallel_height: self.height.as_ref().map_or(0.0, |height| height.0),
            defocus_angle: self.defocus_angle.0.to_radians(),
            focus_distance: focus_distance.unwrap_or_else(|| focus_on(look_at, look_from)),
        }
    }
}

/// Returns the distance of focus, within its range, at which a point is sharp from `look_from`, if
/// the camera looks at it.
pub(crate) fn focus_on(point: DVec3, look_from: DVec3) -> f64 {
    point.distance(look_from).clamp(MIN_MAGNITUDE, MAX_MAGNITUDE)
}

/// Formats a camera as the value of the field `camera`.
pub(crate) fn camera_value(camera: &CameraPose) -> String {
    let view = match camera.parallel_height > 0.0 {
        true => format!("height: {:?}", camera.parallel_height),
        false => format!("vertical_fov: {:?}", camera.vertical_fov.to_degrees()),
    };
    format!(
        "(\n        look_from: {}, look_at: {}, up: {},\n        {view}, defocus_angle: {:?}, focus_distance: {:?},\n    )",
        point_text(camera.look_from),
        point_text(camera.look_at),
        point_text(camera.up),
        camera.defocus_angle.to_degrees(),
        camera.focus_distance
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    #[test]
    fn cameras_focus_on_what_they_look_at() {
        let pose = |lens: &str| {
            let text = format!("(look_from: (1, 0, 5), look_at: (1, 4, 2), vertical_fov: 40{lens})");
            ron::from_str::<Camera>(&text).unwrap().pose()
        };
        for lens in ["", ", defocus_angle: 2"] {
            assert_eq!(pose(lens).focus_distance, 5.0, "{lens}");
        }
        // Control: a distance that is stated counts.
        assert_eq!(pose(", defocus_angle: 2, focus_distance: 1").focus_distance, 1.0);
        // The distance is within its range, and too large a one is an error where it matters.
        let far = |lens: &str| {
            let text = format!("(look_from: (0, 0, -1e18), look_at: (0, 0, 1e18), vertical_fov: 40{lens})");
            ron::from_str::<Camera>(&text).map(|camera| camera.pose().focus_distance)
        };
        assert_eq!(far("").unwrap(), 1e18);
        assert!(far(", defocus_angle: 1").unwrap_err().to_string().contains("focus_distance"));
    }
}
