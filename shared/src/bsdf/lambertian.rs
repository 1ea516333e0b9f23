//! Diffuse reflection: a cosine lobe, sampled as the normal plus a point of the unit sphere.

use super::Bsdf;
use super::book::{BookLobe, Incidence, Scattered};
use crate::features::{FeatureSet, Features};
use crate::material::Material;
use crate::rng::Words;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

pub(super) struct Lambertian;

impl BookLobe for Lambertian {
    #[inline(always)]
    fn scatter<const POSSIBLE: Features>(
        _: FeatureSet<POSSIBLE>,
        _: &Material,
        at: &Incidence,
        _: Words,
    ) -> Scattered {
        Scattered { base: at.normal, radius: 1.0, transmitted: false }
    }

    #[inline(always)]
    fn pdf(_: &Bsdf, _: Vec3, cos: f32) -> f32 {
        cos * FRAC_1_PI
    }

    #[inline(always)]
    fn diffuseness(_: &Material) -> f32 {
        1.0
    }

    #[inline(always)]
    fn has_non_delta_lobe(_: &Material) -> bool {
        true
    }
}
