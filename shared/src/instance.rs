//! Instances of meshes: a ray passes into the mesh's coordinates, and the surface that it hits
//! there comes back into the world. Called by [`crate::traversal`] and [`crate::surface`].
//!
//! A ray keeps its distances: its direction in the mesh's coordinates is not a unit vector. All
//! triangles of an instance see the same ray, so it meets a mesh without gaps as in the world.

use crate::bvh::{Hit, NO_INSTANCE};
use crate::features::{FeatureSet, Features, INSTANCES};
use crate::params::RenderParams;
use crate::ray::{OriginPrimitive, Ray};
pub use crate::records::instance::{InstanceEntry, InstancePlacement};
use crate::scene::Scene;
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
        features.has::<INSTANCES>() && self.instance != NO_INSTANCE
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
        features.has::<INSTANCES>()
            && (t == self.distance) & (primitive == self.primitive) & (instance < self.instance)
    }
}

/// Returns the linear part of an affine map, applied to a vector.
#[inline(always)]
pub(crate) fn linear(x: Vec4, y: Vec4, z: Vec4, v: Vec3) -> Vec3 {
    Vec3::new(
        x.x * v.x + x.y * v.y + x.z * v.z,
        y.x * v.x + y.y * v.y + y.z * v.z,
        z.x * v.x + z.y * v.y + z.z * v.z,
    )
}

/// Returns the transpose of the linear part of an affine map, applied to a vector.
#[inline(always)]
pub(crate) fn transposed(x: Vec4, y: Vec4, z: Vec4, v: Vec3) -> Vec3 {
    Vec3::new(
        x.x * v.x + y.x * v.y + z.x * v.z,
        x.y * v.x + y.y * v.y + z.y * v.z,
        x.z * v.x + y.z * v.y + z.z * v.z,
    )
}

/// Returns the offset of an affine map.
#[inline(always)]
pub(crate) fn offset(x: Vec4, y: Vec4, z: Vec4) -> Vec3 {
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

/// Returns the records of an instance.
///
/// # Safety
///
/// As [`entry`].
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn records(
    params: &RenderParams,
    scene: Scene,
    instance: u32,
) -> (InstanceEntry, InstancePlacement) {
    let index = params.first_instance_node + 2 * instance;
    // SAFETY: the caller's promise; see `entry`.
    unsafe {
        (
            load_among_nodes!(InstanceEntry, scene, index),
            load_among_nodes!(InstancePlacement, scene, index + 1),
        )
    }
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
            root: crate::bvh::Child::EMPTY.0,
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
