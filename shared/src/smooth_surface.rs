//! The smooth surface that the triangles of a mesh stand for, which softens the edge of the shadow
//! on it.
//!
//! Vertex normals shade a triangle as part of a curved surface, but its own horizon cuts the light
//! off triangle by triangle. Rays that leave a triangle near its horizon, or below it, therefore
//! start at the height of the curved surface (Hanika, "Hacking the Shadow Terminator", Ray Tracing
//! Gems II, chapter 4, 2021), along the triangle's normal.
//!
//! The image is biased there: a surface that is closer to the triangle than this height, at most
//! [`MAX_HEIGHT`] of the triangle's size, does not shade it from light near the horizon.

use crate::attributes::TriangleVertices;
use crate::math::{max, max_component, min};
use crate::triangle::Triangle;
use glam::Vec3;

/// Maximum height, relative to the longest extent of the triangle's edges along an axis: that of a
/// sphere whose radius is 1.7 edges.
pub const MAX_HEIGHT: f32 = 0.1;

/// Cosine with the triangle's normal below which rays start above the triangle.
pub const NEAR_HORIZON: f32 = 0.1;

/// Returns the height above a point of a triangle of the curved surface that the normals of its
/// vertices imply: the mean of the heights of the point's projections to the tangent planes at the
/// vertices. `facing` is the triangle's unit normal on the viewer's side; `(a, b, c)` are the
/// point's barycentric weights. It is 0 where the surface is concave on that side.
#[inline(always)]
pub fn height(
    triangle: &Triangle,
    vertices: &TriangleVertices,
    point: Vec3,
    facing: Vec3,
    (a, b, c): (f32, f32, f32),
) -> f32 {
    let of_a = rise(point - triangle.a, vertices.a.normal, facing);
    let of_b = rise(point - triangle.b, vertices.b.normal, facing);
    let of_c = rise(point - triangle.c, vertices.c.normal, facing);
    let edges =
        max(max_component((triangle.b - triangle.a).abs()), max_component((triangle.c - triangle.a).abs()));
    min(of_a * a + of_b * b + of_c * c, MAX_HEIGHT * edges)
}

/// Returns the height of the projection of a point, given from a vertex, to the tangent plane
/// there, if the point is below it.
#[inline(always)]
fn rise(from_vertex: Vec3, normal: Vec3, facing: Vec3) -> f32 {
    let cos = normal.dot(facing);
    let below = from_vertex.dot(normal) * (if cos < 0.0 { 1.0 } else { -1.0 });
    max(below, 0.0) * cos.abs()
}

/// Returns the height at which a ray starts whose direction has this cosine with the triangle's
/// normal on its side.
#[inline(always)]
pub fn lift(height: f32, cos: f32) -> f32 {
    height * min(max(1.0 - cos * (1.0 / NEAR_HORIZON), 0.0), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attributes::MeshVertex;
    use bytemuck::Zeroable;

    /// Returns the height above the middle of an edge of a triangle of a unit sphere.
    fn of_sphere(angle: f32, outside: bool) -> (f32, f32) {
        let at = |x: f32, y: f32| Vec3::new(x * angle, y * angle, 1.0).normalize();
        let triangle = Triangle::of([at(-0.5, 0.0), at(0.5, 0.0), at(0.0, 0.8)]);
        let vertex = |normal| MeshVertex { normal, ..MeshVertex::zeroed() };
        let vertices =
            TriangleVertices { a: vertex(triangle.a), b: vertex(triangle.b), c: vertex(triangle.c) };
        let normal = triangle.normal().normalize();
        let facing = if outside { normal } else { -normal };
        let middle = (triangle.a + triangle.b) * 0.5;
        let of = height(&triangle, &vertices, middle, facing, (0.5, 0.5, 0.0));
        (of, 1.0 - middle.length())
    }

    #[test]
    fn heights_are_those_of_a_sphere_outside_and_none_inside() {
        for angle in [0.01, 0.1, 0.3] {
            let (height, sagitta) = of_sphere(angle, true);
            // Both projections go to tangents, which meet at twice the sagitta.
            assert!((height / sagitta - 2.0).abs() < 0.1 + angle, "{angle}: {height} {sagitta}");
            assert_eq!(of_sphere(angle, false).0, 0.0);
        }
        let (most, _) = of_sphere(3.0, true);
        assert!(most > 0.1 && most < 0.2, "{most}");
        assert_eq!((lift(2.0, -0.5), lift(2.0, 0.0), lift(2.0, 0.05), lift(2.0, 0.1)), (2.0, 2.0, 1.0, 0.0));
    }
}
