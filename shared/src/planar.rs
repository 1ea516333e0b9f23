//! Planar shapes: parallelograms and discs. Traversal and surface call it.
//!
//! A disc of great radius serves as a plane. A giant sphere would not: its curvature drowns in
//! rounding.

use crate::sphere::MISS;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Kind of a parallelogram: 0 ≤ u, v ≤ 1.
pub const QUAD: u32 = 0;
/// Kind of an ellipse: u² + v² ≤ 1; a disc if its axes are perpendicular and of equal length.
pub const DISC: u32 = 1;

/// Planar shape in its own coordinates: point = `origin` + u `edge_u` + v `edge_v`. 96 bytes;
/// traversal reads four rows.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Planar {
    /// Corner of a quad or centre of a disc, in scene units.
    pub origin: Vec3,
    /// Index into the scene's materials.
    pub material: u32,
    /// Unit normal, along `edge_u` × `edge_v`; it points to the front.
    pub normal: Vec3,
    /// Kind: [`QUAD`] or [`DISC`].
    pub kind: u32,
    /// Dual vector of u: u of a point of the plane is the dot product of `dual_u` and the point's
    /// offset from `origin`.
    pub dual_u: Vec3,
    /// Unused.
    pub pad0: u32,
    /// Dual vector of v: v of a point of the plane is the dot product of `dual_v` and the point's
    /// offset from `origin`.
    pub dual_v: Vec3,
    /// Unused.
    pub pad1: u32,
    /// Edge or half axis along u, in scene units.
    pub edge_u: Vec3,
    /// Area in square scene units.
    pub area: f32,
    /// Edge or half axis along v, in scene units.
    pub edge_v: Vec3,
    /// Unused.
    pub pad2: u32,
}

const _: () = assert!(size_of::<Planar>() == 96 && align_of::<Planar>() == 16);

impl Planar {
    /// Returns the distance along `direction` to the shape in front of `origin`, or [`MISS`]; a ray
    /// in its plane misses.
    #[inline(always)]
    #[allow(
        clippy::manual_range_contains,
        reason = "rust-gpu has no references in records, which `contains` of a range needs"
    )]
    pub fn distance(&self, origin: Vec3, direction: Vec3) -> f32 {
        let to_plane = (self.origin - origin).dot(self.normal);
        let approach = direction.dot(self.normal);
        if approach == 0.0 {
            return MISS;
        }
        let t = to_plane * (1.0 / approach);
        let from_origin = origin + direction * t - self.origin;
        let (u, v) = (from_origin.dot(self.dual_u), from_origin.dot(self.dual_v));
        let inside = if self.kind == DISC {
            u * u + v * v <= 1.0
        } else {
            u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0
        };
        if inside && t > 0.0 { t } else { MISS }
    }

    /// Returns u and v of a point near the plane.
    #[inline(always)]
    pub fn coordinates(&self, point: Vec3) -> (f32, f32) {
        let from_origin = point - self.origin;
        (from_origin.dot(self.dual_u), from_origin.dot(self.dual_v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planar(kind: u32) -> Planar {
        Planar {
            origin: Vec3::new(0.0, 1.0, 0.0),
            normal: Vec3::Y,
            kind,
            dual_u: Vec3::Z * 0.5,
            dual_v: Vec3::X,
            edge_u: Vec3::Z * 2.0,
            edge_v: Vec3::X,
            ..Planar::zeroed()
        }
    }

    #[test]
    fn hits_inside_only() {
        let down = |f: Planar, x, z| f.distance(Vec3::new(x, 3.0, z), Vec3::NEG_Y);
        assert_eq!(down(planar(QUAD), 0.5, 1.9), 2.0);
        assert_eq!(down(planar(QUAD), 0.5, 2.1), MISS);
        assert_eq!(down(planar(QUAD), -0.1, 1.0), MISS);
        assert_eq!(down(planar(DISC), -0.6, -1.4), 2.0);
        assert_eq!(down(planar(DISC), -0.8, -1.4), MISS);
    }

    /// Torture test 23: rays along exact axes, in the plane, from behind, and away from it.
    #[test]
    fn flat_rays() {
        let q = planar(QUAD);
        assert_eq!(q.distance(Vec3::new(0.5, -1.0, 1.0), Vec3::Y), 2.0);
        assert_eq!(q.distance(Vec3::new(0.5, 3.0, 1.0), Vec3::Y), MISS);
        assert_eq!(q.distance(Vec3::new(-1.0, 1.0, 1.0), Vec3::X), MISS);
        assert_eq!(q.distance(Vec3::new(0.5, 1.0, 1.0), Vec3::NEG_Y), MISS); // t = 0: the origin lies on it
    }

    #[test]
    fn coordinates_of_a_point() {
        assert_eq!(planar(QUAD).coordinates(Vec3::new(0.25, 1.0, 1.0)), (0.5, 0.25));
    }
}
