//! Microfacet materials (GGX): a facet of the surface is sampled among those that the viewer sees;
//! each material says what the facet does.

use super::{Bsdf, BsdfEval, BsdfSample, ZERO_EVAL, is_layered, of_microfacets, reflect, uses_microfacets};
use crate::features::{FeatureSet, Features};
use crate::material::{Material, SINGLE_SCATTERING};
use crate::math::{max, min, sqrt, unit_circle, unit_f32};
use crate::microfacet::{
    MIN_ROUGH_ALPHA, distribution, distribution_along, facing_area, facing_area_along, sample_visible_normal,
    sample_visible_normal_along,
};
use crate::microfacet_albedo::{lost_share, mean_lost_share, scattered_again};
use crate::rng::Words;
use crate::stretched_albedo::{mean_stretched_lost_share, stretched_lost_share};
use glam::Vec3;

/// A microfacet material. Vectors are in the shading frame.
pub(super) trait MicrofacetLobe {
    /// Returns whether light that the facet transmits is refracted; a thin wall mirrors it.
    #[inline(always)]
    fn refracts(_: &Bsdf) -> bool {
        false
    }

    /// Returns what [`Bsdf::albedo`] does.
    #[inline(always)]
    fn albedo(material: &Material) -> Vec3 {
        material.albedo
    }

    /// Returns what [`Bsdf::diffuseness`] does.
    #[inline(always)]
    fn diffuseness(bsdf: &Bsdf) -> f32 {
        bsdf.alpha * bsdf.alpha
    }

    /// Returns what [`Bsdf::has_non_delta_lobe`] does.
    #[inline(always)]
    fn has_non_delta_lobe(bsdf: &Bsdf) -> bool {
        bsdf.alpha >= MIN_ROUGH_ALPHA
    }

    /// Returns the numbers that its lobes share.
    #[inline(always)]
    fn prepare(_: &Bsdf, _: &Lost) -> Prepared {
        Prepared::FACETS
    }

    /// Samples what the facet does: `random.z` chooses the lobe, `random.x` and `random.y` a
    /// direction of a lobe beside the facet's.
    fn scatter(bsdf: &Bsdf, facet: &Facet, random: Words) -> Proposal;

    /// Returns value and pdf for the direction `i`, from those of the facets.
    fn evaluate(bsdf: &Bsdf, i: Vec3, facets: &FacetEval) -> BsdfEval;
}

/// Facet that the path meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Unit normal.
    pub normal: Vec3,
    /// Cosine between the viewer's direction and the normal, in (0, 1].
    pub cos: f32,
    /// Direction of the viewer, mirrored about the normal.
    pub mirrored: Vec3,
    /// True if the surface is a plane, whose facets all have the normal (0, 0, 1).
    pub smooth: bool,
}

/// Numbers that the lobes of a material share for all directions, as the viewer sees them. They are
/// computed once for a vertex: a path evaluates the BSDF up to twice, and samples it. (Vectors
/// begin rows of 16 bytes: naga lays records out so.)
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    /// Light that facets send to others and that comes out again, for a direction whose light is
    /// all lost, per steradian (Kulla and Conty).
    pub again: Vec3,
    /// Share of the viewer's light that facets of full reflectance lose.
    pub lost: f32,
    /// Factor of [`lost_share`] for light that comes out again, per steradian; of clear glass, the
    /// factor of light that leaves at once.
    pub scale: f32,
    /// Probability of the lobe of the facet that is met.
    pub facet: f32,
    /// Probability of directions by the cosine.
    pub cosine: f32,
    /// Probability of the other side of the surface.
    pub transmission: f32,
    /// Light that a white diffuse base sends to the viewer, per steradian.
    pub base: f32,
    /// Part of the light that facets lose which comes out again from the dielectric part.
    pub returned: f32,
}

impl Prepared {
    /// Numbers of a material with the lobe of facets alone.
    pub const FACETS: Self = Self {
        again: Vec3::ZERO,
        lost: 0.0,
        scale: 1.0,
        facet: 1.0,
        cosine: 0.0,
        transmission: 0.0,
        base: 0.0,
        returned: 0.0,
    };
}

/// Light that facets of full reflectance send to others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lost {
    /// Share of the viewer's light; 0 on a plane.
    pub viewer: f32,
    /// Mean of all directions.
    pub mean: f32,
    /// Factor of the share of a direction for the light that comes out there, per steradian.
    pub scale: f32,
}

impl Lost {
    /// Returns what the facets of `bsdf` lose.
    #[inline(always)]
    pub fn of(bsdf: &Bsdf) -> Self {
        let (roughness, z) = (bsdf.material.roughness, bsdf.local_viewer.z);
        let rough = bsdf.alpha >= MIN_ROUGH_ALPHA && bsdf.material.flags & SINGLE_SCATTERING == 0;
        let viewer = if rough { lost_share(z, roughness) } else { 0.0 };
        Self::new(viewer, mean_lost_share(roughness))
    }

    /// Returns what facets lose along the tangent and across it.
    #[inline(always)]
    pub fn stretched(bsdf: &Bsdf) -> Self {
        let (x, y) = (bsdf.alpha_x, bsdf.alpha_y);
        Self::new(stretched_lost_share(bsdf.local_viewer, x, y), mean_stretched_lost_share(x, y))
    }

    #[inline(always)]
    fn new(viewer: f32, mean: f32) -> Self {
        Self { viewer, mean, scale: viewer * scattered_again(mean) }
    }
}

/// Returns a direction of the upper hemisphere, sampled by the cosine.
#[inline(always)]
pub(super) fn cosine_direction(random: Words) -> Vec3 {
    let square = unit_f32(random.x);
    let (radius, (c, s)) = (sqrt(square), unit_circle(random.y));
    Vec3::new(radius * c, radius * s, sqrt(1.0 - square))
}

/// Sampled direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proposal {
    pub direction: Vec3,
    /// True if the direction is on the other side of the surface than the viewer.
    pub transmitted: bool,
    /// True if the direction is that of a delta lobe, with the weight `delta_weight`.
    pub is_delta: bool,
    pub delta_weight: Vec3,
}

impl Proposal {
    /// Returns a direction of a lobe that is not a delta.
    #[inline(always)]
    pub fn new(direction: Vec3, transmitted: bool) -> Self {
        Self { direction, transmitted, is_delta: false, delta_weight: Vec3::ZERO }
    }
}

/// Reflection and transmission by the facets alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetEval {
    /// Value times |cosine|, without the facets' reflectance or transmittance.
    pub value: f32,
    /// pdf of the direction if the facet's lobe is chosen, per steradian.
    pub pdf: f32,
    /// Cosine between the viewer's direction and the facet's normal; not above 0 if no facet sends
    /// light from one direction to the other.
    pub cos: f32,
    /// True if the direction is on the viewer's side.
    pub reflected: bool,
    /// [Lost share](lost_share) of the direction.
    pub lost: f32,
}

impl Bsdf {
    /// Computes the numbers that the lobes share.
    #[inline(always)]
    pub(super) fn prepare<const POSSIBLE: Features>(&mut self, features: FeatureSet<POSSIBLE>) {
        if uses_microfacets(features, self.material.kind) {
            // Here, not in each material, so that a kernel has the code once.
            let lost = Lost::of(self);
            self.prepared = of_microfacets!(features, self.material.kind, prepare(self, &lost));
        }
    }

    /// Samples a direction. Returns it, in world coordinates and in the shading frame, and whether
    /// [`BsdfSample::weigh`] must still weigh it.
    #[inline(always)]
    pub(super) fn propose_microfacets<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        random: Words,
    ) -> (BsdfSample, Vec3, bool) {
        let o = self.local_viewer;
        let smooth = self.alpha < MIN_ROUGH_ALPHA;
        let mut sample = BsdfSample {
            direction: self.normal,
            weight: Vec3::ZERO,
            pdf: 0.0,
            transmitted: false,
            absorbed: true,
        };
        let (mut i, mut is_pending) = (Vec3::Z, false);
        let mut h = Vec3::Z;
        if is_layered(features, self.material.kind) {
            h = sample_visible_normal_along(o, self.alpha_x, self.alpha_y, random.x, random.y);
        } else if !smooth {
            h = sample_visible_normal(o, self.alpha, random.x, random.y);
        }
        let cos = min(o.dot(h), 1.0);
        if cos > 0.0 {
            let facet = Facet { normal: h, cos, mirrored: reflect(o, h), smooth };
            let proposal = of_microfacets!(features, self.material.kind, scatter(self, &facet, random));
            i = proposal.direction;
            // A facet may send light to the wrong side of the surface; single scattering loses that
            // light.
            if (i.z < 0.0) == proposal.transmitted {
                sample.direction = self.local_to_world(i);
                sample.transmitted = proposal.transmitted;
                sample.absorbed = false;
                sample.weight = proposal.delta_weight;
                is_pending = !proposal.is_delta;
            }
        }
        (sample, i, is_pending)
    }

    /// Returns value and pdf of the microfacet materials for a direction of the shading frame.
    #[inline(always)]
    pub(super) fn evaluate_microfacets<const POSSIBLE: Features>(
        &self,
        features: FeatureSet<POSSIBLE>,
        i: Vec3,
    ) -> BsdfEval {
        let (o, kind) = (self.local_viewer, self.material.kind);
        if i.z == 0.0 || !of_microfacets!(features, kind, has_non_delta_lobe(self)) {
            return ZERO_EVAL;
        }
        let refracts = of_microfacets!(features, kind, refracts(self));
        let reflected = i.z > 0.0;
        let eta = if reflected || !refracts { 1.0 } else { self.eta() };
        // The facet that sends o to i: by reflection, by refraction, or through a thin wall, which
        // mirrors the light that it transmits.
        let mirrored = if refracts { i } else { Vec3::new(i.x, i.y, i.z.abs()) };
        let sum = if reflected || !refracts { o + mirrored } else { o * eta + i };
        let length2 = sum.dot(sum);
        let mut h = if length2 > 0.0 { sum * (1.0 / sqrt(length2)) } else { Vec3::Z };
        if h.z < 0.0 {
            h = -h;
        }
        let (cos_o, cos_i) = (o.dot(h), mirrored.dot(h));
        let (mut value, mut pdf) = (0.0, 0.0);
        let rough = self.alpha >= MIN_ROUGH_ALPHA;
        if rough && cos_o > 0.0 && (cos_i > 0.0) == (mirrored.z > 0.0) {
            // Solid angle of facet normals per solid angle of i, times cos_o.
            let spread = if reflected || !refracts {
                0.25
            } else {
                let s = cos_o * eta + cos_i;
                if s == 0.0 { 0.0 } else { cos_o * cos_i.abs() * (1.0 / (s * s)) }
            };
            let height = i.z.abs();
            let (facets, facing_o, facing_i) = if is_layered(features, kind) {
                let (x, y) = (self.alpha_x, self.alpha_y);
                (distribution_along(h, x, y), facing_area_along(o, x, y), facing_area_along(i, x, y))
            } else {
                let alpha = self.alpha;
                (distribution(h, alpha), facing_area(o.z, alpha), facing_area(height, alpha))
            };
            let common = facets * spread;
            pdf = common * (1.0 / facing_o);
            // Facets that both directions see: 1 of 1 + Λ(o) + Λ(i), over o.z.
            value = common * height * (1.0 / (facing_o * height + o.z * (facing_i - height)));
        }
        let lost = if is_layered(features, kind) && self.is_stretched() {
            stretched_lost_share(i, self.alpha_x, self.alpha_y)
        } else {
            lost_share(i.z.abs(), self.material.roughness)
        };
        let facets = FacetEval { value, pdf, cos: min(cos_o, 1.0), reflected, lost };
        of_microfacets!(features, kind, evaluate(self, i, &facets))
    }

    /// Returns whether facets are stretched more along the tangent than across it.
    #[inline(always)]
    pub(super) fn is_stretched(&self) -> bool {
        self.alpha_x > self.alpha_y
    }

    /// Returns the ratio of refractive indices, incident over refracted.
    #[inline(always)]
    pub(super) fn eta(&self) -> f32 {
        if self.front { 1.0 / self.material.ior } else { self.material.ior }
    }
}

impl FacetEval {
    /// Returns the cosine between viewer and facet, 0 to 1.
    #[inline(always)]
    pub fn clamped_cos(&self) -> f32 {
        max(self.cos, 0.0)
    }
}
