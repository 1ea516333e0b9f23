//! Tests of a ray against the primitives of a packet, for [`closest_hit`](super::closest_hit).

use super::{SpherePacket, TrianglePacket};
use crate::buffer::borrow;
use crate::ray::Ray;
use crate::simd::{Simd, dot};
use glam::Vec3;

/// A ray with what the tests of packets need.
#[derive(Clone, Copy)]
pub(super) struct PreparedRay {
    origin: Vec3,
    direction: Vec3,
    /// Triangles only: the axes that are the ray's own x, y and z; below, the origin along them,
    /// and the shear.
    axes: [u32; 3],
    permuted_origin: Vec3,
    shear: Vec3,
}

impl PreparedRay {
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub(super) fn new(ray: Ray) -> Self {
        let Ray { origin, direction, .. } = ray;
        // As in `Shear::new`, but without a branch, which a processor cannot predict.
        let size = direction.abs();
        let is_x = (size.x > size.y) & (size.x > size.z);
        let is_y = !is_x & (size.y > size.z);
        let z = 2 - 2 * u32::from(is_x) - u32::from(is_y);
        let x = 0b00_10_01 >> (2 * z) & 3; // next axis in cyclic order
        let y = 3 - x - z;
        let (o, d) = (origin.to_array(), direction.to_array());
        // SAFETY: three axes.
        let turn = |v: &[f32; 3]| unsafe { Vec3::new(*borrow(v, x), *borrow(v, y), *borrow(v, z)) };
        let d = turn(&d);
        let inverse = 1.0 / d.z;
        let shear = Vec3::new(d.x * inverse, d.y * inverse, inverse);
        Self { origin, direction, axes: [x, y, z], permuted_origin: turn(&o), shear }
    }
}

/// Returns a bit for each of these lanes whose triangle is hit at most at `t_max`, and the
/// distances.
///
/// It is [`Triangle::hit`](crate::triangle::Triangle::hit), lane by lane.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub(super) fn intersect_triangles<L: Simd>(
    l: L,
    packet: &TrianglePacket,
    lanes: u32,
    ray: &PreparedRay,
    origin_primitive: u32,
    t_max: f32,
) -> (u32, L::F) {
    let zero = l.splat(0.0);
    let (a, b, c) = (vertex(l, packet, 0, ray), vertex(l, packet, 3, ray), vertex(l, packet, 6, ray));
    let (u0, u1) = (l.mul(c[0], b[1]), l.mul(c[1], b[0]));
    let (v0, v1) = (l.mul(a[0], c[1]), l.mul(a[1], c[0]));
    let (w0, w1) = (l.mul(b[0], a[1]), l.mul(b[1], a[0]));
    let negative = l.or(l.or(l.lt(u0, u1), l.lt(v0, v1)), l.lt(w0, w1));
    let positive = l.or(l.or(l.lt(u1, u0), l.lt(v1, v0)), l.lt(w1, w0));
    let within = !l.bits(l.and(negative, positive)) & lanes;
    if within == 0 {
        return (0, zero);
    }
    let (u, v, w) = (l.sub(u0, u1), l.sub(v0, v1), l.sub(w0, w1));
    let determinant = l.add(l.add(u, v), w);
    let inverse = l.div(l.splat(1.0), determinant);
    let sum = l.add(l.add(l.mul(u, a[2]), l.mul(v, b[2])), l.mul(w, c[2]));
    let t = l.mul(l.mul(sum, l.splat(ray.shear.z)), inverse);
    let valid = l.and(l.lt(zero, t), l.le(t, l.splat(t_max)));
    let none = l.or(l.eq(determinant, zero), l.eq_u32(&packet.primitives, origin_primitive));
    (within & l.bits(l.and_not(none, valid)), t)
}

/// Returns the vertices from row `first` on, in the ray's coordinates.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
fn vertex<L: Simd>(l: L, packet: &TrianglePacket, first: u32, ray: &PreparedRay) -> [L::F; 3] {
    // SAFETY: `first` is 0, 3 or 6, an axis is at most 2, and there are nine rows.
    let (x, y, z) = unsafe {
        (
            l.load(borrow(&packet.vertices, first + ray.axes[0])),
            l.load(borrow(&packet.vertices, first + ray.axes[1])),
            l.load(borrow(&packet.vertices, first + ray.axes[2])),
        )
    };
    let (x, y) = (l.sub(x, l.splat(ray.permuted_origin.x)), l.sub(y, l.splat(ray.permuted_origin.y)));
    let z = l.sub(z, l.splat(ray.permuted_origin.z));
    [l.sub(x, l.mul(l.splat(ray.shear.x), z)), l.sub(y, l.mul(l.splat(ray.shear.y), z)), z]
}

/// Returns a bit for each lane whose sphere is hit at most at `t_max`, and the distances.
///
/// It is [`Sphere::distance`](crate::sphere::Sphere::distance), lane by lane.
#[inline(always)]
pub(super) fn intersect_spheres<L: Simd>(
    l: L,
    packet: &SpherePacket,
    count: u32,
    ray: &PreparedRay,
    origin_primitive: (u32, bool),
    t_max: f32,
) -> (u32, L::F) {
    let zero = l.splat(0.0);
    let [cx, cy, cz, radius] = &packet.shape;
    let origin = [l.splat(ray.origin.x), l.splat(ray.origin.y), l.splat(ray.origin.z)];
    let direction = [l.splat(ray.direction.x), l.splat(ray.direction.y), l.splat(ray.direction.z)];
    let from_center =
        [l.sub(origin[0], l.load(cx)), l.sub(origin[1], l.load(cy)), l.sub(origin[2], l.load(cz))];
    let radius = l.load(radius);
    let b = l.neg(dot(l, from_center, direction));
    let offset = [
        l.add(from_center[0], l.mul(direction[0], b)),
        l.add(from_center[1], l.mul(direction[1], b)),
        l.add(from_center[2], l.mul(direction[2], b)),
    ];
    let discriminant = l.sub(l.mul(radius, radius), dot(l, offset, offset));
    let within = !l.bits(l.lt(discriminant, zero)) & ((2 << (count - 1)) - 1);
    if within == 0 {
        return (0, zero);
    }
    let root = l.sqrt(discriminant);
    let c = l.sub(dot(l, from_center, from_center), l.mul(radius, radius));
    let is_departure = l.eq_u32(&packet.primitives, origin_primitive.0);
    let inside =
        l.or(l.and(is_departure, l.splat_mask(origin_primitive.1)), l.and_not(is_departure, l.le(c, zero)));
    let forward = l.le(zero, b);
    let q = l.select(forward, l.add(b, root), l.sub(b, root));
    let far = l.and(inside, forward);
    let t = l.select(far, q, l.mul(c, l.div(l.splat(1.0), q)));
    let stays = l.and_not(l.le(b, zero), inside);
    let leaves = l.and_not(stays, is_departure);
    let valid = l.and(l.lt(zero, t), l.le(t, l.splat(t_max)));
    (within & l.bits(l.and_not(leaves, valid)), t)
}
