//! Checks of values that are valid on their own but may not be together: after they are read, and
//! after a change of space.

use crate::values::{MAX_MAGNITUDE, MIN_MAGNITUDE};
use glam::{DAffine3, DMat3, DVec3};

/// Maximum coordinate of a vertex: products of three coordinates, which the triangle test computes,
/// stay finite in f32.
pub const MAX_VERTEX: f64 = 1e12;

/// Checks that a parallelogram still has an area after rounding to f32.
pub fn has_area(u: DVec3, v: DVec3) -> Result<(), String> {
    let (u, v) = (u.as_vec3().as_dvec3(), v.as_vec3().as_dvec3());
    let least = 0.999 * MIN_MAGNITUDE; // rounding may shorten a side of the minimum length
    if u.length() < least || v.length() < least {
        Err("u and v must be at least 1e-18 long".to_owned())
    } else if u.cross(v).length() < least * least {
        Err("u and v are parallel: u × v is 0 (or shorter than 1e-36)".to_owned())
    } else {
        Ok(())
    }
}

/// Returns whether all numbers of a map are within the range of coordinates.
pub fn in_range(map: &DAffine3) -> bool {
    map.to_cols_array().iter().all(|number| number.abs() <= MAX_MAGNITUDE)
}

/// Returns whether a map flattens space. A thin slab, scaled along one axis, is not flat: either
/// its columns or its rows are far from a common plane.
pub fn is_singular(map: &DAffine3) -> bool {
    let flat = |m: DMat3| {
        let lengths = [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()];
        let units = DMat3::from_cols(m.x_axis / lengths[0], m.y_axis / lengths[1], m.z_axis / lengths[2]);
        lengths.iter().any(|&length| length < 0.999 * MIN_MAGNITUDE) || units.determinant().abs() < 1e-12
    };
    flat(map.matrix3) && flat(map.matrix3.transpose())
}

/// Returns whether the triangle test can compute with a vertex.
pub(crate) fn is_in_reach(vertex: DVec3) -> bool {
    vertex.is_finite() && vertex.abs().max_element() <= MAX_VERTEX
}
