//! The scene as a kernel sees it: borrowed arrays of records.

use crate::bvh::BvhNode;
use crate::material::Material;
use crate::sphere::Sphere;

/// The device arrays of a scene. Their indices are proven by the host; see [`crate::buffer`].
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The primitives.
    pub spheres: &'a [Sphere],
    /// Inner nodes of the BVH.
    pub nodes: &'a [BvhNode],
    /// By index from the primitives.
    pub materials: &'a [Material],
}
