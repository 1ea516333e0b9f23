//! glTF's material: a mix of a metal and a dielectric over a diffuse or clear base.

use super::boundary::{Boundary, dielectric_f0};
use super::microfacets::{Facet, FacetEval, LostLight, MicrofacetLobe, Proposal, cosine_direction};
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
        let m = &bsdf.material;
        let base = (1.0 - m.metallic) * (1.0 - m.transmission);
        base + (1.0 - base) * (bsdf.alpha * bsdf.alpha)
    }

    #[inline(always)]
    fn has_non_delta_lobe(bsdf: &Bsdf) -> bool {
        bsdf.alpha >= MIN_ROUGH_ALPHA || (bsdf.material.metallic < 1.0 && bsdf.material.transmission < 1.0)
    }

    #[inline(always)]
    fn scatter(bsdf: &Bsdf, facet: &Facet, random: Words) -> Proposal {
        let mut proposal = Proposal::new(facet.mirrored, false);
        let choice = unit_f32(random.z);
        let probabilities = lobe_probabilities(bsdf);
        let mirror = choice < probabilities.specular;
        if !mirror {
            // Rounding may leave a number above both sums even where nothing is transmitted.
            if choice < probabilities.specular + probabilities.diffuse || probabilities.transmission <= 0.0 {
                proposal.direction = cosine_direction(random);
                if bsdf.is_mapped {
                    // By the cosine, too.
                    proposal.direction = normalize(bsdf.local_mapped + unit_sphere(random.x, random.y));
                }
            } else {
                // A thin wall: light that enters leaves mirrored, or by the cosine if facets sent it
                // to others.
                let rest = choice - probabilities.specular - probabilities.diffuse;
                if rest < LostLight::of(bsdf).viewer * probabilities.transmission {
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
                f * (1.0 / probabilities.specular)
            } else {
                thin_wall_transmittance(&bsdf.material, f) * (1.0 / probabilities.transmission)
            };
        }
        proposal
    }

    #[inline(always)]
    fn evaluate(bsdf: &Bsdf, i: Vec3, facets: &FacetEval) -> BsdfEval {
        let m = &bsdf.material;
        let f = reflectance(m, facets.clamped_cos());
        let probabilities = lobe_probabilities(bsdf);
        // Cosines of the diffuse base, which has the normal of a normal map.
        let (mut cos, mut viewer_cos) = (i.z, bsdf.local_viewer.z);
        if bsdf.is_mapped {
            cos = max(i.dot(bsdf.local_mapped), 0.0);
            viewer_cos = max(bsdf.local_viewer.dot(bsdf.local_mapped), 1e-6);
        }
        // Light that facets send to others, and that comes out again.
        let lost = LostLight::of(bsdf);
        let boundary = Boundary::new(dielectric_f0(m), 1.0, m.roughness, &lost);
        if !facets.reflected {
            let pdf = facets.pdf * (1.0 - lost.viewer) - lost.viewer * i.z * FRAC_1_PI;
            let mut pdf = pdf * probabilities.transmission;
            if bsdf.is_mapped {
                pdf += probabilities.diffuse * cos * FRAC_1_PI;
            }
            let passed = (1.0 - boundary.again) * lost.returned(bsdf, -i.z);
            let again = thin_wall_transmittance(m, Vec3::ZERO) * passed;
            return BsdfEval { value: thin_wall_transmittance(m, f) * facets.value + again, pdf };
        }
        let metal = returned_share(mean_schlick(m.albedo, Vec3::ONE), lost.mean);
        let share = metal * m.metallic + Vec3::splat(boundary.again * (1.0 - m.metallic));
        let again = share * lost.returned(bsdf, i.z);
        let base = boundary.passed(viewer_cos, cos);
        let mut diffuse = m.albedo * ((1.0 - m.metallic) * (1.0 - m.transmission) * base * cos * FRAC_1_PI);
        if bsdf.is_mapped {
            diffuse *= bsdf.bump_shadowing(i);
        }
        BsdfEval {
            value: f * facets.value + diffuse + again,
            pdf: facets.pdf * probabilities.specular + probabilities.diffuse * cos * FRAC_1_PI,
        }
    }
}

/// Probability of sampling each lobe.
#[derive(Clone, Copy, Debug)]
struct LobeProbabilities {
    specular: f32,
    /// That of directions by the cosine: of the diffuse base and of multiple scattering.
    diffuse: f32,
    transmission: f32,
}

#[inline(always)]
fn lobe_probabilities(bsdf: &Bsdf) -> LobeProbabilities {
    let m = &bsdf.material;
    let f = max_component(reflectance(m, bsdf.local_viewer.z));
    let rest = (1.0 - m.metallic) * (1.0 - f) * max_component(m.albedo);
    // Light that facets lose comes out by the cosine, if they reflect much.
    let again = f * f * LostLight::of(bsdf).viewer;
    let (specular, diffuse, clear) =
        (f - again, rest * (1.0 - m.transmission) + again, rest * m.transmission);
    let sum = specular + diffuse + clear;
    let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
    LobeProbabilities { specular: specular * scale, diffuse: diffuse * scale, transmission: clear * scale }
}

/// Returns the reflectance at incident cosine `cos`.
#[inline(always)]
fn reflectance(m: &Material, cos: f32) -> Vec3 {
    let f0 = Vec3::splat(dielectric_f0(m)) * (1.0 - m.metallic) + m.albedo * m.metallic;
    fresnel::schlick_from(f0, cos)
}

/// Returns the transmittance of a thin wall by channel: colour and fraction of the light that the
/// dielectric's boundary with reflectance `f` does not reflect.
#[inline(always)]
fn thin_wall_transmittance(m: &Material, f: Vec3) -> Vec3 {
    m.albedo * (Vec3::ONE - f) * ((1.0 - m.metallic) * m.transmission)
}
