//! Surfaces that stand for materials of pbrt and Mitsuba.

use super::value::Value;
use crate::description::{
    Conductor, ConductorFresnel, Dielectric, Lambertian, Metal, MetallicRoughness, RoughDielectric, Surface,
};
use crate::material::layers::{Coat, Layers};
use glam::DVec3;
use trisect_shared::microfacet::MIN_ROUGH_ALPHA;

/// Clear coating of a diffuse base.
#[derive(Clone, Copy, Debug)]
pub struct Coating {
    /// Index of refraction relative to the outside.
    pub ior: f64,
    /// GGX alpha of the boundary.
    pub alpha: f64,
    /// True if light that the boundary sends back to the base changes its colour.
    pub is_nonlinear: bool,
}

/// Returns the roughness whose GGX alpha is this.
pub fn roughness_of(alpha: f64) -> f64 {
    alpha.clamp(0.0, 1.0).sqrt()
}

/// Returns the share of diffuse light that the boundary of a denser inside reflects back to it.
///
/// By reciprocity, of diffuse light from inside the share (1 - external) / ior² leaves; the
/// external reflectance of diffuse light is integrated over the squared cosine.
fn internal_reflectance(ior: f64) -> f64 {
    const STEPS: u32 = 256;
    let reflectance = |cosine: f64| {
        let sine2 = (1.0 - cosine * cosine) / (ior * ior);
        if sine2 >= 1.0 {
            return 1.0;
        }
        let inside = (1.0 - sine2).sqrt();
        let parallel = (ior * cosine - inside) / (ior * cosine + inside);
        let perpendicular = (cosine - ior * inside) / (cosine + ior * inside);
        0.5 * (parallel * parallel + perpendicular * perpendicular)
    };
    let points = (0..STEPS).map(|step| (f64::from(step) + 0.5) / f64::from(STEPS));
    let external = points.map(|square| reflectance(square.sqrt())).sum::<f64>() / f64::from(STEPS);
    1.0 - (1.0 - external) / (ior * ior)
}

/// Returns plastic: a diffuse base below a clear coating.
///
/// Its albedo seen from any direction is that of a smooth coating by the exact equations, but for
/// Schlick's approximation; the light that the base reflects does not depend on where it came from.
/// `base` is the reflectance of the base alone.
pub fn plastic(base: Value, coating: Coating) -> Surface {
    let (color, texture) = base.share();
    let inside =
        if coating.is_nonlinear && coating.ior > 1.0 { internal_reflectance(coating.ior) } else { 0.0 };
    Surface::MetallicRoughness(MetallicRoughness {
        base_color: color * (1.0 - inside) / (DVec3::ONE - color * inside),
        texture,
        metallic: 0.0,
        roughness: roughness_of(coating.alpha),
        ior: coating.ior,
        ..MetallicRoughness::default()
    })
}

/// Returns a metal by its index of refraction, or a mirror without Fresnel reflectance if both
/// parts are 0.
pub fn conductor(eta: DVec3, k: DVec3, alpha: f64) -> Surface {
    let fresnel = ConductorFresnel::Ior { eta: eta.max(DVec3::splat(1e-6)), k };
    Surface::Conductor(Conductor { fresnel, roughness: roughness_of(alpha), multiple_scattering: false })
}

/// Returns a metal of this reflectance: at normal incidence if it is rough, and at all angles if it
/// is smooth.
pub fn tinted_metal(reflectance: DVec3, alpha: f64) -> Surface {
    let reflectance = reflectance.clamp(DVec3::ZERO, DVec3::ONE);
    if alpha < f64::from(MIN_ROUGH_ALPHA) {
        return Surface::Metal(Metal { albedo: reflectance, fuzz: 0.0 });
    }
    let fresnel = ConductorFresnel::Schlick { reflectance };
    Surface::Conductor(Conductor { fresnel, roughness: roughness_of(alpha), multiple_scattering: false })
}

/// Returns solid clear glass. An index of 1 has no boundary: it is an empty surface.
pub fn glass_surface(ior: f64, alpha: f64) -> Surface {
    if alpha < f64::from(MIN_ROUGH_ALPHA) {
        return Surface::Dielectric(Dielectric { ior });
    }
    let roughness = roughness_of(alpha);
    Surface::RoughDielectric(RoughDielectric { ior, roughness, multiple_scattering: false })
}

/// Returns a thin pane of clear glass. At normal incidence it reflects what both of its boundaries
/// reflect together, 2 R / (1 + R).
pub fn thin_glass(ior: f64) -> Surface {
    let one = ((ior - 1.0) / (ior + 1.0)).powi(2);
    let root = (2.0 * one / (1.0 + one)).sqrt();
    Surface::MetallicRoughness(MetallicRoughness {
        metallic: 0.0,
        roughness: 0.0,
        ior: ((1.0 + root) / (1.0 - root)).min(1e3),
        transmission: 1.0,
        ..MetallicRoughness::default()
    })
}

/// Half angles of a spot light, in radians, whose falloff is Trisect's, and which emits as much as
/// one that is full up to the cosine `inner`, and of mean `ring` between it and `outer`. `None` for
/// the inner angle if the cone is as sharp as can be.
///
/// Trisect's falloff has the mean 1/3 over the ring between its angles. The outer angle stays.
pub fn power_preserving_cone(inner: f64, outer: f64, ring: f64) -> (f64, f64) {
    let full = (1.0 - inner) + ring * (inner - outer);
    // 1 - x + (x - outer) / 3 = full
    let cosine = 1.5 * (1.0 - full - outer / 3.0);
    let outer_angle = outer.clamp(0.0, 1.0).acos();
    (cosine.clamp(-1.0, 1.0).acos().clamp(0.0, outer_angle * (1.0 - 1e-6)), outer_angle)
}

impl Coating {
    /// Returns the coat of a layered material.
    pub fn layers(self) -> Layers {
        let coat = Coat { roughness: roughness_of(self.alpha), ..Coat::default() };
        Layers { coat: Some(coat), ..Layers::default() }
    }
}

impl From<Value> for Surface {
    /// Returns the diffuse surface of a reflectance.
    fn from(value: Value) -> Self {
        let (albedo, texture) = value.share();
        Self::Lambertian(Lambertian { albedo, texture })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean reflectance of diffuse light inside plastic of index 1.49 and 1.5, as tables have it.
    #[test]
    fn internal_reflectance_is_that_of_tables() {
        assert!((internal_reflectance(1.5) - 0.596).abs() < 2e-3, "{}", internal_reflectance(1.5));
        assert!(internal_reflectance(1.0 + 1e-9) < 1e-4);
    }

    #[test]
    fn cones_emit_as_much_as_before() {
        // Mean of Trisect's falloff over the whole cone, in units of 2 pi.
        let power = |(inner, outer): (f64, f64)| {
            let (a, b) = (inner.cos(), outer.cos());
            (1.0 - a) + (a - b) / 3.0
        };
        let (inner, outer) = (20f64.to_radians().cos(), 30f64.to_radians().cos());
        let found = power_preserving_cone(inner, outer, 0.5);
        assert!((power(found) - ((1.0 - inner) + 0.5 * (inner - outer))).abs() < 1e-12);
        assert!(found.0 > 20f64.to_radians() && found.0 < found.1);
        let (sharp, edge) = power_preserving_cone(outer, outer, 1.0);
        assert!(sharp < edge && edge - sharp < 1e-5);
    }

    #[test]
    fn thin_glass_reflects_from_both_sides() {
        let Surface::MetallicRoughness(pane) = thin_glass(1.5) else { panic!() };
        let reflectance = ((pane.ior - 1.0) / (pane.ior + 1.0)).powi(2);
        assert!((reflectance - 0.08 / 1.04).abs() < 1e-12);
    }
}
