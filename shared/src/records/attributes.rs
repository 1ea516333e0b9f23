//! Record of further attributes of a triangle's vertices.

use super::texture::Texel;
use bytemuck::{Pod, Zeroable};

/// Attributes at the vertices of a triangle. 64 bytes, as
/// [`TriangleShading`](crate::triangle::TriangleShading), in whose array it stands.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TriangleAttributes {
    /// Tangent at the first vertex; see [`decode_tangent`](crate::attributes::decode_tangent).
    pub tangent_a: u32,
    /// Tangent at the second vertex.
    pub tangent_b: u32,
    /// Tangent at the third vertex.
    pub tangent_c: u32,
    /// Unused.
    pub pad: u32,
    /// Linear colour and opacity at the first vertex, which multiply the material's.
    pub color_a: Texel,
    /// Linear colour and opacity at the second vertex.
    pub color_b: Texel,
    /// Linear colour and opacity at the third vertex.
    pub color_c: Texel,
    /// Texture coordinate u of the second set at the first vertex.
    pub u_a: f32,
    /// Texture coordinate v of the second set at the first vertex.
    pub v_a: f32,
    /// Texture coordinate u of the second set at the second vertex.
    pub u_b: f32,
    /// Texture coordinate v of the second set at the second vertex.
    pub v_b: f32,
    /// Texture coordinate u of the second set at the third vertex.
    pub u_c: f32,
    /// Texture coordinate v of the second set at the third vertex.
    pub v_c: f32,
}

const _: () = assert!(size_of::<TriangleAttributes>() == 64 && align_of::<TriangleAttributes>() == 16);
