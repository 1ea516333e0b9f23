//! Rough boundary of a dielectric over a base: what it reflects, and what it lets pass.

use super::Bsdf;
use crate::material::Material;
use crate::math::min;
use crate::microfacet_albedo::{GrazingTerms, grazing_share, mean_schlick, returned_share};
use glam::Vec3;

/// Rough boundary: all light that it reflects, by single and multiple scattering.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary {
    /// Reflectance at normal incidence.
    f0: f32,
    /// Reflectance at grazing incidence.
    f90: f32,
    terms: GrazingTerms,
    /// Part of the lost light that comes out again.
    pub again: f32,
    /// Part of the light that counts as reflected beyond the albedo.
    margin: f32,
}

impl Boundary {
    /// Creates the boundary with these reflectances at normal and at grazing incidence, whose
    /// facets lose `mean_lost` of all light.
    #[inline(always)]
    pub fn new(f0: f32, f90: f32, roughness: f32, mean_lost: f32) -> Self {
        let terms = GrazingTerms::of(roughness);
        let again = returned_share(mean_schlick(Vec3::splat(f0), Vec3::splat(f90)), mean_lost).x;
        Self { f0, f90, terms, again, margin: 0.0 }
    }

    /// Returns the boundary with a margin of its albedo, for reflectances of another form.
    #[inline(always)]
    pub fn with_margin(self, margin: f32) -> Self {
        Self { margin, ..self }
    }

    /// Returns the albedo from cosine `cos`, at most 1; `lost` is the share of light from there
    /// that the facets lose.
    #[inline(always)]
    pub fn albedo_of(&self, cos: f32, lost: f32) -> f32 {
        let at_once = self.f0 * (1.0 - lost) + (self.f90 - self.f0) * grazing_share(cos, &self.terms);
        min(at_once + lost * self.again + self.margin, 1.0)
    }

    /// Returns the part of the light to cosine `cos` that a white diffuse base sends through the
    /// boundary; `lost` is that of [`Self::albedo_of`]. By the viewer's angle alone, boundary and
    /// base return all light, as in OpenPBR ("albedo scaling"); the base is not reciprocal.
    #[inline(always)]
    pub fn passed(&self, cos: f32, lost: f32) -> f32 {
        1.0 - self.albedo_of(cos, lost)
    }
}

/// Returns the reflectance at normal incidence of the dielectric part.
#[inline(always)]
pub(super) fn dielectric_f0(material: &Material) -> f32 {
    let r = (material.ior - 1.0) * (1.0 / (material.ior + 1.0));
    r * r
}

/// Returns the diffuseness of a metal's and a dielectric's mix: the diffuse part, and of the rest
/// what the width of the lobe makes.
#[inline(always)]
pub(super) fn diffuseness(bsdf: &Bsdf) -> f32 {
    let m = &bsdf.material;
    let base = (1.0 - m.metallic) * (1.0 - m.transmission);
    base + (1.0 - base) * (bsdf.alpha * bsdf.alpha)
}
