//! The book's metal: a mirror whose direction is moved by a uniform point of a ball.

use super::book::{BookLobe, Incidence, Scattered};
use super::{Bsdf, reflect};
use crate::features::{FeatureSet, Features};
use crate::material::Material;
use crate::math::{cbrt_unit, sqrt, unit_f32};
use crate::rng::Words;
use core::f32::consts::PI;
use glam::Vec3;

pub(super) struct Metal;

impl BookLobe for Metal {
    #[inline(always)]
    fn scatter<const POSSIBLE: Features>(
        _: FeatureSet<POSSIBLE>,
        material: &Material,
        at: &Incidence,
        random: Words,
    ) -> Scattered {
        let radius = material.fuzz * cbrt_unit(unit_f32(random.z));
        Scattered { base: at.reflected, radius, transmitted: false }
    }

    /// Returns the pdf of the mirrored direction plus a uniform point of a ball, normalised. At
    /// distance s along the direction, the volume per steradian is s² ds: the pdf is its integral
    /// from the ball's near to its far face, over the ball's volume.
    #[inline(always)]
    fn pdf(bsdf: &Bsdf, direction: Vec3, _: f32) -> f32 {
        let mirrored = reflect(bsdf.viewer, bsdf.normal);
        let fuzz = bsdf.material.fuzz;
        let along = direction.dot(mirrored);
        let aside = direction - mirrored * along;
        let half_chord2 = fuzz * fuzz - aside.dot(aside);
        if half_chord2 <= 0.0 || along <= 0.0 {
            return 0.0;
        }
        let s = 4.0 * along * along - (1.0 - fuzz * fuzz);
        2.0 * sqrt(half_chord2) * s * (1.0 / (4.0 * PI * fuzz * fuzz * fuzz))
    }

    #[inline(always)]
    fn diffuseness(material: &Material) -> f32 {
        material.fuzz * material.fuzz
    }

    #[inline(always)]
    fn has_non_delta_lobe(material: &Material) -> bool {
        material.fuzz > 0.0
    }

    const ABSORBS_BELOW: bool = true;
}
