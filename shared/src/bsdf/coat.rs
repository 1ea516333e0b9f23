//! Coat of a layered material (KHR_materials_clearcoat): a boundary of index 1.5 over all else,
//! with facets and a normal of its own.

use super::boundary::Boundary;
use super::microfacets::LostLight;
use super::{Bsdf, BsdfEval, ZERO_EVAL, reflect};
use crate::math::{basis, max, min, sqrt};
use crate::microfacet::{MIN_ROUGH_ALPHA, distribution, facing_area, sample_visible_normal};
use crate::microfacet_albedo::mean_lost_share;
use crate::rng::Words;
use glam::Vec3;

/// Reflectance at normal incidence.
const F0: f32 = 0.04;

#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    strength: f32,
    alpha: f32,
    /// Unit normal in the shading frame: that of the surface without its normal map.
    normal: Vec3,
    viewer: Vec3,
    boundary: Boundary,
}

impl Coat {
    /// Returns the coat of a BSDF.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Self {
        let (layers, roughness) = (&bsdf.layers, bsdf.layers.coat_roughness);
        let lost = LostLight { viewer: 0.0, mean: mean_lost_share(roughness) };
        Self {
            strength: layers.coat,
            alpha: max(roughness * roughness, MIN_ROUGH_ALPHA),
            normal: if bsdf.is_mapped { bsdf.local_smooth } else { Vec3::Z },
            viewer: bsdf.local_viewer,
            boundary: Boundary::new(F0, 1.0, roughness, &lost),
        }
    }

    /// Returns the albedo from a direction of the shading frame, times the strength.
    #[inline(always)]
    pub fn albedo_from(&self, direction: Vec3) -> f32 {
        if self.strength <= 0.0 {
            return 0.0;
        }
        self.strength * self.boundary.albedo(min(max(direction.dot(self.normal), 1e-6), 1.0))
    }

    /// Returns the part of the light between two directions of the shading frame that passes the
    /// coat to a wide lobe below it and out again, as [`Boundary::passed`] does.
    #[inline(always)]
    pub fn passed(&self, o: Vec3, i: Vec3) -> f32 {
        (1.0 - self.albedo_from(o))
            * (1.0 - self.albedo_from(i))
            * (1.0 / (1.0 - self.strength * self.boundary.mean))
    }

    /// Samples a reflected direction of the shading frame.
    #[inline(always)]
    pub fn sample(&self, random: Words) -> Vec3 {
        let (x, y) = basis(self.normal);
        let v = Vec3::new(self.viewer.dot(x), self.viewer.dot(y), max(self.viewer.dot(self.normal), 1e-6));
        let h = sample_visible_normal(v, self.alpha, random.x, random.y);
        reflect(self.viewer, x * h.x + y * h.y + self.normal * h.z)
    }

    /// Returns value and pdf for the direction `i` of the shading frame, above the surface. Light
    /// that facets send to others is lost: at most 0.025 of all light.
    #[inline(always)]
    pub fn evaluate(&self, bsdf: &Bsdf, i: Vec3) -> BsdfEval {
        let (o, height) = (max(self.viewer.dot(self.normal), 1e-6), i.dot(self.normal));
        let sum = bsdf.local_viewer + i;
        let length2 = sum.dot(sum);
        if self.strength <= 0.0 || height <= 0.0 || length2 <= 0.0 {
            return ZERO_EVAL;
        }
        let half = sum * (1.0 / sqrt(length2));
        let (cos, up) = (min(max(half.dot(i), 0.0), 1.0), min(half.dot(self.normal), 1.0));
        // In a frame of the normal the distribution asks for the lengths along and across alone.
        // 1 - up² would cancel where the lobe is narrow.
        let across = half.cross(self.normal);
        let h = Vec3::new(sqrt(across.dot(across)), 0.0, up);
        let common = 0.25 * distribution(h, self.alpha);
        let (facing_o, facing_i) =
            (facing_area(min(o, 1.0), self.alpha), facing_area(min(height, 1.0), self.alpha));
        let x = 1.0 - cos;
        let x2 = x * x;
        let f = F0 + (1.0 - F0) * (x2 * x2 * x);
        let seen = common * height * (1.0 / (facing_o * height + o * (facing_i - height)));
        BsdfEval { value: Vec3::splat(self.strength * f * seen), pdf: common * (1.0 / facing_o) }
    }
}
