//! Record of a node of a light tree.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Node of a [light tree](crate::light::tree): bounds of one or more lights. 48 bytes, 3 rows of
/// 16; the children of a node follow each other.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightNode {
    /// Centre of a sphere around the lights.
    pub center: Vec3,
    /// Its radius; below 0 for lights that are infinitely far.
    pub radius: f32,
    /// Sum of the intensities along their normals, or of the irradiances of infinitely far lights,
    /// in a unit of the tree; below 0 for lights that only send light into their cone.
    pub strength: f32,
    /// Sine of the angle of the cone, below 0 for the cone of all directions; of infinitely far
    /// lights an upper bound of the sine of an angle in the cone.
    pub sine: f32,
    /// Link to its children, or its light.
    pub link: u32,
    /// Way back to the root: in the first child of a node the link to the children of that node's
    /// parent, in the second the place of the node among them.
    pub back: u32,
    /// Axis of the cone of their normals, a unit vector; of infinitely far lights, of the
    /// directions towards them.
    pub axis: Vec3,
    /// Cosine of the angle of the cone.
    pub cosine: f32,
}

const _: () = assert!(size_of::<LightNode>() == 48 && align_of::<LightNode>() == 16);
