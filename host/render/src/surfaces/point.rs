//! Points of surfaces, by what stays when the surface moves.

use crate::bvh::TreeOnHost;
use glam::{DVec2, DVec3, Vec3};
use trisect_scene::{Scene, SharedInstance};
use trisect_shared::math::atan2_turns;
use trisect_shared::planar::DISC;
use trisect_shared::triangle::Triangle;

/// Point of a primitive of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SurfacePoint {
    /// Point of a sphere, in a direction of unit length from its centre.
    Sphere { index: usize, normal: DVec3 },
    /// Point of a quad or a disc.
    Flat { index: usize, u: f64, v: f64 },
    /// Point of a triangle in the world.
    Triangle { index: usize, weights: [f64; 3] },
    /// Point of a triangle of a shared mesh, in one of its instances.
    Placed { instance: usize, index: usize, weights: [f64; 3] },
}

impl SurfacePoint {
    /// Finds the point of a primitive that is nearest to a position on it, within rounding.
    /// `primitive` is its number in AOVs: an instance has one number for all its triangles.
    pub fn find(scene: &Scene, tree: &TreeOnHost<'_>, primitive: u32, position: DVec3) -> Option<Self> {
        let number = primitive as usize;
        if let Some(sphere) = scene.spheres.get(number) {
            let normal = (position - sphere.center.as_dvec3()).normalize_or_zero();
            return Some(Self::Sphere { index: number, normal });
        }
        let index = number - scene.spheres.len();
        if let Some(flat) = scene.flats.get(index) {
            let offset = position - flat.origin.as_dvec3();
            let [u, v] = [flat.dual_u, flat.dual_v].map(|dual| offset.dot(dual.as_dvec3()));
            return Some(Self::Flat { index, u, v });
        }
        let index = index - scene.flats.len();
        if let Some(triangle) = scene.triangles.get(index) {
            return Some(Self::Triangle { index, weights: weights(triangle, position) });
        }
        let instance = primitive.checked_sub(tree.first_instance)?;
        let placed = scene.shared.instances.get(instance as usize)?;
        let local = placed.map().inverse().transform_point3(position);
        let first = scene.world_primitives();
        let triangle = |leaf: u32| scene.shared.triangles.get((leaf as usize).checked_sub(first)?);
        let leaf = tree.nearest_of_instance(instance, local, |leaf| {
            triangle(leaf).map_or(f64::INFINITY, |triangle| {
                (mix(triangle, weights(triangle, local)) - local).length_squared()
            })
        })?;
        let weights = weights(triangle(leaf)?, local);
        Some(Self::Placed { instance: instance as usize, index: leaf as usize - first, weights })
    }

    /// Returns the position of the point in a scene that has its primitive.
    pub fn position(&self, scene: &Scene) -> Option<DVec3> {
        match *self {
            Self::Sphere { index, normal } => {
                let sphere = scene.spheres.get(index)?;
                Some(sphere.center.as_dvec3() + normal * f64::from(sphere.radius))
            }
            Self::Flat { index, u, v } => {
                let flat = scene.flats.get(index)?;
                Some(flat.origin.as_dvec3() + flat.edge_u.as_dvec3() * u + flat.edge_v.as_dvec3() * v)
            }
            Self::Triangle { index, weights } => Some(mix(scene.triangles.get(index)?, weights)),
            Self::Placed { instance, index, weights } => {
                let local = mix(scene.shared.triangles.get(index)?, weights);
                Some(scene.shared.instances.get(instance)?.map().transform_point3(local))
            }
        }
    }

    /// Returns the geometric normal, of unit length, on an unspecified side.
    pub fn normal(&self, scene: &Scene) -> Option<DVec3> {
        match *self {
            Self::Sphere { normal, .. } => Some(normal),
            Self::Flat { index, .. } => Some(scene.flats.get(index)?.normal.as_dvec3()),
            Self::Triangle { index, .. } => Some(normal_of(corners(scene.triangles.get(index)?))),
            Self::Placed { instance, index, .. } => {
                let map = scene.shared.instances.get(instance).map(SharedInstance::map)?;
                let local = corners(scene.shared.triangles.get(index)?);
                Some(normal_of(local.map(|corner| map.transform_vector3(corner))))
            }
        }
    }

    /// Returns the texture coordinates u, to the right, and v, upwards in an image.
    pub fn uv(&self, scene: &Scene) -> Option<DVec2> {
        // As the kernels compute them, whose v runs downwards.
        let (u, v) = match *self {
            Self::Sphere { normal, .. } => {
                let Vec3 { x, y, z } = normal.as_vec3();
                (0.5 + f64::from(atan2_turns(-z, x)), 2.0 * f64::from(atan2_turns(x.hypot(z), y)))
            }
            Self::Flat { index, u, v } => match scene.flats.get(index)?.kind {
                DISC => (0.5 + 0.5 * u, 0.5 - 0.5 * v),
                _ => (u, 1.0 - v),
            },
            Self::Triangle { index, weights } => uv(scene, scene.triangles.get(index)?, weights)?,
            Self::Placed { index, weights, .. } => uv(scene, scene.shared.triangles.get(index)?, weights)?,
        };
        Some(DVec2::new(u, 1.0 - v))
    }
}

fn corners(triangle: &Triangle) -> [DVec3; 3] {
    [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3)
}

/// Returns the unit normal of a triangle.
fn normal_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// Returns the barycentric weights of the point of a triangle's plane below a position, limited to
/// the triangle.
fn weights(triangle: &Triangle, position: DVec3) -> [f64; 3] {
    let [a, b, c] = corners(triangle);
    let (b, c, offset) = (b - a, c - a, position - a);
    let normal = b.cross(c);
    let square = normal.length_squared();
    let of_b = offset.cross(c).dot(normal) / square;
    let of_c = b.cross(offset).dot(normal) / square;
    let weights = [1.0 - of_b - of_c, of_b, of_c].map(|weight| weight.clamp(0.0, 1.0));
    let sum: f64 = weights.iter().sum();
    if sum.is_finite() { weights.map(|weight| weight / sum) } else { [1.0, 0.0, 0.0] }
}

/// Returns the point of a triangle with these weights.
fn mix(triangle: &Triangle, [a, b, c]: [f64; 3]) -> DVec3 {
    let [at_a, at_b, at_c] = corners(triangle);
    at_a * a + at_b * b + at_c * c
}

/// Returns the interpolated texture coordinates of a triangle's vertices.
fn uv(scene: &Scene, triangle: &Triangle, weights: [f64; 3]) -> Option<(f64, f64)> {
    let (mut u, mut v) = (0.0, 0.0);
    for (index, weight) in [triangle.vertex_a, triangle.vertex_b, triangle.vertex_c].into_iter().zip(weights)
    {
        let vertex = scene.vertices.get(index as usize)?;
        u += f64::from(vertex.u) * weight;
        v += f64::from(vertex.v) * weight;
    }
    Some((u, v))
}
