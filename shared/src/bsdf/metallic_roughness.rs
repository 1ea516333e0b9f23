//! glTF's material: a mix of a metal and a dielectric over a diffuse or clear base.

use super::microfacets::{Facet, FacetEval, MicrofacetLobe, Proposal};
use super::{Bsdf, BsdfEval};
use crate::fresnel;
use crate::material::Material;
use crate::math::{max, max_component, normalize, sqrt, unit_circle, unit_f32, unit_sphere};
use crate::microfacet::{MIN_ROUGH_ALPHA, grazing_share, mean_grazing_share};
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
                let radius = sqrt(unit_f32(random.x));
                let (c, s) = unit_circle(random.y);
                proposal.direction = Vec3::new(radius * c, radius * s, sqrt(1.0 - unit_f32(random.x)));
                if bsdf.is_mapped {
                    // By the cosine, too.
                    proposal.direction = normalize(bsdf.local_mapped + unit_sphere(random.x, random.y));
                }
            } else {
                // A thin wall: light that enters leaves mirrored.
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
        if !facets.reflected {
            let mut pdf = facets.pdf * probabilities.transmission;
            if bsdf.is_mapped {
                pdf += probabilities.diffuse * cos * FRAC_1_PI;
            }
            return BsdfEval { value: thin_wall_transmittance(m, f) * facets.value, pdf };
        }
        // The diffuse base under the boundary: light that the boundary lets in and out again,
        // normalised so that a white base returns all that enters (the form of Ashikhmin and
        // Shirley, 2000, with this boundary's reflectance). It is reciprocal, and with the
        // boundary's part not above 1.
        let rest = 1.0 - dielectric_f0(m);
        let enter = 1.0 - grazing_share(viewer_cos, m.roughness);
        let leave = 1.0 - grazing_share(cos, m.roughness);
        let base = rest * enter * leave * (1.0 / (1.0 - mean_grazing_share(m.roughness)));
        let mut diffuse = m.albedo * ((1.0 - m.metallic) * (1.0 - m.transmission) * base * cos * FRAC_1_PI);
        if bsdf.is_mapped {
            diffuse *= bsdf.bump_shadowing(i);
        }
        BsdfEval {
            value: f * facets.value + diffuse,
            pdf: facets.pdf * probabilities.specular + probabilities.diffuse * cos * FRAC_1_PI,
        }
    }
}

/// Probability of sampling each lobe.
#[derive(Clone, Copy, Debug)]
struct LobeProbabilities {
    specular: f32,
    diffuse: f32,
    transmission: f32,
}

#[inline(always)]
fn lobe_probabilities(bsdf: &Bsdf) -> LobeProbabilities {
    let m = &bsdf.material;
    let f = max_component(reflectance(m, bsdf.local_viewer.z));
    let rest = (1.0 - m.metallic) * (1.0 - f) * max_component(m.albedo);
    let (diffuse, clear) = (rest * (1.0 - m.transmission), rest * m.transmission);
    let sum = f + diffuse + clear;
    let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
    LobeProbabilities { specular: f * scale, diffuse: diffuse * scale, transmission: clear * scale }
}

/// Returns the reflectance at normal incidence of the dielectric part.
#[inline(always)]
fn dielectric_f0(material: &Material) -> f32 {
    let r = (material.ior - 1.0) * (1.0 / (material.ior + 1.0));
    r * r
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
