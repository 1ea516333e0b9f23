//! Triangles by the watertight test of Woop, Benthin and Wald (JCGT 2(1), 2013).

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
    /// Unused.
    pub pad0: u32,
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
fn turn(v: Vec3, axis: u32) -> Vec3 {
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
        let d = turn(direction, axis);
        let inverse = 1.0 / d.z;
        Self { axis, x: d.x * inverse, y: d.y * inverse, z: inverse }
    }

    /// A vertex, from the ray's origin, in the ray's coordinates: x, y sheared; z not yet scaled.
    #[inline(always)]
    fn apply(&self, v: Vec3) -> Vec3 {
        let v = turn(v, self.axis);
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

/// The sign of the exact a · b - c · d, for finite numbers: by integers, since f64 is an option on Vulkan, and error-free
/// products in f32 are lost where a driver contracts operations.
#[inline(never)]
fn exact_sign(a: f32, b: f32, c: f32, d: f32) -> i32 {
    let p = Product::new(a, b);
    let q = Product::new(c, d);
    if p.negative != q.negative || p.is_zero() || q.is_zero() {
        return p.sign() - q.sign();
    }
    let magnitude = p.compare(&q);
    if p.negative { -magnitude } else { magnitude }
}

/// |a · b| = (`high` 2³² + `low`) 2^`exponent`, with the top bit of `high` set unless it is zero.
struct Product {
    negative: bool,
    exponent: i32,
    high: u32,
    low: u32,
}

impl Product {
    fn new(a: f32, b: f32) -> Self {
        let (a, b) = (a.to_bits(), b.to_bits());
        let (exponent_a, exponent_b) = ((a >> 23) & 0xff, (b >> 23) & 0xff);
        let (m_a, m_b) = (fraction(a, exponent_a), fraction(b, exponent_b));
        let (mut high, mut low) = (crate::math::mul_high(m_a, m_b), m_a.wrapping_mul(m_b));
        let mut exponent = exponent_a.max(1) as i32 + exponent_b.max(1) as i32;
        if high == 0 {
            (high, low, exponent) = (low, 0, exponent - 32);
        }
        if high != 0 {
            let shift = high.leading_zeros();
            if shift > 0 {
                high = high << shift | low >> (32 - shift);
                low <<= shift;
                exponent -= shift as i32;
            }
        }
        Self { negative: (a ^ b) >> 31 != 0, exponent, high, low }
    }

    fn is_zero(&self) -> bool {
        self.high == 0
    }

    fn sign(&self) -> i32 {
        if self.is_zero() {
            0
        } else if self.negative {
            -1
        } else {
            1
        }
    }

    fn compare(&self, other: &Self) -> i32 {
        if self.exponent != other.exponent {
            return if self.exponent > other.exponent { 1 } else { -1 };
        }
        if self.high != other.high {
            return if self.high > other.high { 1 } else { -1 };
        }
        if self.low != other.low {
            return if self.low > other.low { 1 } else { -1 };
        }
        0
    }
}

fn fraction(bits: u32, exponent: u32) -> u32 {
    let fraction = bits & 0x007f_ffff;
    if exponent == 0 { fraction } else { fraction | 0x0080_0000 }
}

impl Triangle {
    /// Where the ray from `origin` meets the triangle, from either side.
    ///
    /// A ray through an edge or a vertex meets at least one of the triangles that share it. For that the three edge functions'
    /// signs must be exact: they come from comparing rounded products, which rounds the same way for both neighbours and
    /// which no compiler contracts to a fused operation, and from integers where the products are equal.
    #[inline(always)]
    pub fn hit(&self, origin: Vec3, shear: &Shear) -> TriangleHit {
        let a = shear.apply(self.a - origin);
        let b = shear.apply(self.b - origin);
        let c = shear.apply(self.c - origin);
        let (u0, u1) = (c.x * b.y, c.y * b.x);
        let (v0, v1) = (a.x * c.y, a.y * c.x);
        let (w0, w1) = (b.x * a.y, b.y * a.x);
        let mut negative = (u0 < u1) | (v0 < v1) | (w0 < w1);
        let mut positive = (u0 > u1) | (v0 > v1) | (w0 > w1);
        if negative & positive {
            return NO_HIT;
        }
        if (u0 == u1) | (v0 == v1) | (w0 == w1) {
            let u = exact_sign(c.x, b.y, c.y, b.x);
            let v = exact_sign(a.x, c.y, a.y, c.x);
            let w = exact_sign(b.x, a.y, b.y, a.x);
            negative = (u < 0) | (v < 0) | (w < 0);
            positive = (u > 0) | (v > 0) | (w > 0);
            if negative == positive {
                return NO_HIT; // a miss by less than rounding, or a triangle seen edge on
            }
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

    /// Not of unit length; along the front's side; twice the area long.
    #[inline(always)]
    pub fn normal(&self) -> Vec3 {
        (self.b - self.a).cross(self.c - self.a)
    }
}

#[cfg(test)]
mod tests;
