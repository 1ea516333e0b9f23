//! Clear glass with a rough boundary. The host makes a smooth one a
//! [`DIELECTRIC`](super::DIELECTRIC).
//!
//! What leaves at once is scaled to all light, by the viewer's [albedo](glass_albedo).

use super::microfacets::{Facet, FacetEval, Lost, MicrofacetLobe, Prepared, Proposal};
use super::{Bsdf, BsdfEval};
use crate::fresnel;
use crate::glass_albedo::glass_albedo;
use crate::material::SINGLE_SCATTERING;
use crate::math::{sqrt, unit_f32};
use crate::microfacet::stretched_height;
use crate::rng::Words;
use glam::Vec3;

pub(super) struct RoughDielectric;

impl MicrofacetLobe for RoughDielectric {
    #[inline(always)]
    fn refracts(_: &Bsdf) -> bool {
        true
    }

    #[inline(always)]
    fn prepare(bsdf: &Bsdf, _: &Lost) -> Prepared {
        let mut prepared = Prepared::FACETS;
        if bsdf.material.flags & SINGLE_SCATTERING == 0 {
            let (o, roughness) = (bsdf.local_viewer, bsdf.material.roughness);
            let height = stretched_height(o, bsdf.alpha, bsdf.alpha);
            prepared.scale = 1.0 / glass_albedo(o.z, height, roughness, bsdf.eta());
        }
        prepared
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
        let scaled = facets.value * share * bsdf.prepared.scale;
        BsdfEval { value: bsdf.material.albedo * scaled, pdf: facets.pdf * share }
    }
}
