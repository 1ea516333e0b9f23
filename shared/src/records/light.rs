//! Record of a light.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Light, and its entry of the alias table (Walker, 1977; Vose, 1991), which chooses lights by
/// power. 64 bytes.
///
/// Beside a [tree](crate::light::tree) the record of a light has the link to its siblings, the
/// children of the same node, as `threshold` and its place among them as `alias`; that of an area
/// light has its pdf by area as `intensity.x`.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// Kind: [`AREA`](crate::light::AREA) or another tag of [`crate::light`].
    pub kind: u32,
    /// Primitive of an area light.
    pub primitive: u32,
    /// Threshold of the alias table: keep this light if a random word is below, else take `alias`.
    pub threshold: u32,
    /// Index of the light to take instead.
    pub alias: u32,
    /// Position of a point light; unit vector towards a directional light.
    pub position: Vec3,
    /// Probability that this light is sampled.
    pub probability: f32,
    /// Radiant intensity of a point light (power per steradian); irradiance of a directional light
    /// (power per unit of area).
    pub intensity: Vec3,
    /// Slope of a spot's falloff over the cosine from its axis; 0 for a point light.
    pub cone_scale: f32,
    /// Unit vector along a spot's axis, away from the light.
    pub axis: Vec3,
    /// Offset of a spot's falloff: its intensity is multiplied by (cosine × `cone_scale` +
    /// `cone_offset`)², the base clamped to 0 to 1 (glTF's KHR_lights_punctual).
    pub cone_offset: f32,
}

const _: () = assert!(size_of::<Light>() == 64 && align_of::<Light>() == 16);
