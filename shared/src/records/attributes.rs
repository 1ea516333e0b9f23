//! Records of the vertices of meshes: what shading interpolates.

use super::texture::Texel;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Vertex of a mesh instance, without its position. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeshVertex {
    /// Unit normal; zero for flat shading.
    pub normal: Vec3,
    /// Index into the scene's materials; the same for all corners of a triangle.
    pub material: u32,
    /// Texture coordinate u.
    pub u: f32,
    /// Texture coordinate v.
    pub v: f32,
    /// Index, in the array of vertices, of the vertex's [attributes](VertexAttributes); 0 without.
    pub attributes: u32,
    /// Number of the mesh instance that the vertex belongs to, from 0; for the host only.
    pub instance: u32,
}

/// Further attributes of a vertex. 32 bytes, as [`MeshVertex`], in whose array they stand.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct VertexAttributes {
    /// Linear colour and opacity, which multiply the material's.
    pub color: Texel,
    /// Texture coordinate u of the second set.
    pub u: f32,
    /// Texture coordinate v of the second set.
    pub v: f32,
    /// Tangent; see [`decode_tangent`](crate::attributes::decode_tangent).
    pub tangent: u32,
    /// Unused.
    pub pad: [u32; 3],
}

const _: () = assert!(size_of::<MeshVertex>() == 32 && align_of::<MeshVertex>() == 16);
const _: () = assert!(size_of::<VertexAttributes>() == 32 && align_of::<VertexAttributes>() == 16);
