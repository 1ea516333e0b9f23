//! Triangles by the watertight test of Woop, Benthin and Wald (JCGT 2(1), 2013).

use crate::math::{max, max_component};
use crate::sphere::MISS;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A triangle's vertices. 48 bytes. Neighbours hold the same bits for a vertex that they share.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Triangle {
    /// First vertex, in scene units.
    pub a: Vec3,
    /// Index into the scene's materials.
    pub material: u32,
    /// Second vertex, counter-clockwise seen from the front.
    pub b: Vec3,
    /// Which instance of a mesh it is of, counted from 0: for the host alone.
    pub instance: u32,
    /// Third vertex.
    pub c: Vec3,
    /// Unused.
    pub pad1: u32,
}

const _: () = assert!(size_of::<Triangle>() == 48 && align_of::<Triangle>() == 16);

/// What shading needs of a triangle besides its vertices. 64 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TriangleShading {
    /// Unit normal at the first vertex; zero for flat shading.
    pub normal_a: Vec3,
    /// Texture coordinates by vertex.
    pub u_a: f32,
    /// At the second.
    pub normal_b: Vec3,
    /// At the second.
    pub u_b: f32,
    /// At the third.
    pub normal_c: Vec3,
    /// At the third.
    pub u_c: f32,
    /// At the first.
    pub v_a: f32,
    /// At the second.
    pub v_b: f32,
    /// At the third.
    pub v_c: f32,
    /// Unused.
    pub pad: u32,
}

const _: () = assert!(size_of::<TriangleShading>() == 64 && align_of::<TriangleShading>() == 16);

/// A ray as the test wants it: the coordinate axis nearest to it is z, and shearing makes it exactly +z.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Which axis: 0 x, 1 y, 2 z.
    axis: u32,
    x: f32,
    y: f32,
    z: f32,
}

/// The cyclic turn of axes that makes `axis` the third.
#[inline(always)]
fn permute_axes(v: Vec3, axis: u32) -> Vec3 {
    let (is_x, is_y) = (axis == 0, axis == 1);
    Vec3::new(
        if is_x {
            v.y
        } else if is_y {
            v.z
        } else {
            v.x
        },
        if is_x {
            v.z
        } else if is_y {
            v.x
        } else {
            v.y
        },
        if is_x {
            v.x
        } else if is_y {
            v.y
        } else {
            v.z
        },
    )
}

impl Shear {
    /// Of a direction that is not zero.
    #[inline(always)]
    pub fn new(direction: Vec3) -> Self {
        let (x, y, z) = (direction.x.abs(), direction.y.abs(), direction.z.abs());
        let axis = if x > y && x > z {
            0
        } else if y > z {
            1
        } else {
            2
        };
        let d = permute_axes(direction, axis);
        let inverse = 1.0 / d.z;
        Self { axis, x: d.x * inverse, y: d.y * inverse, z: inverse }
    }

    /// A vertex, from the ray's origin, in the ray's coordinates: x, y sheared; z not yet scaled.
    #[inline(always)]
    fn apply(&self, v: Vec3) -> Vec3 {
        let v = permute_axes(v, self.axis);
        Vec3::new(v.x - self.x * v.z, v.y - self.y * v.z, v.z)
    }
}

/// Where a ray meets a triangle: distance, or [`MISS`], and the weights of its second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Along the ray.
    pub distance: f32,
    /// Of `b`.
    pub weight_b: f32,
    /// Of `c`.
    pub weight_c: f32,
}

const NO_HIT: TriangleHit = TriangleHit { distance: MISS, weight_b: 0.0, weight_c: 0.0 };

impl Triangle {
    /// The least square of [`Triangle::normal`]'s length for which it is one: below, a device that flushes denormals may lose a square
    /// that the length needs. A triangle with less is a line, 1e-15 of its length wide.
    pub const MIN_SQUARE: f32 = 1e-30;

    /// Where the ray from `origin` meets the triangle, from either side.
    ///
    /// A ray through an edge or a vertex meets at least one of the triangles that share it. For that, the signs of the three edge
    /// functions must agree between neighbours. They come from comparing the rounded products of each function: rounding is
    /// monotonic, so a sign is right or, where the products round to the same number, none; and no compiler contracts a comparison
    /// to a fused operation, which would round differently for the two neighbours. A function without a sign lets the ray in, for
    /// both neighbours: where Woop et al. decide by double precision, which on Vulkan is an option, this errs by a hit too many,
    /// closer to the edge than rounding.
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

    /// Along the front's side, not of unit length: twice the area long if the longest extent of an edge along an axis is taken for 1 to
    /// 2. So it depends on the shape alone; the edges' own product leaves f32's range for edges below 3e-10 or above 4e9. The scale
    /// is a power of two, which rounds nothing: what it is of nearly parallel edges is the same on every device.
    #[inline(always)]
    pub fn normal(&self) -> Vec3 {
        let (b, c) = (self.b - self.a, self.c - self.a);
        let exponent = max(max_component(b.abs()), max_component(c.abs())).to_bits() >> 23; // of a number that is not negative
        let scale = f32::from_bits(if exponent < 254 { 254 - exponent } else { 1 } << 23);
        (b * scale).cross(c * scale)
    }
}
