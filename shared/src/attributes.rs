//! Vertices of meshes: normals and texture coordinates, and for some meshes further attributes:
//! tangents, colours, and a second set of texture coordinates.

use crate::buffer::{RecordSlice, load_other_record, load_record};
use crate::math::{from_half, normalize};
pub use crate::records::attributes::{MeshVertex, VertexAttributes};
use crate::records::texture::Texel;
use crate::triangle::Triangle;
use glam::Vec3;

/// Attributes at a point of a surface. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct SurfaceAttributes {
    /// Interpolated tangent, not of unit length; zero without.
    pub tangent: Vec3,
    /// 1 or -1: factor of the cross product of normal and tangent that gives the bitangent.
    pub handedness: f32,
    /// Linear colour, which multiplies the material's.
    pub color: Vec3,
    /// Opacity, which multiplies the material's.
    pub opacity: f32,
    /// Texture coordinate u of the second set.
    pub u: f32,
    /// Texture coordinate v of the second set.
    pub v: f32,
}

impl SurfaceAttributes {
    /// Attributes of a surface without a record.
    pub const NONE: Self =
        Self { tangent: Vec3::ZERO, handedness: 1.0, color: Vec3::ONE, opacity: 1.0, u: 0.0, v: 0.0 };
}

/// Vertices of the corners of a triangle.
#[derive(Clone, Copy, Debug)]
pub struct TriangleVertices {
    /// Vertex of the first corner.
    pub a: MeshVertex,
    /// Vertex of the second corner.
    pub b: MeshVertex,
    /// Vertex of the third corner.
    pub c: MeshVertex,
}

impl TriangleVertices {
    /// Loads the vertices of a triangle.
    ///
    /// # Safety
    ///
    /// The triangle's vertices are in range.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn load(vertices: RecordSlice<'_, MeshVertex>, of: &Triangle) -> Self {
        // SAFETY: the caller's promise.
        unsafe {
            Self {
                a: load_record::<MeshVertex>(vertices, of.vertex_a),
                b: load_record::<MeshVertex>(vertices, of.vertex_b),
                c: load_record::<MeshVertex>(vertices, of.vertex_c),
            }
        }
    }

    /// Returns the interpolated normal, not of unit length, at these barycentric weights.
    #[inline(always)]
    pub fn normal(&self, a: f32, b: f32, c: f32) -> Vec3 {
        self.a.normal * a + self.b.normal * b + self.c.normal * c
    }

    /// Returns the texture coordinates u and v at these barycentric weights.
    #[inline(always)]
    pub fn uv(&self, a: f32, b: f32, c: f32) -> (f32, f32) {
        (self.a.u * a + self.b.u * b + self.c.u * c, self.a.v * a + self.b.v * b + self.c.v * c)
    }

    /// Returns whether the vertices have further attributes.
    #[inline(always)]
    pub fn have_attributes(&self) -> bool {
        self.a.attributes != 0
    }

    /// Returns the further attributes at these barycentric weights.
    ///
    /// # Safety
    ///
    /// `vertices` is the array that the vertices were loaded from, and the indices of their
    /// attributes are in range.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn attributes(
        &self,
        vertices: RecordSlice<'_, MeshVertex>,
        a: f32,
        b: f32,
        c: f32,
    ) -> SurfaceAttributes {
        // SAFETY: the caller's promise.
        let (of_a, of_b, of_c) = unsafe {
            (
                load_attributes(vertices, self.a.attributes),
                load_attributes(vertices, self.b.attributes),
                load_attributes(vertices, self.c.attributes),
            )
        };
        let mut found = SurfaceAttributes::NONE;
        found.tangent = decode_tangent(of_a.tangent) * a
            + decode_tangent(of_b.tangent) * b
            + decode_tangent(of_c.tangent) * c;
        // MikkTSpace gives all vertices of a triangle the same handedness.
        found.handedness = if of_a.tangent & LEFT_HANDED != 0 { -1.0 } else { 1.0 };
        found.color = color(of_a.color) * a + color(of_b.color) * b + color(of_c.color) * c;
        let opacity = |texel: Texel| from_half(texel.blue_alpha >> 16);
        found.opacity = opacity(of_a.color) * a + opacity(of_b.color) * b + opacity(of_c.color) * c;
        found.u = of_a.u * a + of_b.u * b + of_c.u * c;
        found.v = of_a.v * a + of_b.v * b + of_c.v * c;
        found
    }
}

/// Returns the attributes that stand at `index` of the array of vertices.
///
/// # Safety
///
/// `index < vertices.len()`.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
unsafe fn load_attributes(vertices: RecordSlice<'_, MeshVertex>, index: u32) -> VertexAttributes {
    // SAFETY: the caller's promise.
    unsafe { load_other_record(vertices, index) }
}

#[inline(always)]
fn color(texel: Texel) -> Vec3 {
    Vec3::new(from_half(texel.red_green), from_half(texel.red_green >> 16), from_half(texel.blue_alpha))
}

/// Bit of an encoded tangent: the bitangent is the negated cross product of normal and tangent.
pub const LEFT_HANDED: u32 = 1 << 31;

/// Greatest number of the octahedral coordinates of an encoded tangent: x has 16 bits, y 15.
const STEPS: (i32, i32) = (32767, 16383);

/// Returns the unit tangent that [`encode_tangent`] encoded, within 1e-4 radians, for any bits.
#[inline(always)]
pub fn decode_tangent(bits: u32) -> Vec3 {
    let x = ((bits & 0xffff) as i32 - STEPS.0) as f32 * (1.0 / STEPS.0 as f32);
    let y = (((bits >> 16) & 0x7fff) as i32 - STEPS.1) as f32 * (1.0 / STEPS.1 as f32);
    // Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT
    // 3(2), 2014: the lower half of the octahedron is folded outwards.
    let z = 1.0 - x.abs() - y.abs();
    let fold = if z < 0.0 { z } else { 0.0 };
    let toward = |x: f32| if x >= 0.0 { x + fold } else { x - fold };
    normalize(Vec3::new(toward(x), toward(y), z))
}

/// Encodes a tangent, which is not zero, in octahedral coordinates, with its handedness.
#[cfg(not(any(target_arch = "spirv", target_arch = "nvptx64")))]
pub fn encode_tangent(tangent: Vec3, left_handed: bool) -> u32 {
    let unit = tangent / (tangent.x.abs() + tangent.y.abs() + tangent.z.abs());
    let folded = |x: f32, y: f32| if x >= 0.0 { 1.0 - y.abs() } else { y.abs() - 1.0 };
    let (x, y) = match unit.z < 0.0 {
        true => (folded(unit.x, unit.y), folded(unit.y, unit.x)),
        false => (unit.x, unit.y),
    };
    let round = |x: f32, steps: i32| {
        let scaled = x * steps as f32 + steps as f32 + 0.5;
        (scaled as i32).clamp(0, 2 * steps) as u32
    };
    round(x, STEPS.0) | round(y, STEPS.1) << 16 | if left_handed { LEFT_HANDED } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn tangents_keep_their_direction() {
        let mut worst = 0.0f32;
        for i in -20..=20 {
            for j in -20..=20 {
                for k in -20..=20 {
                    let v = Vec3::new(i as f32, j as f32 * 0.7, k as f32 * 1.3);
                    if v == Vec3::ZERO {
                        continue;
                    }
                    for left in [false, true] {
                        let bits = encode_tangent(v, left);
                        worst = worst.max((decode_tangent(bits) - v.normalize()).length());
                        assert_eq!(bits & LEFT_HANDED != 0, left);
                    }
                }
            }
        }
        assert!(worst < 1e-4, "{worst}");
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            assert_eq!(decode_tangent(encode_tangent(axis, false)), axis);
        }
        assert!((0..=u32::MAX).step_by(65_537).all(|bits| decode_tangent(bits).is_finite()));
    }

    #[test]
    #[allow(unsafe_code, reason = "see buffer")]
    fn attributes_are_interpolated() {
        let half = |a: f32, b: f32| u32::from(to_half(a)) | u32::from(to_half(b)) << 16;
        let texel = |r, g, b, a| Texel { red_green: half(r, g), blue_alpha: half(b, a) };
        let attributes = |tangent: Vec3, color: Texel, u: f32, v: f32| VertexAttributes {
            color,
            u,
            v,
            tangent: encode_tangent(tangent, true),
            pad: [0; 3],
        };
        let vertex = |attributes: u32| MeshVertex { attributes, ..MeshVertex::zeroed() };
        // Vertices stand beside their attributes.
        let array: [MeshVertex; 6] = [
            vertex(1),
            bytemuck::cast(attributes(Vec3::X, texel(1.0, 0.0, 0.0, 1.0), 1.0, 0.0)),
            vertex(3),
            bytemuck::cast(attributes(Vec3::X, texel(0.0, 1.0, 0.0, 1.0), 0.0, 2.0)),
            vertex(5),
            bytemuck::cast(attributes(Vec3::Y, texel(0.0, 0.0, 1.0, 0.0), 4.0, 0.0)),
        ];
        let triangle = Triangle { vertex_b: 2, vertex_c: 4, ..Triangle::of([Vec3::ZERO; 3]) };
        // SAFETY: the indices are those of the array.
        let found = unsafe {
            let vertices = TriangleVertices::load(&array, &triangle);
            assert!(vertices.have_attributes());
            vertices.attributes(&array, 0.5, 0.25, 0.25)
        };
        assert_eq!((found.color, found.opacity), (Vec3::new(0.5, 0.25, 0.25), 0.75));
        assert_eq!((found.u, found.v, found.handedness), (1.5, 0.5, -1.0));
        assert_eq!(found.tangent, Vec3::new(0.75, 0.25, 0.0));
    }

    /// Returns 0, 1, 2 or 4 in half precision.
    fn to_half(x: f32) -> u16 {
        if x == 0.0 { 0 } else { ((x.to_bits() >> 13) - (112 << 10)) as u16 }
    }
}
