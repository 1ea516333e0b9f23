//! Rough metal: a complex index of refraction, or a reflectance at normal incidence.

use super::microfacets::{Facet, FacetEval, Lost, MicrofacetLobe, Prepared, Proposal, cosine_direction};
use super::{Bsdf, BsdfEval, ZERO_EVAL};
use crate::fresnel;
use crate::material::{COMPLEX_IOR, Material};
use crate::math::{max_component, unit_f32};
use crate::microfacet_albedo::{mean_schlick, returned_share};
use crate::rng::Words;
use core::f32::consts::FRAC_1_PI;
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
    fn prepare(bsdf: &Bsdf, lost: &Lost) -> Prepared {
        let material = &bsdf.material;
        let mut prepared = Prepared::FACETS;
        if lost.viewer > 0.0 {
            // The mean reflectance is that of Schlick's approximation.
            let share = returned_share(mean_schlick(Self::albedo(material), Vec3::ONE), lost.mean);
            let again = lost.viewer * max_component(share);
            let at_once = (1.0 - lost.viewer) * max_component(reflectance(material, bsdf.local_viewer.z));
            let sum = again + at_once;
            prepared.again = share * lost.scale;
            prepared.cosine = if sum > 0.0 { again * (1.0 / sum) } else { 0.0 };
            prepared.facet = 1.0 - prepared.cosine;
        }
        prepared
    }

    #[inline(always)]
    fn scatter(bsdf: &Bsdf, facet: &Facet, random: Words) -> Proposal {
        let mut proposal = Proposal::new(facet.mirrored, false);
        if facet.smooth {
            proposal.is_delta = true;
            proposal.delta_weight = reflectance(&bsdf.material, facet.cos);
        } else if unit_f32(random.z) < bsdf.prepared.cosine {
            proposal.direction = cosine_direction(random);
        }
        proposal
    }

    #[inline(always)]
    fn evaluate(bsdf: &Bsdf, i: Vec3, facets: &FacetEval) -> BsdfEval {
        if !facets.reflected {
            return ZERO_EVAL;
        }
        let prepared = &bsdf.prepared;
        let value = reflectance(&bsdf.material, facets.clamped_cos()) * facets.value
            + prepared.again * (facets.lost * i.z);
        BsdfEval { value, pdf: facets.pdf * prepared.facet + prepared.cosine * i.z * FRAC_1_PI }
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
