//! Coat of a layered material (KHR_materials_clearcoat): a boundary of index 1.5 over all else,
//! with facets and a normal of its own.

use super::boundary::Boundary;
use super::{Bsdf, BsdfEval, ZERO_EVAL, reflect};
use crate::math::{basis, max, min, sqrt};
use crate::microfacet::{MIN_ROUGH_ALPHA, distribution, facing_area, sample_visible_normal};
use crate::microfacet_albedo::{lost_share, mean_lost_share};
use crate::rng::Words;
use glam::Vec3;

/// Reflectance at normal incidence.
const F0: f32 = 0.04;

/// A coat, as the viewer sees it. (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// Unit normal in the shading frame: that of the coat's normal map, else that of the surface
    /// without its own.
    normal: Vec3,
    strength: f32,
    alpha: f32,
    /// Albedo from the viewer, times the strength.
    pub from_viewer: f32,
}

impl Coat {
    /// Stands for no coat.
    pub const NONE: Self = Self { strength: 0.0, alpha: 1.0, normal: Vec3::Z, from_viewer: 0.0 };

    /// Returns the coat of a BSDF.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Self {
        let (layers, roughness) = (&bsdf.layers, bsdf.layers.coat_roughness);
        let mut coat = Self::NONE;
        if layers.coat > 0.0 {
            coat.strength = layers.coat;
            coat.alpha = max(roughness * roughness, MIN_ROUGH_ALPHA);
            if layers.coat_normal != Vec3::ZERO {
                coat.normal = bsdf.world_to_local(layers.coat_normal);
            }
            let cos = min(max(bsdf.local_viewer.dot(coat.normal), 1e-6), 1.0);
            let boundary = Boundary::new(F0, 1.0, roughness, mean_lost_share(roughness));
            coat.from_viewer = coat.strength * boundary.albedo_of(cos, lost_share(cos, roughness));
        }
        coat
    }

    /// Returns the part of what is below that the viewer sees through the coat. The extension mixes
    /// by the viewer's angle alone, which returns all light but is not reciprocal.
    #[inline(always)]
    pub fn passed(&self) -> f32 {
        1.0 - self.from_viewer
    }

    /// Samples a reflected direction of the shading frame.
    #[inline(always)]
    pub fn sample(&self, bsdf: &Bsdf, random: Words) -> Vec3 {
        let ((x, y), o) = (basis(self.normal), bsdf.local_viewer);
        let v = Vec3::new(o.dot(x), o.dot(y), max(o.dot(self.normal), 1e-6));
        let h = sample_visible_normal(v, self.alpha, random.x, random.y);
        reflect(o, x * h.x + y * h.y + self.normal * h.z)
    }

    /// Returns value and pdf for the direction `i` of the shading frame, above the surface. Light
    /// that facets send to others is lost: at most 0.025 of all light.
    #[inline(always)]
    pub fn evaluate(&self, bsdf: &Bsdf, i: Vec3) -> BsdfEval {
        let (o, height) = (max(bsdf.local_viewer.dot(self.normal), 1e-6), i.dot(self.normal));
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
