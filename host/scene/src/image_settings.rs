//! Image settings that a scene states.

use serde::{Deserialize, Serialize};

/// Reflectance of dielectrics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Fresnel {
    /// Fresnel's equations.
    Exact,
    /// Schlick's approximation, as in "Ray Tracing in One Weekend".
    Schlick,
}

/// Image settings of a scene; the command line overrides them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageSettings {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Maximum number of segments of a path.
    pub depth: u32,
    /// Reflectance model of dielectrics.
    pub fresnel: Fresnel,
}
