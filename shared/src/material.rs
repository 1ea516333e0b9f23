//! Materials: how a path goes on from a surface.

use crate::features::{Features, SCHLICK, has};
use crate::math::{cbrt_unit, normalize, sqrt, unit_f32, unit_sphere};
use crate::rng::Words;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Diffuse: a cosine lobe.
pub const LAMBERTIAN: u32 = 0;
/// A mirror whose direction is moved by a point of a ball.
pub const METAL: u32 = 1;
/// Clear glass: reflects or refracts.
pub const DIELECTRIC: u32 = 2;

/// A material: a tag and flat fields, as rust-gpu has no enums with data. 32 bytes.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Reflected share by channel, 0 to 1; 1 for a dielectric.
    pub albedo: Vec3,
    /// [`LAMBERTIAN`], [`METAL`] or [`DIELECTRIC`].
    pub kind: u32,
    /// Of a metal: radius of the ball, 0 to 1.
    pub fuzz: f32,
    /// Of a dielectric: index of refraction inside, relative to outside.
    pub ior: f32,
    /// Unused.
    pub pad: [u32; 2],
}

const _: () = assert!(size_of::<Material>() == 32 && align_of::<Material>() == 16);

/// How the path goes on.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// Unit vector.
    pub direction: Vec3,
    /// On the other side of the surface than the path came from.
    pub transmitted: bool,
    /// The path ends here: a metal's fuzz pointed below the surface.
    pub absorbed: bool,
}

impl Material {
    /// Samples the material's lobe; its weight is the albedo for each direction.
    ///
    /// `incoming` is the unit direction of the ray that arrives, `normal` the unit normal on its side, `front` whether that
    /// side is the outside. The distributions are those of Shirley et al., "Ray Tracing in One Weekend": cosine for
    /// Lambertian (normal plus a point of the unit sphere), uniform in the ball for fuzz. Diffuse and metal share
    /// their code, so that the lanes of a warp stay together.
    #[inline(always)]
    pub fn scatter<const FEATURES: Features>(
        &self,
        incoming: Vec3,
        normal: Vec3,
        front: bool,
        random: Words,
    ) -> Scatter {
        let cos = -incoming.dot(normal);
        let reflected = incoming + normal * (2.0 * cos);
        let mut base = reflected;
        let mut scale = 0.0;
        let mut transmitted = false;
        if self.kind == DIELECTRIC {
            let eta = if front { 1.0 / self.ior } else { self.ior };
            // Snell: 1 - eta² sin², without its cancellation at grazing angles for an index near 1.
            let along = eta * cos;
            let radicand = (1.0 - eta) * (1.0 + eta) + along * along;
            // Not above zero: total reflection.
            if radicand > 0.0 {
                let cos_refracted = sqrt(radicand);
                let reflectance =
                    if has(FEATURES, SCHLICK) { schlick(cos, eta) } else { fresnel(cos, cos_refracted, eta) };
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
        // A diffuse point opposite the normal leaves no direction; the book takes the normal, too.
        let direction = if moved.dot(moved) > 1e-12 { normalize(moved) } else { normal };
        let absorbed = self.kind == METAL && direction.dot(normal) <= 0.0;
        Scatter { direction, transmitted, absorbed }
    }
}

/// Unpolarised Fresnel reflectance of a dielectric boundary, 0 to 1 within rounding.
///
/// `cos` of the incident and `cos_refracted` of the refracted direction with the normal, `eta` the ratio of the indices,
/// incident over refracted (Pharr et al., "Physically Based Rendering", 4th ed., section 9.3.5).
#[inline(always)]
pub fn fresnel(cos: f32, cos_refracted: f32, eta: f32) -> f32 {
    let parallel = (cos - eta * cos_refracted) / (cos + eta * cos_refracted);
    let perpendicular = (eta * cos - cos_refracted) / (eta * cos + cos_refracted);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Schlick's approximation as the book has it: with the incident cosine on both sides. On the way out that is wrong by up to 0.95
/// just below total reflection at index 1.5; a scene asks for it by name to match the book.
#[inline(always)]
pub fn schlick(cos: f32, eta: f32) -> f32 {
    let r0 = (1.0 - eta) / (1.0 + eta);
    let r0 = r0 * r0;
    let m = 1.0 - cos;
    let m2 = m * m;
    r0 + (1.0 - r0) * (m2 * m2 * m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::PathKey;

    fn material(kind: u32, fuzz: f32, ior: f32) -> Material {
        Material { albedo: Vec3::ONE, kind, fuzz, ior, pad: [0; 2] }
    }

    fn words(i: u32) -> Words {
        PathKey { seed: 5, pixel: i, sample: 0 }.words(1)
    }

    /// Torture test 15: against the textbook's formula in f64, by angles.
    #[test]
    fn fresnel_against_f64() {
        for ior in [1.0f64, 1.0001, 1.5, 4.0, 100.0, 1.0 / 1.5, 0.25] {
            for i in 1..1000 {
                let cos = f64::from(i) / 1000.0;
                let eta = 1.0 / ior;
                let sin2 = eta * eta * (1.0 - cos * cos);
                if sin2 > 0.9999 {
                    continue; // the critical angle has tests of its own
                }
                let cos_t = (1.0 - sin2).sqrt();
                let rs = (cos - ior * cos_t) / (cos + ior * cos_t);
                let rp = (ior * cos - cos_t) / (ior * cos + cos_t);
                let want = 0.5 * (rs * rs + rp * rp);
                let got = f64::from(fresnel(cos as f32, cos_t as f32, eta as f32));
                assert!(
                    (got - want).abs() < 2e-6 && (0.0..=1.000_001).contains(&got),
                    "{ior} {cos}: {got} {want}"
                );
            }
        }
    }

    #[test]
    fn schlick_at_both_ends() {
        assert!((schlick(1.0, 1.0 / 1.5) - 0.04).abs() < 1e-7);
        assert!((schlick(0.0, 1.5) - 1.0).abs() < 1e-7);
    }

    /// An index of 1 does nothing to a path with exact Fresnel; Schlick reflects some of it.
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
            let exact = glass.scatter::<0>(incoming, Vec3::Y, true, w);
            assert!(exact.transmitted && (exact.direction - incoming).length() < 1e-6);
            reflected_by_schlick +=
                u32::from(!glass.scatter::<SCHLICK>(incoming, Vec3::Y, true, w).transmitted);
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
                let s = m.scatter::<0>(incoming, Vec3::Y, i % 2 == 0, w);
                assert!((s.direction.dot(s.direction) - 1.0).abs() < 1e-6);
                if !s.absorbed {
                    let side = s.direction.y * if s.transmitted { -1.0 } else { 1.0 };
                    assert!(side > -1e-6, "{kind} {i}: {}", s.direction);
                }
            }
        }
    }

    /// Mean of the cosine is 2/3 and of its square 1/2 for a cosine lobe; 5 sigma.
    #[test]
    fn lambertian_is_a_cosine_lobe() {
        let m = material(LAMBERTIAN, 0.0, 1.0);
        let n = 200_000;
        let (mut first, mut second) = (0.0, 0.0);
        for i in 0..n {
            let cos = f64::from(m.scatter::<0>(Vec3::NEG_Y, Vec3::Y, true, words(i)).direction.y);
            first += cos;
            second += cos * cos;
        }
        let n = f64::from(n);
        assert!((first / n - 2.0 / 3.0).abs() < 5.0 * (1.0f64 / 18.0 / n).sqrt());
        assert!((second / n - 0.5).abs() < 5.0 * (1.0f64 / 12.0 / n).sqrt());
    }

    /// The fuzz before normalisation is uniform in the ball: the radius' cube is uniform.
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
        // Height word at its ends makes the sphere's point +z or nearly -z.
        for normal in [Vec3::NEG_Z, Vec3::Z] {
            for x in [0, u32::MAX] {
                let s = m.scatter::<0>(-normal, normal, true, Words { x, y: 0, z: 0, w: 0 });
                assert!((s.direction.dot(s.direction) - 1.0).abs() < 1e-5, "{normal} {x}: {}", s.direction);
            }
        }
    }
}
