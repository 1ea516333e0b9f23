//! Transforms that both formats state in the same words.

use crate::values::{sin_cos_degrees, unit};
use glam::{DAffine3, DMat3, DVec3};

/// Returns the map whose z axis points from `eye` to `target`, whose y axis is `up` as far as that
/// is possible, and whose x axis is the cross product of `up` and z; `None` if there is none.
pub fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<DAffine3> {
    let z = unit(target - eye)?;
    let x = unit(unit(up)?.cross(z)).filter(|x| x.is_finite())?;
    Some(DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), eye))
}

/// Returns the rotation by `angle` degrees about `axis`, exact for quarter turns about an axis of
/// the coordinates; `None` for an axis of length 0.
pub fn rotation(axis: DVec3, angle: f64) -> Option<DAffine3> {
    let axis = unit(axis)?;
    let (sine, cosine) = sin_cos_degrees(angle);
    let column = |v: DVec3| v * cosine + axis.cross(v) * sine + axis * axis.dot(v) * (1.0 - cosine);
    Some(DAffine3::from_mat3(DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_keeps_its_axes() {
        let map = look_at(DVec3::new(0.0, 1.0, 5.0), DVec3::new(0.0, 1.0, 0.0), DVec3::Y).unwrap();
        assert_eq!(map.transform_point3(DVec3::Z), DVec3::new(0.0, 1.0, 4.0));
        assert_eq!(map.transform_vector3(DVec3::Y), DVec3::Y);
        assert_eq!(map.transform_vector3(DVec3::X), DVec3::NEG_X);
        assert!(look_at(DVec3::ZERO, DVec3::ZERO, DVec3::Y).is_none());
        assert!(look_at(DVec3::ZERO, DVec3::Y, DVec3::Y).is_none());
    }

    #[test]
    fn rotations_are_counter_clockwise() {
        assert_eq!(rotation(DVec3::Z, 90.0).unwrap().transform_vector3(DVec3::X), DVec3::Y);
        let turned = rotation(DVec3::new(0.0, 2.0, 0.0), 30.0).unwrap().transform_vector3(DVec3::Z);
        assert!((turned - DVec3::new(0.5, 0.0, 0.75f64.sqrt())).length() < 1e-12);
        assert!(rotation(DVec3::ZERO, 30.0).is_none());
    }
}
