//! Choice of the origin relative to which a model's positions are stored.
//!
//! A description stores positions in f32. For a model far from 0, such as one in the coordinates of
//! a national grid, that would round away details of its shape. Its positions are therefore stored
//! relative to its centre, and the transforms of its instances, which are f64, add the centre.

use super::source_location::SourceLocation;
use super::warnings::Warnings;
use crate::values::MAX_MAGNITUDE;
use glam::DVec3;

/// Maximum distance of a file's centre from 0, in half extents, at which positions are stored as
/// they are. f32 then rounds them to 2^-20 of the half extent or better, which is below what an
/// image shows. Beyond it, the loss grows without bound.
const MAX_DISTANCE: f64 = 16.0;

/// Maximum distance of the centre from 0, in half extents, for files that are in single precision
/// themselves. Beyond it, they are rounded by 2^-10 of the half extent or more.
const MAX_SINGLE_DISTANCE: f64 = 16384.0;

/// Bounding box of positions.
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(positions: impl Iterator<Item = DVec3>) -> Self {
        let empty = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        positions.fold(empty, |Self { low, high }, p| Self { low: low.min(p), high: high.max(p) })
    }

    fn center(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// Returns whether the centre is more than `limit` half extents from 0; `false` without
    /// positions.
    fn is_farther(&self, limit: f64) -> bool {
        let half = 0.5 * (self.high - self.low).max_element();
        self.center().abs().max_element() > limit * half
    }
}

/// Returns the point that all meshes of a file are stored relative to: 0, or the centre of
/// `positions`, those that triangles use.
///
/// All meshes of a file share the origin, so vertices that two meshes share stay at the same place,
/// and no crack opens between them.
pub(super) fn choose(positions: impl Iterator<Item = [f64; 3]>) -> DVec3 {
    let bounds = Bounds::of(positions.map(DVec3::from));
    // Close to the limit of coordinates, rounding could move a vertex beyond it.
    let inside = bounds.low.abs().max(bounds.high.abs()).max_element() <= 0.5 * MAX_MAGNITUDE;
    if inside && bounds.is_farther(MAX_DISTANCE) { bounds.center() } else { DVec3::ZERO }
}

/// Returns a position relative to `origin`, in f32.
pub(super) fn relative(position: [f64; 3], origin: DVec3) -> [f32; 3] {
    (DVec3::from(position) - origin).as_vec3().into()
}

/// Warns of positions that a file stores in single precision and too far from 0: no reader can
/// restore their digits.
pub(super) fn warn_of_single(positions: &[[f32; 3]], site: &SourceLocation, warnings: &mut Warnings) {
    let bounds = Bounds::of(positions.iter().map(|position| DVec3::from(position.map(f64::from))));
    if bounds.is_farther(MAX_SINGLE_DISTANCE) {
        let what = "meshes in single precision far from the origin, whose small details the file has lost; export double \
                    precision, or move the model to the origin first";
        warnings.tally(what, 1, &site.place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns two opposite corners of a cube with half edge 1.
    fn cube(center: DVec3) -> [[f64; 3]; 2] {
        [(center - 1.0).into(), (center + 1.0).into()]
    }

    #[test]
    fn only_far_files_get_an_origin() {
        for near in [DVec3::ZERO, DVec3::new(0.0, 1.0, 0.0), DVec3::new(16.0, -16.0, 3.0)] {
            assert_eq!(choose(cube(near).into_iter()), DVec3::ZERO);
        }
        for far in [DVec3::new(0.0, -17.0, 3.0), DVec3::new(4.5e6, 250.0, 5.4e6)] {
            assert_eq!(choose(cube(far).into_iter()), far);
        }
        let border = [[1e18, 0.0, 0.0], [0.999e18, 0.0, 0.0]];
        assert_eq!(choose(border.into_iter()), DVec3::ZERO);
        assert_eq!(choose(std::iter::empty()), DVec3::ZERO);
    }

    #[test]
    fn positions_near_the_origin_keep_their_bits() {
        for x in [0.1, -0.0, 0.0, 1e-40, 16.7, -3e18] {
            assert_eq!(relative([x; 3], DVec3::ZERO).map(f32::to_bits), [(x as f32).to_bits(); 3]);
        }
    }
}
