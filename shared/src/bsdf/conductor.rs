//! Rough metal: a complex index of refraction, or a reflectance at normal incidence.

use super::microfacets::{Facet, FacetEval, MicrofacetLobe, Proposal};
use super::{Bsdf, BsdfEval, ZERO_EVAL};
use crate::fresnel;
use crate::material::{COMPLEX_IOR, Material};
use crate::rng::Words;
use glam::Vec3;

pub(super) struct Conductor;

impl MicrofacetLobe for Conductor {
    #[inline(always)]
    fn albedo(material: &Material) -> Vec3 {
        if material.flags & COMPLEX_IOR != 0 {
            return fresnel::conductor(1.0, material.eta, material.k);
        }
        material.albedo
    }

    #[inline(always)]
    fn scatter(bsdf: &Bsdf, facet: &Facet, _: Words) -> Proposal {
        let mut proposal = Proposal::new(facet.mirrored, false);
        if facet.smooth {
            proposal.is_delta = true;
            proposal.delta_weight = reflectance(&bsdf.material, facet.cos);
        }
        proposal
    }

    #[inline(always)]
    fn evaluate(bsdf: &Bsdf, _: Vec3, facets: &FacetEval) -> BsdfEval {
        if !facets.reflected {
            return ZERO_EVAL;
        }
        let f = reflectance(&bsdf.material, facets.clamped_cos());
        BsdfEval { value: f * facets.value, pdf: facets.pdf }
    }
}

/// Returns the reflectance at incident cosine `cos`.
#[inline(always)]
fn reflectance(material: &Material, cos: f32) -> Vec3 {
    if material.flags & COMPLEX_IOR != 0 {
        return fresnel::conductor(cos, material.eta, material.k);
    }
    fresnel::schlick_from(material.albedo, cos)
}
