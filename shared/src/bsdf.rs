//! BSDFs: a material with its textures read, in the frame of the shading normal. [`crate::path`]
//! evaluates and samples them.
//!
//! Radiance is transported without the factor eta² between media, as in "Ray Tracing in One
//! Weekend" (the book): it cancels between a camera and lights outside of glass.

use crate::features::{Features, MICROFACETS, TEXTURES, has};
use crate::fresnel;
use crate::material::{
    BLENDED, COMPLEX_IOR, CONDUCTOR, DIELECTRIC, LAMBERTIAN, MASKED, METAL, METALLIC_ROUGHNESS, Material,
};
use crate::math::{basis, max, max_component, min, normalize, sqrt, unit_circle, unit_f32};
use crate::microfacet::{
    MIN_ROUGH_ALPHA, distribution, grazing_share, lambda, mean_grazing_share, sample_visible_normal,
};
use crate::rng::Words;
use crate::scene::Scene;
use crate::texture::{NO_TEXTURE, color, sample};
use core::f32::consts::PI;
use glam::Vec3;

/// Returns the opacity of `material` at texture coordinates (`u`, `v`), 0 to 1: the part of the
/// light that does not pass straight through.
///
/// # Safety
///
/// The scene's textures were proven as [`crate::buffer`] says.
#[inline(always)]
#[allow(unsafe_code, reason = "see buffer")]
pub unsafe fn opacity(scene: Scene, material: &Material, u: f32, v: f32) -> f32 {
    if material.flags & (MASKED | BLENDED) == 0 {
        return 1.0;
    }
    let mut opacity = material.opacity;
    if material.albedo_texture != NO_TEXTURE {
        // SAFETY: the caller's promise.
        opacity *= unsafe { sample(scene, material.albedo_texture, u, v) }.w;
    }
    if material.flags & MASKED == 0 {
        opacity
    } else if opacity >= material.alpha_cutoff {
        1.0
    } else {
        0.0
    }
}

/// Direction in which the path continues.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit vector, in world coordinates.
    pub direction: Vec3,
    /// Value times |cosine| over pdf: factor on the throughput.
    pub weight: Vec3,
    /// pdf of the direction, per steradian; 0 for a delta lobe, which light sampling cannot find.
    pub pdf: f32,
    /// True if the direction is on the other side of the surface than the viewer.
    pub transmitted: bool,
    /// True if the path ends here.
    pub absorbed: bool,
}

/// Value of a BSDF for one direction, and pdf of sampling that direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfEval {
    /// Value times |cosine| by channel; zero where the surface does not scatter.
    pub value: Vec3,
    /// pdf of sampling this direction, per steradian.
    pub pdf: f32,
}

const ZERO_EVAL: BsdfEval = BsdfEval { value: Vec3::ZERO, pdf: 0.0 };

/// BSDF of a material at a point, seen from a given direction.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    material: Material,
    /// Unit shading normal on the viewer's side.
    normal: Vec3,
    /// Axes of the shading frame beside the normal.
    x: Vec3,
    y: Vec3,
    /// Unit vector to the viewer, in world coordinates.
    viewer: Vec3,
    /// Unit vector to the viewer, in the shading frame.
    local_viewer: Vec3,
    /// Roughness parameter of GGX: the square of the roughness.
    alpha: f32,
    /// True if the viewer is outside.
    front: bool,
}

#[inline(always)]
fn reflect(v: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * v.dot(h)) - v
}

/// Probability of sampling each lobe of a metallic-roughness material.
#[derive(Clone, Copy, Debug)]
struct LobeProbabilities {
    specular: f32,
    diffuse: f32,
    transmission: f32,
}

impl Bsdf {
    /// Creates the BSDF of `material` with its textures read at (`u`, `v`), seen along the unit
    /// vector `incoming`. `normal` is the unit shading normal on the viewer's side; `front` is true
    /// if that is the outside.
    ///
    /// # Safety
    ///
    /// The scene's textures were proven as [`crate::buffer`] says.
    #[inline(always)]
    #[allow(unsafe_code, reason = "see buffer")]
    pub unsafe fn new<const FEATURES: Features>(
        scene: Scene,
        mut material: Material,
        incoming: Vec3,
        normal: Vec3,
        front: bool,
        (u, v): (f32, f32),
    ) -> Self {
        if const { has(FEATURES, TEXTURES) } {
            // SAFETY: the caller's promise.
            unsafe {
                material.albedo *= color(scene, material.albedo_texture, u, v);
                if const { has(FEATURES, MICROFACETS) } && material.kind == METALLIC_ROUGHNESS {
                    let c = color(scene, material.metallic_roughness_texture, u, v);
                    material.roughness *= c.y;
                    material.metallic *= c.z;
                    material.transmission *= color(scene, material.transmission_texture, u, v).x;
                }
            }
        }
        let (mut x, mut y, mut local) = (Vec3::X, Vec3::Y, Vec3::Z);
        if const { has(FEATURES, MICROFACETS) } {
            (x, y) = basis(normal);
            local = -Vec3::new(incoming.dot(x), incoming.dot(y), incoming.dot(normal));
            local.z = max(local.z, 1e-6);
        }
        let alpha = material.roughness * material.roughness;
        Self { material, normal, x, y, viewer: -incoming, local_viewer: local, alpha, front }
    }

    /// Returns the colour of the surface, by which a denoiser divides: that of a diffuse surface,
    /// of the book's metal or of a texture; a conductor's reflectance at normal incidence; 1 for
    /// glass.
    #[inline(always)]
    pub fn albedo<const FEATURES: Features>(&self) -> Vec3 {
        let m = &self.material;
        if const { has(FEATURES, MICROFACETS) } && m.kind == CONDUCTOR && m.flags & COMPLEX_IOR != 0 {
            return fresnel::conductor(1.0, m.eta, m.k);
        }
        m.albedo
    }

    /// Returns the diffuseness: how little the reflected light depends on the viewer's position, 0
    /// to 1. It is the fraction that a diffuse base scatters, and of the rest a part that grows
    /// with the width of the lobe.
    #[inline(always)]
    pub fn diffuseness<const FEATURES: Features>(&self) -> f32 {
        let m = &self.material;
        if const { has(FEATURES, MICROFACETS) } && m.kind > DIELECTRIC {
            let base = (1.0 - m.metallic) * (1.0 - m.transmission);
            let base = if m.kind == METALLIC_ROUGHNESS { base } else { 0.0 };
            return base + (1.0 - base) * (self.alpha * self.alpha);
        }
        if m.kind == METAL {
            m.fuzz * m.fuzz
        } else if m.kind == LAMBERTIAN {
            1.0
        } else {
            0.0
        }
    }

    /// Returns whether a lobe is not a delta, so that light sampling can find some directions that
    /// [`Bsdf::sample`] returns.
    #[inline(always)]
    pub fn has_non_delta_lobe<const FEATURES: Features>(&self) -> bool {
        let kind = self.material.kind;
        if const { has(FEATURES, MICROFACETS) } {
            if kind == METALLIC_ROUGHNESS {
                return self.alpha >= MIN_ROUGH_ALPHA
                    || (self.material.metallic < 1.0 && self.material.transmission < 1.0);
            }
            if kind != LAMBERTIAN && kind != METAL && kind != DIELECTRIC {
                return self.alpha >= MIN_ROUGH_ALPHA;
            }
        }
        kind == LAMBERTIAN || (kind == METAL && self.material.fuzz > 0.0)
    }

    #[inline(always)]
    fn local_to_world(&self, v: Vec3) -> Vec3 {
        normalize(self.x * v.x + self.y * v.y + self.normal * v.z)
    }

    /// Samples a direction: `random.x` and `random.y` choose it within a lobe, `random.z` chooses
    /// the lobe or, for the book's metal, the distance from the ball's centre. `schlick` chooses
    /// Schlick's approximation in kernels that can do both.
    #[inline(always)]
    pub fn sample<const FEATURES: Features>(&self, schlick: bool, random: Words) -> BsdfSample {
        let kind = self.material.kind;
        if const { has(FEATURES, MICROFACETS) } && kind > DIELECTRIC {
            return self.sample_microfacets(random);
        }
        let scatter =
            self.material.scatter::<FEATURES>(-self.viewer, self.normal, self.front, schlick, random);
        BsdfSample {
            direction: scatter.direction,
            weight: self.material.albedo,
            pdf: self.evaluate_simple(scatter.direction).pdf,
            transmitted: scatter.transmitted,
            absorbed: scatter.absorbed,
        }
    }

    /// Returns the cosine between `direction` and the shading normal.
    #[inline(always)]
    pub fn cosine(&self, direction: Vec3) -> f32 {
        direction.dot(self.normal)
    }

    /// Returns value and pdf for the unit vector `direction`.
    #[inline(always)]
    pub fn evaluate<const FEATURES: Features>(&self, direction: Vec3) -> BsdfEval {
        let kind = self.material.kind;
        if const { has(FEATURES, MICROFACETS) } && kind > DIELECTRIC {
            let to = Vec3::new(direction.dot(self.x), direction.dot(self.y), direction.dot(self.normal));
            return self.evaluate_microfacets(to);
        }
        self.evaluate_simple(direction)
    }

    /// Returns value and pdf of the book's materials.
    #[inline(always)]
    fn evaluate_simple(&self, direction: Vec3) -> BsdfEval {
        let cos = direction.dot(self.normal);
        if cos <= 0.0 || self.material.kind == DIELECTRIC {
            return ZERO_EVAL;
        }
        let pdf = if self.material.kind == METAL { self.fuzz_pdf(direction) } else { cos / PI };
        BsdfEval { value: self.material.albedo * pdf, pdf }
    }

    /// Returns the pdf of the mirrored direction plus a uniform point of a ball, normalised. At
    /// distance s along the direction, the volume per steradian is s² ds: the pdf is its integral
    /// from the ball's near to its far face, over the ball's volume.
    #[inline(always)]
    fn fuzz_pdf(&self, direction: Vec3) -> f32 {
        let mirrored = reflect(self.viewer, self.normal);
        let fuzz = self.material.fuzz;
        let along = direction.dot(mirrored);
        let aside = direction - mirrored * along;
        let half_chord2 = fuzz * fuzz - aside.dot(aside);
        if half_chord2 <= 0.0 || along <= 0.0 {
            return 0.0;
        }
        let s = 4.0 * along * along - (1.0 - fuzz * fuzz);
        2.0 * sqrt(half_chord2) * s / (4.0 * PI * fuzz * fuzz * fuzz)
    }

    #[inline(always)]
    fn sample_microfacets(&self, random: Words) -> BsdfSample {
        let o = self.local_viewer;
        let smooth = self.alpha < MIN_ROUGH_ALPHA;
        let choice = unit_f32(random.z);
        let kind = self.material.kind;
        let absorbed = BsdfSample {
            direction: self.normal,
            weight: Vec3::ZERO,
            pdf: 0.0,
            transmitted: false,
            absorbed: true,
        };
        let probabilities = self.lobe_probabilities();
        let h = if smooth { Vec3::Z } else { sample_visible_normal(o, self.alpha, random.x, random.y) };
        let cos = min(o.dot(h), 1.0);
        if cos <= 0.0 {
            return absorbed;
        }
        let mut i = reflect(o, h);
        let mut transmitted = false;
        if kind == METALLIC_ROUGHNESS {
            if choice >= probabilities.specular {
                if choice < probabilities.specular + probabilities.diffuse {
                    let radius = sqrt(unit_f32(random.x));
                    let (c, s) = unit_circle(random.y);
                    i = Vec3::new(radius * c, radius * s, sqrt(1.0 - unit_f32(random.x)));
                } else {
                    i.z = -i.z; // a thin wall: light that enters leaves mirrored
                    transmitted = true;
                }
            }
        } else if kind != CONDUCTOR {
            let eta = self.eta();
            let cos2 = fresnel::refracted_cos2(cos, eta);
            if cos2 > 0.0 {
                let refracted = sqrt(cos2);
                if choice >= fresnel::dielectric(cos, refracted, eta) {
                    i = h * (eta * cos - refracted) - o * eta;
                    transmitted = true;
                }
            }
        }
        // A facet may send light to the wrong side of the surface; single scattering loses that
        // light.
        if (i.z < 0.0) != transmitted {
            return absorbed;
        }
        let direction = self.local_to_world(i);
        if smooth {
            // The mirror's weight over its probability; the diffuse lobe is weighted as on a rough
            // surface.
            if kind == CONDUCTOR {
                let weight = self.reflectance(cos);
                return BsdfSample { direction, weight, pdf: 0.0, transmitted, absorbed: false };
            }
            let mirror = choice < probabilities.specular;
            if mirror || transmitted {
                let f = self.reflectance(cos);
                let weight = if mirror {
                    f * (1.0 / probabilities.specular)
                } else {
                    self.thin_wall_transmittance(f) * (1.0 / probabilities.transmission)
                };
                return BsdfSample { direction, weight, pdf: 0.0, transmitted, absorbed: false };
            }
        }
        let BsdfEval { value, pdf } = self.evaluate_microfacets(i);
        // Written so that a pdf of NaN also ends the path.
        if pdf > 0.0 {
            BsdfSample { direction, weight: value * (1.0 / pdf), pdf, transmitted, absorbed: false }
        } else {
            absorbed
        }
    }

    /// Returns the ratio of refractive indices, incident over refracted.
    #[inline(always)]
    fn eta(&self) -> f32 {
        if self.front { 1.0 / self.material.ior } else { self.material.ior }
    }

    /// Returns a dielectric's reflectance at normal incidence.
    #[inline(always)]
    fn dielectric_f0(&self) -> f32 {
        let r = (self.material.ior - 1.0) / (self.material.ior + 1.0);
        r * r
    }

    /// Returns the reflectance of a conductor or metallic-roughness material at incident cosine
    /// `cos`.
    #[inline(always)]
    fn reflectance(&self, cos: f32) -> Vec3 {
        let m = &self.material;
        if m.kind == CONDUCTOR && m.flags & COMPLEX_IOR != 0 {
            return fresnel::conductor(cos, m.eta, m.k);
        }
        let f0 = if m.kind == CONDUCTOR {
            m.albedo
        } else {
            Vec3::splat(self.dielectric_f0()) * (1.0 - m.metallic) + m.albedo * m.metallic
        };
        fresnel::schlick_from(f0, cos)
    }

    /// Returns the transmittance of a thin wall by channel: colour and fraction of the light that
    /// the dielectric's boundary with reflectance `f` does not reflect.
    #[inline(always)]
    fn thin_wall_transmittance(&self, f: Vec3) -> Vec3 {
        let m = &self.material;
        m.albedo * (Vec3::ONE - f) * ((1.0 - m.metallic) * m.transmission)
    }

    #[inline(always)]
    fn lobe_probabilities(&self) -> LobeProbabilities {
        let m = &self.material;
        let f = max_component(self.reflectance(self.local_viewer.z));
        let rest = (1.0 - m.metallic) * (1.0 - f) * max_component(m.albedo);
        let (diffuse, clear) = (rest * (1.0 - m.transmission), rest * m.transmission);
        let sum = f + diffuse + clear;
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        LobeProbabilities { specular: f * scale, diffuse: diffuse * scale, transmission: clear * scale }
    }

    /// Returns value and pdf of the microfacet materials for a direction of the shading frame.
    #[inline(always)]
    fn evaluate_microfacets(&self, i: Vec3) -> BsdfEval {
        let (o, m) = (self.local_viewer, &self.material);
        let rough = self.alpha >= MIN_ROUGH_ALPHA;
        if i.z == 0.0 || !(rough || m.kind == METALLIC_ROUGHNESS) {
            return ZERO_EVAL;
        }
        let is_glass = m.kind != METALLIC_ROUGHNESS && m.kind != CONDUCTOR;
        let reflected = i.z > 0.0;
        let eta = if reflected || !is_glass { 1.0 } else { self.eta() };
        // The facet that sends o to i: by reflection, by refraction, or through a thin wall, which
        // mirrors the light that it transmits.
        let mirrored = if is_glass { i } else { Vec3::new(i.x, i.y, i.z.abs()) };
        let sum = if reflected || !is_glass { o + mirrored } else { o * eta + i };
        let length2 = sum.dot(sum);
        let mut h = if length2 > 0.0 { sum * (1.0 / sqrt(length2)) } else { Vec3::Z };
        if h.z < 0.0 {
            h = -h;
        }
        let (cos_o, cos_i) = (o.dot(h), mirrored.dot(h));
        let mut specular = 0.0; // value without reflectance
        let mut specular_pdf = 0.0; // of directions by the facet lobe
        if rough && cos_o > 0.0 && (cos_i > 0.0) == (mirrored.z > 0.0) {
            let (lambda_o, lambda_i) = (lambda(o.z, self.alpha), lambda(i.z.abs(), self.alpha));
            let d = distribution(h, self.alpha);
            // Solid angle of facet normals per solid angle of i.
            let spread = if reflected || !is_glass {
                1.0 / (4.0 * cos_o)
            } else {
                let s = cos_o * eta + cos_i;
                if s == 0.0 { 0.0 } else { cos_i.abs() / (s * s) }
            };
            let common = d * cos_o * spread / o.z;
            specular = common / (1.0 + lambda_o + lambda_i);
            specular_pdf = common / (1.0 + lambda_o);
        }
        if is_glass {
            let cos2 = fresnel::refracted_cos2(min(cos_o, 1.0), self.eta());
            let f =
                if cos2 > 0.0 { fresnel::dielectric(min(cos_o, 1.0), sqrt(cos2), self.eta()) } else { 1.0 };
            let share = if reflected { f } else { 1.0 - f };
            return BsdfEval { value: m.albedo * (specular * share), pdf: specular_pdf * share };
        }
        let f = self.reflectance(max(min(cos_o, 1.0), 0.0));
        if m.kind == CONDUCTOR {
            if !reflected {
                return ZERO_EVAL;
            }
            return BsdfEval { value: f * specular, pdf: specular_pdf };
        }
        let probabilities = self.lobe_probabilities();
        if !reflected {
            return BsdfEval {
                value: self.thin_wall_transmittance(f) * specular,
                pdf: specular_pdf * probabilities.transmission,
            };
        }
        // The diffuse base under the boundary: light that the boundary lets in and out again,
        // normalised so that a white base returns all that enters (the form of Ashikhmin and
        // Shirley, 2000, with this boundary's reflectance). It is reciprocal, and with the
        // boundary's part not above 1.
        let rest = 1.0 - self.dielectric_f0();
        let enter = 1.0 - grazing_share(o.z, m.roughness);
        let leave = 1.0 - grazing_share(i.z, m.roughness);
        let base = rest * enter * leave / (1.0 - mean_grazing_share(m.roughness));
        let diffuse = m.albedo * ((1.0 - m.metallic) * (1.0 - m.transmission) * base * i.z / PI);
        BsdfEval {
            value: f * specular + diffuse,
            pdf: specular_pdf * probabilities.specular + probabilities.diffuse * i.z / PI,
        }
    }
}
