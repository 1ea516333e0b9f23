//! Shapes, places and looks at a time: animations move nodes ([`animation`], [`pose`]) and change
//! materials, lights and cameras ([`records`], [`properties`]); morph targets and skins move the
//! vertices of a mesh ([`morph`], [`skin`]).

mod animation;
pub mod morph;
pub mod pose;
mod properties;
mod records;
pub mod skin;

use super::attributes::Attributes;

use animation::node_property;
pub use animation::{Chosen, choose, pose};
pub use pose::Pose;
pub use records::Records;

/// The vertices of a primitive that its mesh has.
#[derive(Clone, Copy, Debug)]
pub struct Vertices<'a> {
    /// Attributes of the primitive.
    pub attributes: &'a Attributes<'a>,
    /// Number of each vertex of the mesh among those of the primitive.
    pub used: &'a [u32],
    /// Sets of texture coordinates that the mesh has.
    pub sets: [Option<u32>; 2],
}

/// Weights and joints that move the vertices of a mesh at a node.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deformation<'a> {
    /// Weights of the first morph targets.
    pub weights: &'a [f64],
    /// Joints of the skin; `None` for a mesh that is not skinned.
    pub skin: Option<skin::Skin<'a>>,
}
