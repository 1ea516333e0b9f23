//! Smooth clear glass, which reflects or refracts.

use super::Bsdf;
use super::book::{BookLobe, Incidence, Scattered};
use crate::features::{FeatureSet, Features, SCHLICK};
use crate::fresnel;
use crate::material::Material;
use crate::math::{sqrt, unit_f32};
use crate::rng::Words;
use glam::Vec3;

pub(super) struct Dielectric;

impl BookLobe for Dielectric {
    #[inline(always)]
    fn scatter<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        material: &Material,
        at: &Incidence,
        random: Words,
    ) -> Scattered {
        let mut scattered = Scattered { base: at.reflected, radius: 0.0, transmitted: false };
        let cos = at.cos;
        let eta = if at.front { 1.0 / material.ior } else { material.ior };
        let along = eta * cos;
        let radicand = fresnel::refracted_cos2(cos, eta);
        // Total reflection if not above zero.
        if radicand > 0.0 {
            let cos_refracted = sqrt(radicand);
            let reflectance = if features.has::<SCHLICK>() {
                fresnel::schlick(cos, eta)
            } else {
                fresnel::dielectric(cos, cos_refracted, eta)
            };
            if unit_f32(random.z) >= reflectance {
                scattered.base = at.incoming * eta + at.normal * (along - cos_refracted);
                scattered.transmitted = true;
            }
        }
        scattered
    }

    #[inline(always)]
    fn pdf(_: &Bsdf, _: Vec3, _: f32) -> f32 {
        0.0
    }

    #[inline(always)]
    fn diffuseness(_: &Material) -> f32 {
        0.0
    }

    #[inline(always)]
    fn has_non_delta_lobe(_: &Material) -> bool {
        false
    }
}
