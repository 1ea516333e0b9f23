//! Materials: their record, and sampling of the materials of "Ray Tracing in One Weekend" (the
//! book).
//!
//! The host fills the records; [`crate::bsdf`] makes BSDFs of them.

use crate::features::{Features, SCHLICK, has};
use crate::fresnel;
use crate::math::{cbrt_unit, max_component, normalize, sqrt, unit_f32, unit_sphere};
use crate::rng::Words;
use crate::texture::NO_TEXTURE;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Kind of a diffuse material: a cosine lobe.
pub const LAMBERTIAN: u32 = 0;
/// Kind of the book's metal: a mirror whose direction is moved by a point of a ball.
pub const METAL: u32 = 1;
/// Kind of clear glass, which reflects or refracts.
pub const DIELECTRIC: u32 = 2;

/// Kind of a rough metal (GGX).
pub const CONDUCTOR: u32 = 3;
/// Kind of clear glass with a rough boundary (GGX).
pub const ROUGH_DIELECTRIC: u32 = 4;
/// Kind of glTF's material: a mix of a metal and a dielectric over a diffuse or clear base.
pub const METALLIC_ROUGHNESS: u32 = 5;

/// Bit of [`Material::flags`]: emits from its back, too.
pub const EMITS_BOTH_SIDES: u32 = 1;
/// Bit of [`Material::flags`]: a conductor by `eta` and `k` instead of a reflectance at normal
/// incidence.
pub const COMPLEX_IOR: u32 = 2;
/// Bit of [`Material::flags`]: has holes where its opacity is below `alpha_cutoff`.
pub const MASKED: u32 = 4;
/// Bit of [`Material::flags`]: transmits the part of the light that its opacity leaves.
pub const BLENDED: u32 = 8;

/// Material: a tag and flat fields, because rust-gpu has no enums with data. 112 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Reflected fraction by channel, 0 to 1; 1 for a dielectric; a conductor's reflectance at
    /// normal incidence.
    pub albedo: Vec3,
    /// Kind: [`LAMBERTIAN`] or another tag.
    pub kind: u32,
    /// Radius of a metal's ball, 0 to 1.
    pub fuzz: f32,
    /// Index of refraction of a dielectric inside, relative to outside.
    pub ior: f32,
    /// Roughness of a microfacet material, 0 to 1; GGX's alpha is its square.
    pub roughness: f32,
    /// Fraction of metal, 0 to 1.
    pub metallic: f32,
    /// Emitted radiance; zero if the material is not a light.
    pub emission: Vec3,
    /// pdf of the points of an emitter in next-event estimation, per square scene unit; 0 if it
    /// does not sample this material.
    pub light_pdf: f32,
    /// Real part of a conductor's index of refraction, by channel.
    pub eta: Vec3,
    /// Fraction of the light entering a dielectric that passes through its thin wall, 0 to 1.
    pub transmission: f32,
    /// Imaginary part of a conductor's index of refraction, by channel.
    pub k: Vec3,
    /// Bits: [`EMITS_BOTH_SIDES`], [`COMPLEX_IOR`], [`MASKED`], [`BLENDED`].
    pub flags: u32,
    /// Index of the texture that multiplies albedo and opacity, or [`NO_TEXTURE`].
    pub albedo_texture: u32,
    /// Index of the texture whose green multiplies roughness and blue metallic, or [`NO_TEXTURE`].
    pub metallic_roughness_texture: u32,
    /// Index of the texture that multiplies emission, or [`NO_TEXTURE`].
    pub emission_texture: u32,
    /// Index of the texture whose red multiplies transmission, or [`NO_TEXTURE`].
    pub transmission_texture: u32,
    /// Opacity, 0 to 1; used if masked or blended.
    pub opacity: f32,
    /// Opacity below which a masked material has a hole.
    pub alpha_cutoff: f32,
    /// Unused.
    pub pad: [u32; 2],
}

const _: () = assert!(size_of::<Material>() == 112 && align_of::<Material>() == 16);

impl Material {
    /// Creates a material of this kind: opaque, smooth, not emitting, without textures, with index
    /// of refraction 1.
    pub const fn new(kind: u32, albedo: Vec3) -> Self {
        Self {
            albedo,
            kind,
            fuzz: 0.0,
            ior: 1.0,
            roughness: 0.0,
            metallic: 0.0,
            emission: Vec3::ZERO,
            light_pdf: 0.0,
            eta: Vec3::ONE,
            transmission: 0.0,
            k: Vec3::ZERO,
            flags: 0,
            albedo_texture: NO_TEXTURE,
            metallic_roughness_texture: NO_TEXTURE,
            emission_texture: NO_TEXTURE,
            transmission_texture: NO_TEXTURE,
            opacity: 1.0,
            alpha_cutoff: 0.0,
            pad: [0; 2],
        }
    }

    /// Returns whether a surface of this material emits from its front (`front`) or its back.
    #[inline(always)]
    pub fn emits(&self, front: bool) -> bool {
        max_component(self.emission) > 0.0 && (front || self.flags & EMITS_BOTH_SIDES != 0)
    }
}

/// Direction in which the path continues.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// Unit vector, in world coordinates.
    pub direction: Vec3,
    /// True if the direction is on the other side of the surface than the path came from.
    pub transmitted: bool,
    /// True if the path ends here: a metal's fuzz pointed below the surface.
    pub absorbed: bool,
}

impl Material {
    /// Samples the lobe of one of the book's materials; its weight is the albedo in each direction.
    ///
    /// `incoming` is the unit direction of the arriving ray, `normal` the unit normal on its side,
    /// `front` true if that side is the outside, `schlick` true if a variant that can do both uses
    /// Schlick's approximation. The distributions are those of Shirley et al., "Ray Tracing in One
    /// Weekend": cosine for Lambertian (normal plus a point of the unit sphere), uniform in the
    /// ball for fuzz. Diffuse and metal share their code, so that the lanes of a warp stay
    /// together.
    #[inline(always)]
    pub fn scatter<const FEATURES: Features>(
        &self,
        incoming: Vec3,
        normal: Vec3,
        front: bool,
        schlick: bool,
        random: Words,
    ) -> Scatter {
        let cos = -incoming.dot(normal);
        let reflected = incoming + normal * (2.0 * cos);
        let mut base = reflected;
        let mut scale = 0.0;
        let mut transmitted = false;
        if self.kind == DIELECTRIC {
            let eta = if front { 1.0 / self.ior } else { self.ior };
            let along = eta * cos;
            let radicand = fresnel::refracted_cos2(cos, eta);
            // Total reflection if not above zero.
            if radicand > 0.0 {
                let cos_refracted = sqrt(radicand);
                let reflectance = if const { has(FEATURES, SCHLICK) } && schlick {
                    fresnel::schlick(cos, eta)
                } else {
                    fresnel::dielectric(cos, cos_refracted, eta)
                };
                if unit_f32(random.z) >= reflectance {
                    base = incoming * eta + normal * (along - cos_refracted);
                    transmitted = true;
                }
            }
        } else if self.kind == METAL {
            scale = self.fuzz * cbrt_unit(unit_f32(random.z));
        } else {
            base = normal;
            scale = 1.0;
        }
        let moved = base + unit_sphere(random.x, random.y) * scale;
        // A diffuse point opposite the normal leaves no direction; the book also uses the normal
        // then.
        let direction = if moved.dot(moved) > 1e-12 { normalize(moved) } else { normal };
        let absorbed = self.kind == METAL && direction.dot(normal) <= 0.0;
        Scatter { direction, transmitted, absorbed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::PathKey;

    fn material(kind: u32, fuzz: f32, ior: f32) -> Material {
        Material { fuzz, ior, ..Material::new(kind, Vec3::ONE) }
    }

    fn words(i: u32) -> Words {
        PathKey { seed: 5, pixel: i, sample: 0 }.words(1)
    }

    /// Glass of index 1 is invisible with exact Fresnel; Schlick's approximation reflects some
    /// light.
    #[test]
    fn matched_index_is_invisible() {
        let glass = material(DIELECTRIC, 0.0, 1.0);
        let mut reflected_by_schlick = 0;
        for i in 0..10_000 {
            let w = words(i);
            let incoming = unit_sphere(w.x, w.w);
            if incoming.y > -1e-3 {
                continue;
            }
            let exact = glass.scatter::<0>(incoming, Vec3::Y, true, true, w);
            assert!(exact.transmitted && (exact.direction - incoming).length() < 1e-6);
            reflected_by_schlick +=
                u32::from(!glass.scatter::<SCHLICK>(incoming, Vec3::Y, true, true, w).transmitted);
        }
        assert!(reflected_by_schlick > 0);
    }

    #[test]
    fn directions_are_unit_and_on_their_side() {
        for kind in [LAMBERTIAN, METAL, DIELECTRIC] {
            let m = material(kind, 1.0, 1.5);
            for i in 0..20_000 {
                let w = words(i);
                let incoming = unit_sphere(w.w, w.y);
                if incoming.y >= 0.0 {
                    continue;
                }
                let s = m.scatter::<0>(incoming, Vec3::Y, i % 2 == 0, true, w);
                assert!((s.direction.dot(s.direction) - 1.0).abs() < 1e-6);
                if !s.absorbed {
                    let side = s.direction.y * if s.transmitted { -1.0 } else { 1.0 };
                    assert!(side > -1e-6, "{kind} {i}: {}", s.direction);
                }
            }
        }
    }

    /// For a cosine lobe the mean of the cosine is 2/3, and of its square 1/2; 5 sigma.
    #[test]
    fn lambertian_is_a_cosine_lobe() {
        let m = material(LAMBERTIAN, 0.0, 1.0);
        let n = 200_000;
        let (mut first, mut second) = (0.0, 0.0);
        for i in 0..n {
            let cos = f64::from(m.scatter::<0>(Vec3::NEG_Y, Vec3::Y, true, true, words(i)).direction.y);
            first += cos;
            second += cos * cos;
        }
        let n = f64::from(n);
        assert!((first / n - 2.0 / 3.0).abs() < 5.0 * (1.0f64 / 18.0 / n).sqrt());
        assert!((second / n - 0.5).abs() < 5.0 * (1.0f64 / 12.0 / n).sqrt());
    }

    /// The fuzz before normalisation is uniform in the ball: the cube of the radius is uniform.
    #[test]
    fn fuzz_radius_fills_the_ball() {
        let n = 200_000;
        let mean: f64 =
            (0..n).map(|i| f64::from(cbrt_unit(unit_f32(words(i).z)))).sum::<f64>() / f64::from(n);
        assert!((mean - 0.75).abs() < 5.0 * (3.0f64 / 80.0 / f64::from(n)).sqrt(), "{mean}");
    }

    /// Torture test 33: the diffuse point straight below the surface.
    #[test]
    fn no_zero_direction() {
        let m = material(LAMBERTIAN, 0.0, 1.0);
        // The height word at its ends makes the sphere's point +z or nearly -z.
        for normal in [Vec3::NEG_Z, Vec3::Z] {
            for x in [0, u32::MAX] {
                let s = m.scatter::<0>(-normal, normal, true, true, Words { x, y: 0, z: 0, w: 0 });
                assert!((s.direction.dot(s.direction) - 1.0).abs() < 1e-5, "{normal} {x}: {}", s.direction);
            }
        }
    }
}
