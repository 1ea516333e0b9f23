//! Rough boundary of a dielectric over a base: what it reflects, and what it lets pass.

use super::microfacets::LostLight;
use crate::material::Material;
use crate::math::min;
use crate::microfacet_albedo::{grazing_share, lost_share, mean_grazing_share, mean_schlick, returned_share};
use glam::Vec3;

/// Rough boundary: all light that it reflects, by single and multiple scattering.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary {
    /// Reflectance at normal incidence.
    f0: f32,
    /// Reflectance at grazing incidence.
    f90: f32,
    roughness: f32,
    /// Part of the lost light that comes out again.
    pub again: f32,
    /// Mean of the albedo over all directions, at most 0.99.
    pub mean: f32,
}

impl Boundary {
    /// Creates the boundary with these reflectances at normal and at grazing incidence.
    #[inline(always)]
    pub fn new(f0: f32, f90: f32, roughness: f32, lost: &LostLight) -> Self {
        let again = returned_share(mean_schlick(Vec3::splat(f0), Vec3::splat(f90)), lost.mean).x;
        let mean = f0 * (1.0 - lost.mean) + (f90 - f0) * mean_grazing_share(roughness) + lost.mean * again;
        Self { f0, f90, roughness, again, mean: min(mean, 0.99) }
    }

    /// Returns the albedo from cosine `cos`, at most 1.
    #[inline(always)]
    pub fn albedo(&self, cos: f32) -> f32 {
        let lost = lost_share(cos, self.roughness);
        let at_once = self.f0 * (1.0 - lost) + (self.f90 - self.f0) * grazing_share(cos, self.roughness);
        min(at_once + lost * self.again, 1.0)
    }

    /// Returns the part of the light between directions with these cosines that a white diffuse
    /// base under the boundary scatters: light that the boundary lets in and out again, normalised
    /// so that the base returns all that enters (the form of Ashikhmin and Shirley, 2000, with this
    /// boundary's albedo). It is reciprocal, and with the boundary's part not above 1.
    #[inline(always)]
    pub fn passed(&self, cos_in: f32, cos_out: f32) -> f32 {
        (1.0 - self.albedo(cos_in)) * (1.0 - self.albedo(cos_out)) * (1.0 / (1.0 - self.mean))
    }
}

/// Returns the reflectance at normal incidence of the dielectric part.
#[inline(always)]
pub(super) fn dielectric_f0(material: &Material) -> f32 {
    let r = (material.ior - 1.0) * (1.0 / (material.ior + 1.0));
    r * r
}
