//! Instances of meshes: a ray passes into the mesh's coordinates, and the surface that it hits
//! there comes back into the world. Called by [`crate::traversal`] and [`crate::surface`].
//!
//! A ray keeps its distances: its direction in the mesh's coordinates is not a unit vector. All
//! triangles of an instance see the same ray, so it meets a mesh without gaps as in the world.

use crate::bvh::{Child, Hit, NO_INSTANCE};
use crate::features::{FeatureSet, Features, INSTANCES};
use crate::math::sqrt;
use crate::params::RenderParams;
use crate::ray::{OriginPrimitive, Ray};
pub use crate::records::instance::{InstanceEntry, InstancePlacement};
use crate::scene::Scene;
use crate::surface::{ROUNDING, Surface};
use glam::{Vec3, Vec4};

/// Loads a record that stands in the array of nodes.
macro_rules! load_among_nodes {
    ($record:ty, $scene:expr, $index:expr) => {{
        #[cfg(target_arch = "spirv")]
        let record = crate::buffer::load::<$record>($scene.nodes, $index);
        #[cfg(not(target_arch = "spirv"))]
        let record: $record =
            bytemuck::cast(crate::buffer::load::<crate::bvh::BvhNode>($scene.nodes, $index));
        record
    }};
}

impl Hit {
    /// Returns the number that names what is hit: the instance's, if there is one, or the
    /// primitive's.
    #[inline(always)]
    pub fn named<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        params: &RenderParams,
    ) -> u32 {
        if self.is_in_instance(features) { params.first_instance + self.instance } else { self.primitive }
    }

    /// Returns whether the hit is one in an instance.
    #[inline(always)]
    pub fn is_in_instance<const POSSIBLE: Features>(&self, features: FeatureSet<POSSIBLE>) -> bool {
        features.has(INSTANCES) && self.instance != NO_INSTANCE
    }

    /// Returns whether a hit of the same primitive at the same distance is in an instance that
    /// comes before this one's. Of coincident instances the first is hit.
    #[inline(always)]
    pub fn is_after<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        t: f32,
        primitive: u32,
        instance: u32,
    ) -> bool {
        features.has(INSTANCES)
            && (t == self.distance) & (primitive == self.primitive) & (instance < self.instance)
    }
}

/// Returns the linear part of an affine map, applied to a vector.
#[inline(always)]
fn linear(x: Vec4, y: Vec4, z: Vec4, v: Vec3) -> Vec3 {
    Vec3::new(
        x.x * v.x + x.y * v.y + x.z * v.z,
        y.x * v.x + y.y * v.y + y.z * v.z,
        z.x * v.x + z.y * v.y + z.z * v.z,
    )
}

/// Returns the transpose of the linear part of an affine map, applied to a vector.
#[inline(always)]
fn transposed(x: Vec4, y: Vec4, z: Vec4, v: Vec3) -> Vec3 {
    Vec3::new(
        x.x * v.x + y.x * v.y + z.x * v.z,
        x.y * v.x + y.y * v.y + z.y * v.z,
        x.z * v.x + y.z * v.y + z.z * v.z,
    )
}

#[inline(always)]
fn offset(x: Vec4, y: Vec4, z: Vec4) -> Vec3 {
    Vec3::new(x.w, y.w, z.w)
}

/// Returns the entry of an instance.
///
/// # Safety
///
/// `instance` is below `params.instance_count`, and `params` belongs to this scene.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn entry(params: &RenderParams, scene: Scene, instance: u32) -> InstanceEntry {
    let index = params.first_instance_node + 2 * instance;
    // SAFETY: the caller's promise; the host put a pair of records there for each instance.
    unsafe { load_among_nodes!(InstanceEntry, scene, index) }
}

impl InstanceEntry {
    /// Returns `ray` in the coordinates of the mesh; `instance` is the number of this one. A ray
    /// that leaves another instance leaves no triangle here.
    #[inline(always)]
    pub fn enter(&self, ray: Ray, instance: u32) -> Ray {
        let Self { x, y, z, .. } = *self;
        Ray {
            origin: linear(x, y, z, ray.origin) + offset(x, y, z),
            origin_primitive: if ray.origin_instance == instance {
                ray.origin_primitive
            } else {
                OriginPrimitive::NONE
            },
            direction: linear(x, y, z, ray.direction),
            origin_instance: ray.origin_instance,
        }
    }
}

/// Returns in the world what [`triangle`](crate::surface) found in the coordinates of a mesh;
/// `size` bounds the sizes of the products that the point is a sum of.
///
/// The error bound along the world's normal covers the point's rounding, that of its way into the
/// world, and that of a ray's way back from there: 10 roundings of each sum of products. All are
/// measured in the mesh's coordinates, along its normal n; a step δ along the world's normal is a
/// step |Rᵀn| δ there, where R maps the world to the mesh.
///
/// # Safety
///
/// As [`entry`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn placed(
    params: &RenderParams,
    scene: Scene,
    instance: u32,
    surface: Surface,
    size: Vec3,
) -> Surface {
    let index = params.first_instance_node + 2 * instance;
    // SAFETY: the caller's promise; see `entry`.
    let (entry, to) = unsafe {
        (
            load_among_nodes!(InstanceEntry, scene, index),
            load_among_nodes!(InstancePlacement, scene, index + 1),
        )
    };
    let InstanceEntry { x, y, z, .. } = entry;
    let (to_x, to_y, to_z) = (to.x, to.y, to.z);
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let reach = linear(to_x.abs(), to_y.abs(), to_z.abs(), size) + offset(to_x, to_y, to_z).abs();
    let error = size + linear(ax, ay, az, reach) + offset(ax, ay, az);
    let turned = transposed(x, y, z, surface.normal);
    let inverse_length = 1.0 / sqrt(turned.dot(turned));
    let normal = turned * inverse_length;
    let smooth = transposed(x, y, z, surface.shading_normal);
    let smooth = smooth * (1.0 / sqrt(smooth.dot(smooth)));
    // The tangent space is of vectors that are interpolated and not made units again.
    let along = transposed(x, y, z, surface.interpolated_normal);
    let along = along * kept_length(surface.interpolated_normal, along);
    let mut attributes = surface.attributes;
    let tangent = linear(to_x, to_y, to_z, attributes.tangent);
    attributes.tangent = tangent * kept_length(attributes.tangent, tangent);
    attributes.handedness *= to.handedness;
    Surface {
        point: linear(to_x, to_y, to_z, surface.point) + offset(to_x, to_y, to_z),
        normal,
        shading_normal: if smooth.dot(normal) < 0.0 { -smooth } else { smooth },
        error_bound: surface.normal.abs().dot(error) * inverse_length * ROUNDING,
        interpolated_normal: along,
        attributes,
        ..surface
    }
}

/// Returns the factor that gives `to` the length of `from`; 1 where there is no length.
#[inline(always)]
fn kept_length(from: Vec3, to: Vec3) -> f32 {
    let (wanted, given) = (from.dot(from), to.dot(to));
    if wanted > 0.0 && given > 0.0 { sqrt(wanted) * (1.0 / sqrt(given)) } else { 1.0 }
}

#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
impl InstanceEntry {
    /// Returns the records of an instance, whose tree and triangles the caller adds; `None` if a
    /// number leaves the range of f32 or the map has no inverse.
    pub fn placed(to_world: glam::DAffine3) -> Option<(Self, InstancePlacement)> {
        // The inverse is that of the rounded map.
        let rounded = to_world.as_affine3().as_daffine3();
        let inverse = rounded.inverse();
        let handedness = if rounded.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        let (to, from) = (rows(rounded), rows(inverse));
        let finite = to.iter().chain(&from).all(|row| row.is_finite());
        let entry = Self {
            x: from[0],
            y: from[1],
            z: from[2],
            root: Child::EMPTY.0,
            first_triangle: 0,
            triangle_count: 0,
            pad: 0,
        };
        let placement = InstancePlacement { x: to[0], y: to[1], z: to[2], handedness, pad: [0; 3] };
        finite.then_some((entry, placement))
    }
}

/// Returns the rows of an affine map, with its offset in the fourth column.
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
fn rows(map: glam::DAffine3) -> [Vec4; 3] {
    let (matrix, offset) = (map.matrix3, map.translation);
    core::array::from_fn(|i| matrix.row(i).extend(offset[i]).as_vec4())
}
