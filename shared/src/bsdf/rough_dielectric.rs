//! Clear glass with a rough boundary. The host makes a smooth one a
//! [`DIELECTRIC`](super::DIELECTRIC).

use super::microfacets::{Facet, FacetEval, MicrofacetLobe, Proposal};
use super::{Bsdf, BsdfEval};
use crate::fresnel;
use crate::math::{sqrt, unit_f32};
use crate::rng::Words;
use glam::Vec3;

pub(super) struct RoughDielectric;

impl MicrofacetLobe for RoughDielectric {
    #[inline(always)]
    fn refracts(_: &Bsdf) -> bool {
        true
    }

    #[inline(always)]
    fn scatter(bsdf: &Bsdf, facet: &Facet, random: Words) -> Proposal {
        let mut proposal = Proposal::new(facet.mirrored, false);
        let eta = bsdf.eta();
        let cos2 = fresnel::refracted_cos2(facet.cos, eta);
        if cos2 > 0.0 {
            let refracted = sqrt(cos2);
            if unit_f32(random.z) >= fresnel::dielectric(facet.cos, refracted, eta) {
                proposal.direction = facet.normal * (eta * facet.cos - refracted) - bsdf.local_viewer * eta;
                proposal.transmitted = true;
            }
        }
        proposal
    }

    #[inline(always)]
    fn evaluate(bsdf: &Bsdf, _: Vec3, facets: &FacetEval) -> BsdfEval {
        let cos2 = fresnel::refracted_cos2(facets.cos, bsdf.eta());
        let f = if cos2 > 0.0 { fresnel::dielectric(facets.cos, sqrt(cos2), bsdf.eta()) } else { 1.0 };
        let share = if facets.reflected { f } else { 1.0 - f };
        BsdfEval { value: bsdf.material.albedo * (facets.value * share), pdf: facets.pdf * share }
    }
}
