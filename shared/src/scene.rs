//! The scene as a kernel sees it: borrowed arrays of records.

use crate::bvh::BvhNode;
use crate::environment::EnvironmentTexel;
use crate::flat::Flat;
use crate::light::Light;
use crate::material::Material;
use crate::sphere::Sphere;
use crate::texture::{Texel, Texture};
use crate::triangle::{Triangle, TriangleShading};

/// The device arrays of a scene. Their indices are proven by the host; see [`crate::buffer`].
///
/// Primitives are numbered spheres first, then flat shapes, then triangles;
/// [`RenderParams`](crate::params::RenderParams) says where each kind begins.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Primitives of the first kind.
    pub spheres: &'a [Sphere],
    /// Inner nodes of the BVH.
    pub nodes: &'a [BvhNode],
    /// By index from the primitives.
    pub materials: &'a [Material],
    /// Primitives of the second kind.
    pub flats: &'a [Flat],
    /// Primitives of the third kind.
    pub triangles: &'a [Triangle],
    /// One for each triangle.
    pub shading: &'a [TriangleShading],
    /// What next-event estimation chooses from.
    pub lights: &'a [Light],
    /// By index from the materials.
    pub textures: &'a [Texture],
    /// Of all textures.
    pub texels: &'a [Texel],
    /// The panorama; empty for none.
    pub environment: &'a [EnvironmentTexel],
}
