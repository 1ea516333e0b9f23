//! glTF's material: a mix of a metal and a dielectric over a diffuse or clear base.

use super::boundary::{Boundary, dielectric_f0, diffuseness};
use super::microfacets::{Facet, FacetEval, Lost, MicrofacetLobe, Prepared, Proposal, cosine_direction};
use super::{Bsdf, BsdfEval};
use crate::fresnel;
use crate::material::Material;
use crate::math::{max, max_component, normalize, unit_f32, unit_sphere};
use crate::microfacet::MIN_ROUGH_ALPHA;
use crate::microfacet_albedo::{mean_schlick, returned_share};
use crate::rng::Words;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

pub(super) struct MetallicRoughness;

impl MicrofacetLobe for MetallicRoughness {
    #[inline(always)]
    fn diffuseness(bsdf: &Bsdf) -> f32 {
        diffuseness(bsdf)
    }

    #[inline(always)]
    fn has_non_delta_lobe(bsdf: &Bsdf) -> bool {
        bsdf.alpha >= MIN_ROUGH_ALPHA || (bsdf.material.metallic < 1.0 && bsdf.material.transmission < 1.0)
    }

    #[inline(always)]
    fn prepare(bsdf: &Bsdf, lost: &Lost) -> Prepared {
        let m = &bsdf.material;
        let boundary = Boundary::new(dielectric_f0(m), 1.0, m.roughness, lost.mean);
        let f = max_component(reflectance(m, bsdf.local_viewer.z));
        let rest = (1.0 - m.metallic) * (1.0 - f) * max_component(m.albedo);
        // Light that facets lose comes out by the cosine, if they reflect much.
        let again = f * f * lost.viewer;
        let (facet, cosine) = (f - again, rest * (1.0 - m.transmission) + again);
        let clear = rest * m.transmission;
        let sum = facet + cosine + clear;
        let chosen = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        let mut share = Vec3::splat(boundary.again * (1.0 - m.metallic));
        if m.metallic > 0.0 {
            share += returned_share(mean_schlick(m.albedo, Vec3::ONE), lost.mean) * m.metallic;
        }
        let base = boundary.passed(bsdf.local_viewer.z, lost.viewer) * FRAC_1_PI;
        Prepared {
            again: share * lost.scale,
            lost: lost.viewer,
            scale: lost.scale,
            facet: facet * chosen,
            cosine: cosine * chosen,
            transmission: clear * chosen,
            base: (1.0 - m.metallic) * (1.0 - m.transmission) * base,
            returned: boundary.again,
        }
    }

    #[inline(always)]
    fn scatter(bsdf: &Bsdf, facet: &Facet, random: Words) -> Proposal {
        let mut proposal = Proposal::new(facet.mirrored, false);
        let (choice, prepared) = (unit_f32(random.z), &bsdf.prepared);
        let mirror = choice < prepared.facet;
        if !mirror {
            let rest = choice - prepared.facet - prepared.cosine;
            // Rounding may leave a number above both sums even where nothing is transmitted.
            if rest < 0.0 || prepared.transmission <= 0.0 {
                proposal.direction = cosine_direction(random);
                if bsdf.is_mapped {
                    // By the cosine, too.
                    proposal.direction = normalize(bsdf.local_mapped + unit_sphere(random.x, random.y));
                }
            } else {
                // A thin wall: light that enters leaves mirrored, or by the cosine if facets sent
                // it to others.
                if rest < prepared.lost * prepared.transmission {
                    proposal.direction = cosine_direction(random);
                }
                proposal.direction.z = -proposal.direction.z;
                proposal.transmitted = true;
            }
        }
        // A mirror's weight is over its probability; the diffuse lobe is weighted as on a rough
        // surface.
        if facet.smooth && (mirror || proposal.transmitted) {
            let f = reflectance(&bsdf.material, facet.cos);
            proposal.is_delta = true;
            proposal.delta_weight = if mirror {
                f * (1.0 / prepared.facet)
            } else {
                thin_wall_transmittance(&bsdf.material, f) * (1.0 / prepared.transmission)
            };
        }
        proposal
    }

    #[inline(always)]
    fn evaluate(bsdf: &Bsdf, i: Vec3, facets: &FacetEval) -> BsdfEval {
        let (m, prepared) = (&bsdf.material, &bsdf.prepared);
        let f = reflectance(m, facets.clamped_cos());
        let lost = facets.lost;
        // Cosine of the diffuse base, which has the normal of a normal map.
        let mut cos = i.z;
        if bsdf.is_mapped {
            cos = max(i.dot(bsdf.local_mapped), 0.0);
        }
        if !facets.reflected {
            let pdf = facets.pdf * (1.0 - prepared.lost) - prepared.lost * i.z * FRAC_1_PI;
            let pdf = pdf * prepared.transmission;
            let passed = (1.0 - prepared.returned) * prepared.scale * lost * -i.z;
            let again = thin_wall_transmittance(m, Vec3::ZERO) * passed;
            return BsdfEval { value: thin_wall_transmittance(m, f) * facets.value + again, pdf };
        }
        let again = prepared.again * (lost * i.z);
        let mut diffuse = m.albedo * (prepared.base * cos);
        if bsdf.is_mapped {
            diffuse *= bsdf.bump_shadowing(i);
        }
        BsdfEval {
            value: f * facets.value + diffuse + again,
            pdf: facets.pdf * prepared.facet + prepared.cosine * cos * FRAC_1_PI,
        }
    }
}

/// Returns the reflectance at incident cosine `cos`.
#[inline(always)]
fn reflectance(m: &Material, cos: f32) -> Vec3 {
    let f0 = Vec3::splat(dielectric_f0(m)) * (1.0 - m.metallic) + m.albedo * m.metallic;
    fresnel::schlick_from(f0, cos)
}

/// Returns whether a wall of this material lets light pass straight.
#[inline(always)]
pub(super) fn is_pane(m: &Material) -> bool {
    m.roughness * m.roughness < MIN_ROUGH_ALPHA && m.transmission > 0.0 && m.metallic < 1.0
}

/// Returns the part of the light that passes straight through a wall without roughness, which it
/// meets at cosine `cos`: what [`MetallicRoughness`] weighs with the probability of sampling it.
#[inline(always)]
pub(super) fn straight_transmittance(m: &Material, cos: f32) -> Vec3 {
    thin_wall_transmittance(m, reflectance(m, cos))
}

/// Returns the transmittance of a thin wall by channel: colour and fraction of the light that the
/// dielectric's boundary with reflectance `f` does not reflect.
#[inline(always)]
fn thin_wall_transmittance(m: &Material, f: Vec3) -> Vec3 {
    m.albedo * (Vec3::ONE - f) * ((1.0 - m.metallic) * m.transmission)
}
