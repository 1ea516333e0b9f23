//! The media of a scene file, as serde reads them.

use super::name::{Name, Named};
use super::transform::Transform;
use crate::values::{Anisotropy, Extinction, Radiance, Share, some};
use serde::Deserialize;

/// A participating medium.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Medium<'a> {
    /// Part of the light that collides, by channel, per scene unit, where the density is 1.
    pub extinction: (Extinction, Extinction, Extinction),
    /// Fraction of that light that is scattered, by channel; default: 0.
    #[serde(default = "black")]
    pub albedo: (Share, Share, Share),
    /// Mean cosine of the scattering angle; default: 0.
    #[serde(default = "even")]
    pub anisotropy: Anisotropy,
    /// Radiance of a thick layer that does not scatter; default: 0.
    #[serde(default = "dark")]
    pub emission: (Radiance, Radiance, Radiance),
    /// Densities; default: 1 everywhere.
    #[serde(default, borrow, deserialize_with = "some")]
    pub grid: Option<Grid<'a>>,
}

/// Densities from a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid<'a> {
    /// File name, relative to the scene file.
    #[serde(borrow)]
    pub file: Name<'a>,
    /// Transform of the box that the file states.
    #[serde(default)]
    pub transform: Transform,
}

impl Named for Medium<'_> {
    const KIND: &'static str = "medium";
    const FIELD: &'static str = "media";
}

fn black() -> (Share, Share, Share) {
    (Share(0.0), Share(0.0), Share(0.0))
}

fn even() -> Anisotropy {
    Anisotropy(0.0)
}

fn dark() -> (Radiance, Radiance, Radiance) {
    (Radiance(0.0), Radiance(0.0), Radiance(0.0))
}
