//! Fresnel reflectance and its approximations, for [`crate::material`] and [`crate::bsdf`].

use crate::math::{max, sqrt};
use glam::Vec3;

/// Returns the unpolarised Fresnel reflectance of a dielectric boundary, 0 to 1 within rounding.
/// The caller excludes total reflection: see [`refracted_cos2`].
///
/// `cos` and `cos_refracted` are the cosines of the incident and the refracted direction with the
/// normal, `eta` is the ratio of the indices, incident over refracted (Pharr et al., "Physically
/// Based Rendering", 4th ed., section 9.3.5).
#[inline(always)]
pub fn dielectric(cos: f32, cos_refracted: f32, eta: f32) -> f32 {
    let parallel = (cos - eta * cos_refracted) * (1.0 / (cos + eta * cos_refracted));
    let perpendicular = (eta * cos - cos_refracted) * (1.0 / (eta * cos + cos_refracted));
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Returns the square of the refracted direction's cosine (Snell's law); zero or negative at total
/// reflection. `eta` is the ratio of the indices, incident over refracted. The form avoids the
/// cancellation of 1 - eta² sin² at grazing angles for an index near 1.
#[inline(always)]
pub fn refracted_cos2(cos: f32, eta: f32) -> f32 {
    let along = eta * cos;
    (1.0 - eta) * (1.0 + eta) + along * along
}

/// Returns Schlick's approximation (1994) as "Ray Tracing in One Weekend" (the book) has it: with
/// the incident cosine on both sides of the boundary. From inside, just below total reflection, it
/// is too low by up to 0.96 at index 1.5. Scenes select it with `fresnel: Schlick`.
#[inline(always)]
pub fn schlick(cos: f32, eta: f32) -> f32 {
    let r0 = (1.0 - eta) * (1.0 / (1.0 + eta));
    let r0 = r0 * r0;
    r0 + (1.0 - r0) * fifth_power(1.0 - cos)
}

/// Returns Schlick's approximation from the reflectance at normal incidence; 1 at grazing
/// incidence.
#[inline(always)]
pub fn schlick_from(normal_incidence: Vec3, cos: f32) -> Vec3 {
    normal_incidence + (Vec3::ONE - normal_incidence) * fifth_power(max(1.0 - cos, 0.0))
}

#[inline(always)]
fn fifth_power(x: f32) -> f32 {
    let x2 = x * x;
    x2 * x2 * x
}

/// Returns the unpolarised Fresnel reflectance of a conductor with index `eta` + i `k` relative to
/// outside, by channel (Pharr et al., section 9.3.6, in real arithmetic).
#[inline(always)]
pub fn conductor(cos: f32, eta: Vec3, k: Vec3) -> Vec3 {
    Vec3::new(
        conductor_channel(cos, eta.x, k.x),
        conductor_channel(cos, eta.y, k.y),
        conductor_channel(cos, eta.z, k.z),
    )
}

#[inline(always)]
fn conductor_channel(cos: f32, eta: f32, k: f32) -> f32 {
    let cos = max(cos, 1e-4); // an index of 1 at exactly grazing incidence would be 0 / 0
    let (cos2, sin2) = (cos * cos, max(1.0 - cos * cos, 0.0));
    let (eta2, k2) = (eta * eta, k * k);
    let t0 = eta2 - k2 - sin2;
    let sum = sqrt(t0 * t0 + 4.0 * eta2 * k2); // a² + b²
    let a = sqrt(max(0.5 * (sum + t0), 0.0));
    let (t1, t2) = (sum + cos2, 2.0 * cos * a);
    let perpendicular = (t1 - t2) * (1.0 / (t1 + t2));
    let (t3, t4) = (cos2 * sum + sin2 * sin2, t2 * sin2);
    let parallel = perpendicular * (t3 - t4) * (1.0 / (t3 + t4));
    0.5 * (perpendicular + parallel)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Torture test 15: against the textbook's formula in f64, by angles.
    #[test]
    fn fresnel_against_f64() {
        for ior in [1.0f64, 1.0001, 1.5, 4.0, 100.0, 1.0 / 1.5, 0.25] {
            for i in 1..1000 {
                let cos = f64::from(i) / 1000.0;
                let eta = 1.0 / ior;
                let sin2 = eta * eta * (1.0 - cos * cos);
                if sin2 > 0.9999 {
                    continue; // the critical angle has its own tests
                }
                let cos_t = (1.0 - sin2).sqrt();
                let rs = (cos - ior * cos_t) / (cos + ior * cos_t);
                let rp = (ior * cos - cos_t) / (ior * cos + cos_t);
                let want = 0.5 * (rs * rs + rp * rp);
                let got = f64::from(dielectric(cos as f32, cos_t as f32, eta as f32));
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

    /// Against the formula with complex numbers, in f64.
    #[test]
    fn conductor_against_f64() {
        for (eta, k) in [(0.2f64, 3.9f64), (1.1, 2.6), (0.04, 4.8), (2.9, 3.1), (1.5, 0.0)] {
            for i in 1..=1000 {
                let cos = f64::from(i) / 1000.0;
                let sin2 = 1.0 - cos * cos;
                // sqrt(m² - sin²) of the complex index m.
                let (re, im) = (eta * eta - k * k - sin2, 2.0 * eta * k);
                let length = (re * re + im * im).sqrt();
                let (a, b) = ((0.5 * (length + re)).sqrt(), (0.5 * (length - re)).max(0.0).sqrt());
                let rs = ((cos - a).powi(2) + b * b) / ((cos + a).powi(2) + b * b);
                let (mr, mi) = (eta * eta - k * k, 2.0 * eta * k);
                let rp = ((mr * cos - a).powi(2) + (mi * cos - b).powi(2))
                    / ((mr * cos + a).powi(2) + (mi * cos + b).powi(2));
                let want = 0.5 * (rs + rp);
                let got = f64::from(conductor(cos as f32, Vec3::splat(eta as f32), Vec3::splat(k as f32)).x);
                assert!((got - want).abs() < 2e-5, "{eta} {k} {cos}: {got} {want}");
            }
        }
    }
}
