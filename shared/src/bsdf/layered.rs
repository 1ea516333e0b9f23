//! glTF's material with its extensions: from outside in a coat, a sheen, a boundary that may be
//! anisotropic, iridescent and coloured, and below it a diffuse, diffusely passing or clear base.
//!
//! Each layer weakens what is below it, so that the whole reflects no more light than arrives: a
//! sheen by the greater of its albedos from both directions, which is reciprocal; a coat and a
//! boundary by their albedos from the viewer, as their specifications mix. What leaves the facets
//! of a clear solid at once is scaled as that of [rough glass](glass_albedo).

use super::boundary::{Boundary, dielectric_f0, diffuseness};
use super::coat::Coat;
use super::microfacets::{Facet, FacetEval, Lost, MicrofacetLobe, Proposal, cosine_direction};
use super::{Bsdf, BsdfEval, sheen, thin_film};
use crate::fresnel;
use crate::glass_albedo::glass_albedo;
use crate::layers::SOLID;
use crate::math::{max, max_component, min, normalize, sqrt, unit_f32, unit_sphere};
use crate::microfacet::stretched_height;
use crate::microfacet_albedo::{mean_schlick, returned_share};
use crate::rng::Words;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

pub(super) struct Layered;

/// Part of the light that a film may reflect at grazing angles beyond the [`Boundary`] of its
/// greatest reflectance at normal incidence.
const FILM_MARGIN: f32 = 0.008;

impl MicrofacetLobe for Layered {
    #[inline(always)]
    fn refracts(bsdf: &Bsdf) -> bool {
        bsdf.layers.flags & SOLID != 0
    }

    #[inline(always)]
    fn diffuseness(bsdf: &Bsdf) -> f32 {
        diffuseness(bsdf)
    }

    /// All lobes have a width.
    #[inline(always)]
    fn has_non_delta_lobe(_: &Bsdf) -> bool {
        true
    }

    #[inline(always)]
    fn scatter(bsdf: &Bsdf, facet: &Facet, random: Words) -> Proposal {
        let mut proposal = Proposal::new(facet.mirrored, false);
        let lobes = &bsdf.lobes;
        let choice = unit_f32(random.z);
        let (to_facet, to_cosine) = (lobes.coat + lobes.facet, lobes.coat + lobes.facet + lobes.cosine);
        if choice < lobes.coat {
            proposal.direction = lobes.over.sample(bsdf, random);
        } else if choice < to_facet {
            let reflected = (choice - lobes.coat) < lobes.reflected(bsdf, facet.cos) * lobes.facet;
            if !reflected {
                proposal.transmitted = true;
                if Self::refracts(bsdf) {
                    let eta = bsdf.eta();
                    let cos2 = max(fresnel::refracted_cos2(facet.cos, eta), 0.0);
                    proposal.direction =
                        facet.normal * (eta * facet.cos - sqrt(cos2)) - bsdf.local_viewer * eta;
                } else {
                    proposal.direction.z = -proposal.direction.z;
                }
            }
        } else if choice < to_cosine || lobes.below <= 0.0 {
            proposal.direction = cosine_direction(random);
            if bsdf.is_mapped {
                // By the cosine, too.
                proposal.direction = normalize(bsdf.local_mapped + unit_sphere(random.x, random.y));
            }
        } else {
            proposal.direction = cosine_direction(random);
            proposal.direction.z = -proposal.direction.z;
            proposal.transmitted = true;
        }
        proposal
    }

    #[inline(always)]
    fn evaluate(bsdf: &Bsdf, i: Vec3, facets: &FacetEval) -> BsdfEval {
        let (m, layers, lobes) = (&bsdf.material, &bsdf.layers, &bsdf.lobes);
        let above = Vec3::new(i.x, i.y, i.z.abs());
        let lost = facets.lost;
        // Cosine of the diffuse base, which has the normal of a normal map.
        let mut cos = above.z;
        if bsdf.is_mapped && facets.reflected {
            cos = max(i.dot(bsdf.local_mapped), 0.0);
        }
        let Specular { dielectric, metal } = Specular::at(bsdf, facets.clamped_cos());
        let specular = dielectric * (1.0 - m.metallic) + metal * m.metallic;
        let share = lobes.reflected_of(dielectric, specular, is_total(bsdf, facets.clamped_cos()));
        let base = lobes.base * cos;
        let sheen_color = max_component(layers.sheen_color);
        let mut cover = 1.0;
        if sheen_color > 0.0 {
            cover = min(lobes.cover, 1.0 - sheen_color * sheen::albedo(above.z, layers.sheen_roughness));
        }
        let cover = cover * lobes.over.passed();
        let clear = m.albedo * ((1.0 - m.metallic) * m.transmission);
        if !facets.reflected {
            let mut value = clear * (Vec3::ONE - dielectric) * bsdf.dispersed * (facets.value * lobes.gain);
            let mut pdf = lobes.facet * (1.0 - share) * facets.pdf;
            if !Self::refracts(bsdf) {
                value += clear * ((1.0 - lobes.returned) * lobes.scale * lost * above.z);
            }
            value += layers.diffuse_transmission_color * (layers.diffuse_transmission * base);
            pdf += lobes.below * above.z * FRAC_1_PI;
            return BsdfEval { value: value * cover, pdf };
        }
        let mut diffuse = m.albedo * ((1.0 - layers.diffuse_transmission) * base);
        if bsdf.is_mapped {
            diffuse *= bsdf.bump_shadowing(i);
        }
        let narrow = specular * (facets.value * lobes.gain);
        let mut below = (narrow + lobes.again * (lost * i.z) + diffuse) * cover;
        if sheen_color > 0.0 {
            let half = sheen::half_cosine(bsdf.local_viewer, i);
            let value = sheen::value(bsdf.local_viewer.z, i.z, half, layers.sheen_roughness);
            below += layers.sheen_color * (value * lobes.over.passed());
        }
        let coated = lobes.over.evaluate(bsdf, i);
        BsdfEval {
            value: below + coated.value,
            pdf: lobes.coat * coated.pdf + lobes.facet * share * facets.pdf + lobes.cosine * cos * FRAC_1_PI,
        }
    }
}

/// Returns the reflectance of the dielectric part at normal incidence, by channel, and at grazing
/// incidence.
#[inline(always)]
fn specular_ends(bsdf: &Bsdf) -> (Vec3, f32) {
    let layers = &bsdf.layers;
    let f0 = layers.specular_color * dielectric_f0(&bsdf.material);
    (f0.min(Vec3::ONE) * layers.specular, layers.specular)
}

/// Returns the reflectance at normal incidence that bounds what the boundary reflects: that of the
/// channel which is reflected most, and with a thin film the greatest of three angles.
#[inline(always)]
fn greatest_f0(bsdf: &Bsdf, f0: Vec3) -> f32 {
    let plain = max_component(f0);
    if bsdf.layers.film <= 0.0 {
        return plain;
    }
    let at = max_component(Specular::at(bsdf, 1.0).dielectric);
    let at = max(at, max_component(Specular::at(bsdf, 0.8).dielectric));
    // A margin for the angles between them.
    min(max(plain, max(at, max_component(Specular::at(bsdf, 0.6).dielectric))) + 0.01, 1.0)
}

/// Reflectances at a facet.
#[derive(Clone, Copy, Debug)]
struct Specular {
    dielectric: Vec3,
    metal: Vec3,
}

impl Specular {
    /// Returns the reflectances at incident cosine `cos`. A clear solid has those of Fresnel's
    /// equations, which know total reflection; all others Schlick's approximation.
    #[inline(always)]
    fn at(bsdf: &Bsdf, cos: f32) -> Self {
        let (m, layers) = (&bsdf.material, &bsdf.layers);
        let (f0, f90) = specular_ends(bsdf);
        let x = max(1.0 - cos, 0.0);
        let x2 = x * x;
        let mut dielectric = f0 + (Vec3::splat(f90) - f0) * (x2 * x2 * x);
        let mut metal = fresnel::schlick_from(m.albedo, cos);
        if layers.film > 0.0 {
            let (ior, thickness) = (layers.film_ior, layers.film_thickness);
            dielectric += (thin_film::reflectance(cos, ior, thickness, f0) * f90 - dielectric) * layers.film;
            metal += (thin_film::reflectance(cos, ior, thickness, m.albedo) - metal) * layers.film;
        }
        if layers.flags & SOLID != 0 && m.transmission > 0.0 {
            let cos2 = fresnel::refracted_cos2(cos, bsdf.eta());
            let exact = if cos2 > 0.0 { fresnel::dielectric(cos, sqrt(cos2), bsdf.eta()) } else { 1.0 };
            let tint = layers.specular_color.min(Vec3::ONE) * layers.specular;
            let clear = if cos2 > 0.0 { tint * exact } else { Vec3::ONE };
            dielectric += (clear - dielectric) * m.transmission;
        }
        Self { dielectric, metal }
    }
}

/// Returns whether a facet of a solid reflects all light from cosine `cos`.
#[inline(always)]
fn is_total(bsdf: &Bsdf, cos: f32) -> bool {
    bsdf.layers.flags & SOLID != 0 && fresnel::refracted_cos2(cos, bsdf.eta()) <= 0.0
}

/// Returns the factor of light that leaves the facets at once, for the share `glass` of a solid's
/// clear part. A tint of its reflection weakens the factor, so that no light is added.
#[inline(always)]
fn gain(bsdf: &Bsdf, glass: f32) -> f32 {
    if glass <= 0.0 {
        return 1.0;
    }
    let (layers, o) = (&bsdf.layers, bsdf.local_viewer);
    let tint = layers.specular_color;
    let tint = layers.specular * min(min(tint.x, min(tint.y, tint.z)), 1.0);
    let height = stretched_height(o, bsdf.alpha_x, bsdf.alpha_y);
    let albedo = glass_albedo(o.z, height, bsdf.material.roughness, bsdf.eta());
    1.0 + glass * tint * (1.0 / albedo - 1.0)
}

/// Probability of sampling each lobe, and numbers that lobes share, as the viewer sees them.
/// (Vectors begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(super) struct LayeredLobes {
    /// [`scale`](Self::scale) times the part of lost light that comes out, by channel.
    again: Vec3,
    coat: f32,
    /// Reflection and transmission by the facet that is met.
    facet: f32,
    /// Directions by the cosine: of the diffuse base, of multiple scattering and of the sheen.
    cosine: f32,
    /// Directions by the cosine on the other side.
    below: f32,
    /// Share of light that passes the clear base.
    clear: f32,
    /// Factor of lost light that comes out again, per steradian.
    scale: f32,
    /// Factor of light that leaves the facets at once: above 1 for glass.
    gain: f32,
    /// Light that a white diffuse base sends to the viewer, per steradian.
    base: f32,
    /// Part of the light that facets lose which comes out again from the dielectric part.
    returned: f32,
    /// Light that the sheen leaves from the viewer.
    cover: f32,
    over: Coat,
}

impl LayeredLobes {
    /// Stands for those of a material that is not layered.
    pub const NONE: Self = Self {
        coat: 0.0,
        facet: 0.0,
        cosine: 0.0,
        below: 0.0,
        clear: 0.0,
        scale: 0.0,
        gain: 1.0,
        again: Vec3::ZERO,
        base: 0.0,
        returned: 0.0,
        cover: 1.0,
        over: Coat::NONE,
    };

    /// Returns those of a BSDF.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Self {
        let (m, layers, o) = (&bsdf.material, &bsdf.layers, bsdf.local_viewer);
        let lost = if bsdf.is_stretched() { Lost::stretched(bsdf) } else { Lost::of(bsdf) };
        let Lost { viewer: lost, mean, scale } = lost;
        let glass = if layers.flags & SOLID != 0 { (1.0 - m.metallic) * m.transmission } else { 0.0 };
        let at = Specular::at(bsdf, o.z);
        let f = max_component(at.dielectric * (1.0 - m.metallic) + at.metal * m.metallic);
        let again = f * f * lost * (1.0 - glass);
        let entered = (1.0 - m.metallic) * max(1.0 - max_component(at.dielectric), 0.0);
        let clear = entered * m.transmission * max_component(m.albedo);
        let base = entered * (1.0 - m.transmission);
        let passed = base * layers.diffuse_transmission;
        let diffuse = (base - passed) * max_component(m.albedo);
        let through = passed * max_component(layers.diffuse_transmission_color);
        let scattered = if layers.flags & SOLID == 0 { clear * lost } else { 0.0 };
        let over = Coat::of(bsdf);
        let coat = over.from_viewer;
        let sheen_color = max_component(layers.sheen_color);
        let sheen =
            if sheen_color > 0.0 { sheen_color * sheen::albedo(o.z, layers.sheen_roughness) } else { 0.0 };
        let rest = (1.0 - coat) * (1.0 - sheen);
        let facet = rest * (f - again + clear - scattered);
        let cosine = rest * (again + diffuse) + (1.0 - coat) * sheen;
        let below = rest * (through + scattered);
        let sum = coat + facet + cosine + below;
        let chosen = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        let (f0, f90) = specular_ends(bsdf);
        let boundary = Boundary::new(greatest_f0(bsdf, f0), f90, m.roughness, mean)
            .with_margin(if layers.film > 0.0 { FILM_MARGIN } else { 0.0 });
        let mut share = returned_share(mean_schlick(f0, Vec3::splat(f90)), mean);
        share *= (1.0 - m.metallic) - glass;
        if m.metallic > 0.0 {
            share += returned_share(mean_schlick(m.albedo, Vec3::ONE), mean) * m.metallic;
        }
        let base = boundary.passed(o.z, lost) * FRAC_1_PI;
        Self {
            coat: coat * chosen,
            facet: facet * chosen,
            cosine: cosine * chosen,
            below: below * chosen,
            clear: (1.0 - m.metallic) * m.transmission * max_component(m.albedo),
            scale,
            gain: gain(bsdf, glass),
            again: share * scale,
            base: (1.0 - m.metallic) * (1.0 - m.transmission) * base,
            returned: boundary.again,
            cover: 1.0 - sheen,
            over,
        }
    }

    /// Returns the probability that a facet that is met at cosine `cos` reflects.
    #[inline(always)]
    fn reflected(&self, bsdf: &Bsdf, cos: f32) -> f32 {
        if self.clear <= 0.0 {
            return 1.0;
        }
        let (at, metallic) = (Specular::at(bsdf, cos), bsdf.material.metallic);
        let specular = at.dielectric * (1.0 - metallic) + at.metal * metallic;
        self.reflected_of(at.dielectric, specular, is_total(bsdf, cos))
    }

    /// Returns the same from the reflectances of the dielectric part and of the whole; `total` is
    /// true at total reflection.
    #[inline(always)]
    fn reflected_of(&self, dielectric: Vec3, specular: Vec3, total: bool) -> f32 {
        let f = max_component(specular);
        let sum = f + self.clear * max(1.0 - max_component(dielectric), 0.0);
        if self.clear > 0.0 && sum > 0.0 && !total { min(f * (1.0 / sum), 1.0) } else { 1.0 }
    }
}
