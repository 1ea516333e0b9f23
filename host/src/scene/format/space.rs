//! Where to compute.

use crate::scene::values::{Coordinate, Magnification, Point, vector};
use serde::Deserialize;

/// Origin and unit of length of the renderer.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Space {
    /// The point that becomes 0.
    origin: Point,
    /// Factor on lengths.
    scale: Magnification,
}

impl Default for Space {
    fn default() -> Self {
        Self { origin: (Coordinate(0.0), Coordinate(0.0), Coordinate(0.0)), scale: Magnification(1.0) }
    }
}

impl Space {
    /// For the description.
    pub fn space(&self) -> crate::scene::Space {
        crate::scene::Space { origin: vector(self.origin), scale: self.scale.0 }
    }
}
