//! The transforms of objects in a scene file.

use crate::limits::{in_range, is_singular};
use crate::ron_error::message;
use crate::values::{Angle, Coordinate, Direction, Factor, Point, sin_cos_degrees, vector};
use glam::{DAffine3, DMat3, DVec3};
use serde::Deserialize;

/// One step of a transform.
#[derive(Debug, Deserialize)]
pub enum Step {
    /// Scaling about the origin, equal along all axes.
    Scale(Factor),
    /// Scaling about the origin, along each axis.
    ScaleXyz((Factor, Factor, Factor)),
    /// Rotation about +x, in degrees.
    RotateX(Angle),
    /// Rotation about +y, in degrees.
    RotateY(Angle),
    /// Rotation about +z, in degrees.
    RotateZ(Angle),
    /// Rotation about any axis through the origin.
    Rotate {
        /// Axis; the rotation is counter-clockwise seen against it.
        axis: Direction,
        /// Angle in degrees.
        angle: Angle,
    },
    /// Translation by a vector.
    Translate(Point),
    /// Any affine map: three rows of four.
    Matrix((Row, Row, Row)),
}

/// A row of a matrix; its last number is the translation.
pub type Row = (Coordinate, Coordinate, Coordinate, Coordinate);

impl Step {
    fn affine(&self) -> DAffine3 {
        match self {
            Self::Scale(factor) => DAffine3::from_scale(DVec3::splat(factor.0)),
            Self::ScaleXyz(factors) => DAffine3::from_scale(vector(*factors)),
            Self::RotateX(angle) => rotation(DVec3::X, angle.0),
            Self::RotateY(angle) => rotation(DVec3::Y, angle.0),
            Self::RotateZ(angle) => rotation(DVec3::Z, angle.0),
            Self::Rotate { axis, angle } => rotation(axis.0, angle.0),
            Self::Translate(by) => DAffine3::from_translation(vector(*by)),
            Self::Matrix((x, y, z)) => {
                let linear = [x, y, z].map(|row| vector((row.0, row.1, row.2)));
                DAffine3::from_mat3_translation(
                    DMat3::from_cols_array_2d(&linear.map(|row| row.to_array())).transpose(),
                    vector((x.3, y.3, z.3)),
                )
            }
        }
    }
}

/// Returns a rotation by Rodrigues' formula. glam's rotation takes the sine of radians, which is
/// not exact for quarter turns.
fn rotation(axis: DVec3, degrees: f64) -> DAffine3 {
    let (sine, cosine) = sin_cos_degrees(degrees);
    let column = |e: DVec3| cosine * e + sine * axis.cross(e) + (1.0 - cosine) * axis.dot(e) * axis;
    DAffine3::from_mat3(DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z)))
}

/// An invertible map: a list of steps, applied from the first to the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(try_from = "Vec<Step>")]
pub struct Transform(pub DAffine3);

impl TryFrom<Vec<Step>> for Transform {
    type Error = String;

    fn try_from(steps: Vec<Step>) -> Result<Self, String> {
        let all = steps.iter().fold(DAffine3::IDENTITY, |done, step| step.affine() * done);
        if !in_range(&all) {
            Err("the transform's numbers go beyond 1e18".to_owned())
        } else if is_singular(&all) {
            Err("the transform is singular: it flattens space".to_owned())
        } else {
            Ok(Self(all))
        }
    }
}

/// Returns the map of the text of a field `transform`.
///
/// ```
/// let map = trisect_scene::parse_transform("[Scale(2), Translate((0, 1, 0))]")?;
/// assert_eq!(map.transform_point3(glam::DVec3::X), glam::DVec3::new(2.0, 1.0, 0.0));
/// # Ok::<(), String>(())
/// ```
///
/// # Errors
///
/// A message for text that is no list of steps, and for a map that is singular or out of range.
pub fn parse_transform(text: &str) -> Result<DAffine3, String> {
    ron::from_str(text).map(|Transform(map)| map).map_err(|error| message(&error.code))
}
