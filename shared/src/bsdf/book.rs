//! Materials of "Ray Tracing in One Weekend" (Shirley et al.; the book): the sampled direction is a
//! base direction plus a point of a ball, and its weight is the albedo in each direction.

use super::Bsdf;
use crate::features::{FeatureSet, Features};
use crate::material::Material;
use crate::math::{normalize, unit_sphere};
use crate::rng::Words;
use glam::Vec3;

/// A material of the book.
pub(super) trait BookLobe {
    /// Samples the base direction; `random.z` is its random word.
    fn scatter<const POSSIBLE: Features>(
        features: FeatureSet<POSSIBLE>,
        material: &Material,
        at: &Incidence,
        random: Words,
    ) -> Scattered;

    /// Returns the pdf of `direction`, which has the cosine `cos` above 0 with the normal, per
    /// steradian; 0 for a delta lobe.
    fn pdf(bsdf: &Bsdf, direction: Vec3, cos: f32) -> f32;

    /// Returns what [`Bsdf::diffuseness`] does.
    fn diffuseness(material: &Material) -> f32;

    /// Returns what [`Bsdf::has_non_delta_lobe`] does.
    fn has_non_delta_lobe(material: &Material) -> bool;

    /// True if a direction below the surface ends the path.
    const ABSORBS_BELOW: bool = false;
}

/// Arrival of a ray at a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incidence {
    /// Unit direction of the ray.
    pub incoming: Vec3,
    /// Unit normal on the ray's side.
    pub normal: Vec3,
    /// Cosine of the angle between the two, at least 0.
    pub cos: f32,
    /// Mirrored direction.
    pub reflected: Vec3,
    /// True if the ray comes from outside.
    pub front: bool,
}

/// Base direction, and radius of the ball of its offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattered {
    /// Direction before the offset.
    pub base: Vec3,
    /// Distance of the offset from `base`.
    pub radius: f32,
    /// True if the direction is on the other side of the surface than the path came from.
    pub transmitted: bool,
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

/// Samples the lobe of one of the book's materials.
///
/// `incoming` is the unit direction of the arriving ray, `normal` the unit normal on its side,
/// `front` true if that side is the outside. The offset is computed for all kinds at once, so that
/// the lanes of a warp stay together.
#[inline(always)]
pub fn scatter<const POSSIBLE: Features>(
    features: FeatureSet<POSSIBLE>,
    material: &Material,
    incoming: Vec3,
    normal: Vec3,
    front: bool,
    random: Words,
) -> Scatter {
    let cos = -incoming.dot(normal);
    let at = Incidence { incoming, normal, cos, reflected: incoming + normal * (2.0 * cos), front };
    let Scattered { base, radius, transmitted } =
        super::of_book!(features, material.kind, scatter(features, material, &at, random));
    let moved = base + unit_sphere(random.x, random.y) * radius;
    // A diffuse point opposite the normal leaves no direction; the book also uses the normal then.
    let direction = if moved.dot(moved) > 1e-12 { normalize(moved) } else { normal };
    let absorbed = super::of_book!(features, material.kind, ABSORBS_BELOW) && direction.dot(normal) <= 0.0;
    Scatter { direction, transmitted, absorbed }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{DIELECTRIC, LAMBERTIAN, METAL};
    use crate::features::{BOOK, SCHLICK};
    use crate::math::{cbrt_unit, unit_f32};
    use crate::rng::PathKey;

    fn material(kind: u32, fuzz: f32, ior: f32) -> Material {
        Material { fuzz, ior, ..Material::new(kind, Vec3::ONE) }
    }

    const EXACT: FeatureSet<BOOK> = FeatureSet::ALL;

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
            let exact = scatter(EXACT, &glass, incoming, Vec3::Y, true, w);
            assert!(exact.transmitted && (exact.direction - incoming).length() < 1e-6);
            let schlick = FeatureSet::<{ BOOK | SCHLICK }>::ALL;
            reflected_by_schlick +=
                u32::from(!scatter(schlick, &glass, incoming, Vec3::Y, true, w).transmitted);
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
                let s = scatter(EXACT, &m, incoming, Vec3::Y, i % 2 == 0, w);
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
            let cos = f64::from(scatter(EXACT, &m, Vec3::NEG_Y, Vec3::Y, true, words(i)).direction.y);
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
                let s = scatter(EXACT, &m, -normal, normal, true, Words { x, y: 0, z: 0, w: 0 });
                assert!((s.direction.dot(s.direction) - 1.0).abs() < 1e-5, "{normal} {x}: {}", s.direction);
            }
        }
    }
}
