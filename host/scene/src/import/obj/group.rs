//! Triangles of an OBJ file that become a mesh.

/// Index of texture coordinates and normals that a corner does not have.
pub const NONE: u32 = u32::MAX;

/// Triangles of one object or group with one material. Their normals are of one kind, and all have
/// texture coordinates or none has.
#[derive(Debug)]
pub struct Group {
    /// Number of the object or group.
    pub name: u32,
    /// Number of the material.
    pub material: u32,
    /// True if the normals are those of smoothing groups.
    pub is_smooth: bool,
    /// Indices of position, texture coordinates and normal of each corner.
    pub triangles: Vec<[[u32; 3]; 3]>,
}
