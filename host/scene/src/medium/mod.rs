//! Participating media: volumes that absorb, scatter and emit. Scene files and programs that build
//! scenes give these types; `lower` makes device records of them.

mod grid;

pub use grid::DensityGrid;

use crate::limits;
use crate::ranges::{all, each};
use crate::values::{Anisotropy, Extinction, Radiance, Share};
use glam::{DAffine3, DVec3};
use std::sync::Arc;

/// Maximum number of media of a scene, those of glTF's volumes included: a path keeps their numbers
/// in 8 bits each.
pub const MAX_MEDIA: usize = 254;

/// Medium that fills the inside of surfaces, or surrounds a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Name for messages.
    pub name: String,
    /// Part of the light that collides, by channel, per scene unit; where the density is 1, if
    /// there is a grid. 0, or from 1e-18 to 1e18.
    pub extinction: DVec3,
    /// Fraction of that light that is scattered, by channel, 0 to 1; the rest is absorbed.
    pub albedo: DVec3,
    /// Mean cosine of the scattering angle, from -0.99 (back) over 0 (evenly) to 0.99 (straight
    /// on): g of Henyey and Greenstein.
    pub anisotropy: f64,
    /// Radiance of a thick layer that does not scatter, by channel.
    pub emission: DVec3,
    /// Densities that multiply the extinction; `None` for the same density everywhere.
    pub grid: Option<PlacedGrid>,
}

/// Grid of densities with its place.
#[derive(Clone, Debug)]
pub struct PlacedGrid {
    /// Densities.
    pub grid: Arc<DensityGrid>,
    /// Map from the unit cube, which the grid fills, to the world.
    pub transform: DAffine3,
}

impl PartialEq for PlacedGrid {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.grid, &other.grid) && self.transform == other.transform
    }
}

impl Medium {
    /// Returns a medium of the same density everywhere, which scatters evenly and does not emit.
    pub fn new(extinction: impl Into<DVec3>, albedo: impl Into<DVec3>) -> Self {
        Self {
            name: String::new(),
            extinction: extinction.into(),
            albedo: albedo.into(),
            anisotropy: 0.0,
            emission: DVec3::ZERO,
            grid: None,
        }
    }

    /// Returns the medium with this mean cosine of the scattering angle.
    #[must_use]
    pub fn anisotropy(self, anisotropy: f64) -> Self {
        Self { anisotropy, ..self }
    }

    /// Returns the medium with this radiance of a thick layer that does not scatter.
    #[must_use]
    pub fn emission(self, emission: impl Into<DVec3>) -> Self {
        Self { emission: emission.into(), ..self }
    }

    /// Returns the medium with densities that multiply the extinction; `transform` maps the unit
    /// cube, which they fill, to the world.
    #[must_use]
    pub fn grid(self, grid: impl Into<Arc<DensityGrid>>, transform: DAffine3) -> Self {
        Self { grid: Some(PlacedGrid { grid: grid.into(), transform }), ..self }
    }

    /// Checks that each number is finite and in range.
    pub(crate) fn check(&self) -> Result<(), String> {
        each::<Extinction>("extinction", self.extinction)?;
        each::<Share>("albedo", self.albedo)?;
        all::<Anisotropy>("anisotropy", &[self.anisotropy])?;
        each::<Radiance>("emission", self.emission)?;
        let Some(PlacedGrid { grid, transform }) = &self.grid else { return Ok(()) };
        if !limits::in_range(transform) {
            return Err("the transform of its grid goes beyond 1e18".to_owned());
        }
        if limits::is_singular(transform) {
            return Err("the transform of its grid flattens it".to_owned());
        }
        let peak = self.extinction * f64::from(grid.max());
        each::<Extinction>("extinction times the maximum density of the grid", peak)
    }

    /// Scales the lengths of the medium's space, which moves to `place`.
    pub(crate) fn move_to(&mut self, scale: f64, place: impl Fn(&DAffine3) -> DAffine3) {
        self.extinction /= scale;
        if let Some(grid) = &mut self.grid {
            grid.transform = place(&grid.transform);
        }
    }
}
