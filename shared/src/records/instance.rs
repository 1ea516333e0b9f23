//! Records of an instance of a mesh. They stand behind the inner nodes of the BVH, in their array,
//! in pairs.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

/// Way from the world into an instance, and its tree. 64 bytes, as
/// [`BvhNode`](crate::bvh::BvhNode), in whose array it stands.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct InstanceEntry {
    /// First row of the affine map from the world to the mesh's coordinates; `w` is the offset.
    pub x: Vec4,
    /// Second row.
    pub y: Vec4,
    /// Third row.
    pub z: Vec4,
    /// Root of the mesh's binary BVH, as a [`Child`](crate::bvh::Child).
    pub root: u32,
    /// Primitive number of the mesh's first triangle.
    pub first_triangle: u32,
    /// Number of the mesh's triangles.
    pub triangle_count: u32,
    /// Unused.
    pub pad: u32,
}

/// Way from an instance into the world. 64 bytes, as [`InstanceEntry`], behind which it stands.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct InstancePlacement {
    /// First row of the affine map from the mesh's coordinates to the world; `w` is the offset.
    pub x: Vec4,
    /// Second row.
    pub y: Vec4,
    /// Third row.
    pub z: Vec4,
    /// 1, or -1 if the map mirrors.
    pub handedness: f32,
    /// Unused.
    pub pad: [u32; 3],
}

const _: () = assert!(size_of::<InstanceEntry>() == 64 && align_of::<InstanceEntry>() == 16);
const _: () = assert!(size_of::<InstancePlacement>() == 64 && align_of::<InstancePlacement>() == 16);
