//! Triangles: records, and the watertight intersection of Woop, Benthin and Wald (JCGT 2(1), 2013).
//!
//! Called by [`crate::traversal`], and again by [`crate::surface`] for the hit; `wide` repeats it
//! lane by lane.

use crate::math::{max, max_component};
use crate::sphere::MISS;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Triangle of a mesh. 48 bytes. Neighbours hold the same bits for a corner that they share.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Triangle {
    /// First corner, in scene units.
    pub a: Vec3,
    /// Index of the first corner among the scene's [vertices](crate::attributes::MeshVertex).
    pub vertex_a: u32,
    /// Second corner, in scene units; counter-clockwise seen from the front.
    pub b: Vec3,
    /// Index of the second corner's vertex.
    pub vertex_b: u32,
    /// Third corner, in scene units.
    pub c: Vec3,
    /// Index of the third corner's vertex.
    pub vertex_c: u32,
}

const _: () = assert!(size_of::<Triangle>() == 48 && align_of::<Triangle>() == 16);

/// Ray coordinates for the intersection: the coordinate axis nearest to the ray is z, and shearing
/// makes the ray exactly +z.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Axis that becomes z: 0 x, 1 y, 2 z.
    axis: u32,
    x: f32,
    y: f32,
    z: f32,
}

/// Returns `v` with its axes permuted cyclically, so that `axis` is the third.
#[inline(always)]
fn permute_axes(v: Vec3, axis: u32) -> Vec3 {
    // Values that are there select without a branch, of which some compilers of drivers follow each
    // combination.
    let (is_x, is_y) = (axis == 0, axis == 1);
    let x = if is_y { v.z } else { v.x };
    let y = if is_y { v.x } else { v.y };
    let z = if is_y { v.y } else { v.z };
    Vec3::new(if is_x { v.y } else { x }, if is_x { v.z } else { y }, if is_x { v.x } else { z })
}

impl Shear {
    /// Returns the ray coordinates of a direction that is not zero.
    #[inline(always)]
    pub fn new(direction: Vec3) -> Self {
        let (x, y, z) = (direction.x.abs(), direction.y.abs(), direction.z.abs());
        let others = if y > z { 1 } else { 2 };
        let axis = if (x > y) & (x > z) { 0 } else { others };
        let d = permute_axes(direction, axis);
        let inverse = 1.0 / d.z;
        Self { axis, x: d.x * inverse, y: d.y * inverse, z: inverse }
    }

    /// Returns a vertex, given from the ray's origin, in ray coordinates: x, y sheared; z not yet
    /// scaled.
    #[inline(always)]
    fn apply(&self, v: Vec3) -> Vec3 {
        let v = permute_axes(v, self.axis);
        Vec3::new(v.x - self.x * v.z, v.y - self.y * v.z, v.z)
    }
}

/// Hit of a ray on a triangle: distance, and barycentric weights of the second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance along the ray, or [`MISS`].
    pub distance: f32,
    /// Weight of vertex `b`.
    pub weight_b: f32,
    /// Weight of vertex `c`.
    pub weight_c: f32,
}

const NO_HIT: TriangleHit = TriangleHit { distance: MISS, weight_b: 0.0, weight_c: 0.0 };

impl Triangle {
    /// Minimum square of the length of [`Triangle::normal`] for which it is usable as a normal.
    /// Below it, a device that flushes denormals may lose a square that the length needs. A
    /// triangle with less is a line, 1e-15 of its length wide; the host drops it.
    pub const MIN_SQUARE: f32 = 1e-30;

    /// Returns the triangle with these corners, which share the scene's first vertex.
    #[inline(always)]
    pub const fn of([a, b, c]: [Vec3; 3]) -> Self {
        Self { a, vertex_a: 0, b, vertex_b: 0, c, vertex_c: 0 }
    }

    /// Returns the hit of the ray from `origin` on the triangle, from either side.
    ///
    /// A ray through an edge or a vertex hits at least one of the triangles that share it. For
    /// that, the signs of the three edge functions must agree between neighbours. The signs come
    /// from comparing the two rounded products of each function. Rounding is monotonic, so a sign
    /// is right or, if the products round to the same number, zero. No compiler contracts a
    /// comparison to a fused operation, which would round differently for the two neighbours. A
    /// function of sign zero accepts the ray, for both neighbours. Where Woop et al. decide by
    /// double precision, which is optional on Vulkan, this accepts a hit too many, closer to the
    /// edge than rounding.
    #[inline(always)]
    pub fn hit(&self, origin: Vec3, shear: &Shear) -> TriangleHit {
        let a = shear.apply(self.a - origin);
        let b = shear.apply(self.b - origin);
        let c = shear.apply(self.c - origin);
        let (u0, u1) = (c.x * b.y, c.y * b.x);
        let (v0, v1) = (a.x * c.y, a.y * c.x);
        let (w0, w1) = (b.x * a.y, b.y * a.x);
        let negative = (u0 < u1) | (v0 < v1) | (w0 < w1);
        let positive = (u0 > u1) | (v0 > v1) | (w0 > w1);
        if negative & positive {
            return NO_HIT;
        }
        let (u, v, w) = (u0 - u1, v0 - v1, w0 - w1);
        let determinant = u + v + w;
        if determinant == 0.0 {
            return NO_HIT;
        }
        let inverse = 1.0 / determinant;
        let distance = (u * a.z + v * b.z + w * c.z) * shear.z * inverse;
        if distance > 0.0 {
            TriangleHit { distance, weight_b: v * inverse, weight_c: w * inverse }
        } else {
            NO_HIT
        }
    }

    /// Returns the normal on the front side, not of unit length.
    ///
    /// Its length is twice the area of the triangle, scaled so that the longest extent of the edges
    /// at `a` along an axis is 1 to 2. It depends on the shape alone; the cross product of the
    /// edges themselves leaves f32's range for edges below 3e-10 or above 4e9. The scale is a power
    /// of two and rounds nothing, so the normal of nearly parallel edges is the same on every
    /// device.
    #[inline(always)]
    pub fn normal(&self) -> Vec3 {
        let (b, c) = (self.b - self.a, self.c - self.a);
        let exponent = max(max_component(b.abs()), max_component(c.abs())).to_bits() >> 23; // of a number that is not negative
        let scale = f32::from_bits(if exponent < 254 { 254 - exponent } else { 1 } << 23);
        (b * scale).cross(c * scale)
    }
}
