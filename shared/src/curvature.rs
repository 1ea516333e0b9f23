//! Change of the shading normal along a surface, which refracted connections follow.

use crate::attributes::TriangleVertices;
use crate::buffer::load_record;
use crate::bvh::Hit;
use crate::features::{FeatureSet, Features, SMOOTH};
use crate::instance::{self, transposed};
use crate::math::{normalize, sqrt};
use crate::params::RenderParams;
use crate::primitive::{is_planar, is_triangle};
use crate::scene::Scene;
use crate::sphere::Sphere;
use crate::surface::Surface;
use crate::triangle::Triangle;
use glam::Vec3;

/// Derivative of the unit shading normal by the position on a surface. (Vectors begin rows of 16
/// bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curvature {
    /// Gradients of the barycentric weights of a triangle's second and third corner.
    weight_b: Vec3,
    /// Change of a sphere's normal per distance; 0 for other primitives.
    inverse_radius: f32,
    weight_c: Vec3,
    /// 1 for a triangle of a smooth mesh, 0 for other primitives.
    smooth: f32,
    /// Differences of the second and third corner's normal from that of the first.
    normal_b: Vec3,
    pad_b: f32,
    normal_c: Vec3,
    pad_c: f32,
}

impl Curvature {
    /// Curvature of a plane.
    const FLAT: Self = Self {
        weight_b: Vec3::ZERO,
        inverse_radius: 0.0,
        weight_c: Vec3::ZERO,
        smooth: 0.0,
        normal_b: Vec3::ZERO,
        pad_b: 0.0,
        normal_c: Vec3::ZERO,
        pad_c: 0.0,
    };

    /// Returns the curvature at a hit on `surface`. Normal maps are ignored.
    ///
    /// # Safety
    ///
    /// As [`surface::at`](crate::surface::at).
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn at<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
        scene: Scene,
        hit: Hit,
        surface: &Surface,
    ) -> Self {
        let mut curvature = Self::FLAT;
        if is_triangle(features, params, hit.primitive) {
            if features.has::<SMOOTH>() {
                // SAFETY: the caller's promise.
                curvature = unsafe { Self::of_triangle(scene, hit.primitive - params.first_triangle) };
                if hit.is_in_instance(features) {
                    // SAFETY: the caller's promise.
                    let (entry, to) = unsafe { instance::records(params, scene, hit.instance) };
                    let (x, y, z) = (entry.x, entry.y, entry.z);
                    // The surface's interpolated normal has the length that it has in the mesh.
                    let unit = normalize(surface.interpolated_normal);
                    let in_mesh = transposed(to.x, to.y, to.z, unit);
                    let length = sqrt(in_mesh.dot(in_mesh));
                    curvature.weight_b = transposed(x, y, z, curvature.weight_b);
                    curvature.weight_c = transposed(x, y, z, curvature.weight_c);
                    curvature.normal_b = transposed(x, y, z, curvature.normal_b) * length;
                    curvature.normal_c = transposed(x, y, z, curvature.normal_c) * length;
                }
            }
        } else if !is_planar(features, params, hit.primitive) {
            // SAFETY: the caller's promise.
            let sphere = unsafe { load_record::<Sphere>(scene.spheres, hit.primitive) };
            curvature.inverse_radius = 1.0 / sphere.radius;
        }
        curvature
    }

    /// Returns the curvature of a triangle, in the coordinates of its mesh.
    ///
    /// # Safety
    ///
    /// The index is below the number of triangles.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    unsafe fn of_triangle(scene: Scene, index: u32) -> Self {
        // SAFETY: the caller's promise; the indices of vertices are in range.
        let (triangle, vertices) = unsafe {
            let triangle = load_record::<Triangle>(scene.triangles, index);
            (triangle, TriangleVertices::load(scene.vertices, &triangle))
        };
        let (b, c) = (triangle.b - triangle.a, triangle.c - triangle.a);
        let normal = b.cross(c);
        let square = normal.dot(normal);
        let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
        Self {
            weight_b: c.cross(normal) * inverse,
            weight_c: normal.cross(b) * inverse,
            normal_b: vertices.b.normal - vertices.a.normal,
            normal_c: vertices.c.normal - vertices.a.normal,
            smooth: 1.0,
            ..Self::FLAT
        }
    }

    /// Returns the change of the unit normal `facing` for the step `along` of the position.
    /// `interpolated` is the [normal](crate::surface::Surface::interpolated_normal) before it was
    /// made a unit vector, and `outside` is true if `facing` is on the outside.
    #[inline(always)]
    pub fn change(&self, along: Vec3, facing: Vec3, interpolated: Vec3, outside: bool) -> Vec3 {
        let mut change = along * (if outside { self.inverse_radius } else { -self.inverse_radius });
        let square = interpolated.dot(interpolated);
        if self.smooth > 0.0 && square > 0.0 {
            let mixed = self.normal_b * self.weight_b.dot(along) + self.normal_c * self.weight_c.dot(along);
            let inverse = 1.0 / sqrt(square);
            let sign = if interpolated.dot(facing) < 0.0 { -inverse } else { inverse };
            change = (mixed - facing * facing.dot(mixed)) * sign;
        }
        change
    }
}
