//! Probe of single primitives: intersection, projection and normals, without a scene.

use crate::record::{Input, Output, ProbeParams, row, row4, vector};
use glam::{UVec4, Vec3};
use trisect_shared::math::sqrt;
use trisect_shared::planar::Planar;
use trisect_shared::ray::OriginPrimitive;
use trisect_shared::scene::Scene;
use trisect_shared::sphere::{MISS, Sphere};
use trisect_shared::triangle::{Shear, Triangle};

/// Intersects a sphere. Rows: a centre and radius; b origin; c direction; d whether the ray leaves
/// the sphere itself, and whether inward. Output: distance.
pub const SPHERE: u32 = 0;
/// Intersects a sphere by the textbook's discriminant b² - c, with rows a to c of [`SPHERE`]: a
/// negative control.
pub const NAIVE_SPHERE: u32 = 1;
/// Projects a point onto a sphere. Rows: a centre and radius; b point; c direction. Output: a
/// normal; b point.
pub const PROJECT: u32 = 2;
/// Intersects a triangle. Rows: a, b, c vertices; d origin; e direction. Output: distance, weights
/// of b and c.
pub const TRIANGLE: u32 = 3;
/// Intersects a triangle by Möller and Trumbore (JGT 2(1), 1997), with the rows of [`TRIANGLE`] and
/// the distance as output: a negative control.
pub const LEAKY_TRIANGLE: u32 = 4;
/// Intersects a planar shape. Rows: a origin and kind; b normal; c dual of u; d dual of v; e ray's
/// origin; f direction. Output: distance.
pub const PLANAR: u32 = 5;
/// Normal of a triangle. Rows: a, b, c vertices. Output: the normal, not normalised.
pub const TRIANGLE_NORMAL: u32 = 6;

/// Runs the operation that `params.operation` names; the constants above state the rows. The result
/// is output a, unless they state otherwise.
#[inline(always)]
pub fn shapes(params: &ProbeParams, _: Scene, input: Input) -> Output {
    let operation = params.operation;
    let mut out = Output { a: UVec4::ZERO, b: UVec4::ZERO };
    let radius = f32::from_bits(input.a.w);
    let sphere = Sphere { center: vector(input.a), radius, material: 0, pad: [0; 3] };
    let triangle = Triangle::of([vector(input.a), vector(input.b), vector(input.c)]);
    if operation == SPHERE {
        let origin_primitive = OriginPrimitive::new(0, input.d.y != 0);
        let t = sphere.distance(vector(input.b), vector(input.c), input.d.x != 0, origin_primitive);
        out.a = row4(t, 0.0, 0.0, 0.0);
    } else if operation == NAIVE_SPHERE {
        out.a = row4(naive_sphere(&sphere, vector(input.b), vector(input.c)), 0.0, 0.0, 0.0);
    } else if operation == PROJECT {
        let (normal, point) = sphere.project(vector(input.b), vector(input.c));
        out = Output { a: row(normal, 0), b: row(point, 0) };
    } else if operation == TRIANGLE {
        let hit = triangle.hit(vector(input.d), &Shear::new(vector(input.e)));
        out.a = row4(hit.distance, hit.weight_b, hit.weight_c, 0.0);
    } else if operation == LEAKY_TRIANGLE {
        out.a = row4(leaky_triangle(&triangle, vector(input.d), vector(input.e)), 0.0, 0.0, 0.0);
    } else if operation == PLANAR {
        let zero = Vec3::ZERO;
        let planar = Planar {
            origin: vector(input.a),
            material: 0,
            normal: vector(input.b),
            kind: input.a.w,
            dual_u: vector(input.c),
            pad0: 0,
            dual_v: vector(input.d),
            pad1: 0,
            edge_u: zero,
            area: 0.0,
            edge_v: zero,
            pad2: 0,
        };
        out.a = row4(planar.distance(vector(input.e), vector(input.f)), 0.0, 0.0, 0.0);
    } else if operation == TRIANGLE_NORMAL {
        out.a = row(triangle.normal(), 0);
    }
    out
}

#[inline(always)]
fn naive_sphere(sphere: &Sphere, origin: Vec3, direction: Vec3) -> f32 {
    let from_center = origin - sphere.center;
    let b = from_center.dot(direction);
    let c = from_center.dot(from_center) - sphere.radius * sphere.radius;
    let discriminant = b * b - c;
    if discriminant < 0.0 {
        return MISS;
    }
    let near = -b - sqrt(discriminant);
    if near > 1e-3 { near } else { -b + sqrt(discriminant) }
}

#[inline(always)]
fn leaky_triangle(triangle: &Triangle, origin: Vec3, direction: Vec3) -> f32 {
    let (edge_b, edge_c) = (triangle.b - triangle.a, triangle.c - triangle.a);
    let p = direction.cross(edge_c);
    let determinant = edge_b.dot(p);
    if determinant == 0.0 {
        return MISS;
    }
    let s = origin - triangle.a;
    let q = s.cross(edge_b);
    let (u, v) = (s.dot(p) / determinant, direction.dot(q) / determinant);
    let t = edge_c.dot(q) / determinant;
    if (u < 0.0) | (v < 0.0) | (u + v > 1.0) | (t <= 0.0) { MISS } else { t }
}
