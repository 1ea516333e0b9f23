//! Indices of refraction, against Fresnel's and Snell's laws in f64.

use super::{Random, agrees, described, found, spread};
use trisect::precision::Limit;
use trisect::scene::SceneDocument;
use trisect_shared::fresnel::{dielectric, refracted_cos2};
use trisect_shared::math::normalize;

fn glass(ior: f64) -> SceneDocument {
    described(&format!("materials: {{ \"glass\": Dielectric(ior: {ior:?}) }}, objects: []"))
}

/// Returns the root mean square of relative errors of the reflectance, for indices near `ior`, from
/// both sides, away from grazing angles.
fn reflectance_error(ior: f64) -> f64 {
    let mut random = Random(7);
    let mut errors = Vec::new();
    for _ in 0..3000 {
        let ior = 1.0 + (ior - 1.0) * (0.9 + 0.2 * random.number());
        let rounded_cos = (0.3 + 0.7 * random.number()) as f32;
        let cos = f64::from(rounded_cos);
        for (eta, rounded) in [(1.0 / ior, 1.0 / ior as f32), (ior, ior as f32)] {
            let refracted = ((1.0 - eta) * (1.0 + eta) + (eta * cos).powi(2)).sqrt();
            let a = (cos - eta * refracted) / (cos + eta * refracted);
            let b = (eta * cos - refracted) / (eta * cos + refracted);
            let want = 0.5 * (a * a + b * b);
            let refracted = refracted_cos2(rounded_cos, rounded).max(0.0).sqrt();
            errors
                .push((f64::from(dielectric(rounded_cos, refracted, rounded)) / want - 1.0).clamp(-1.0, 1.0));
        }
    }
    spread(errors.into_iter().filter(|error| error.is_finite())).0
}

#[test]
fn indices_near_one() {
    for difference in [1e-2, 1e-3, 2e-4, 5e-5, 1e-5, 1e-6, -1e-3, -1e-5] {
        let ior = 1.0 + difference;
        agrees(&glass(ior), Limit::IorNearOne, reflectance_error(ior)).unwrap();
    }
    assert_eq!(found(&glass(1.0), Limit::IorNearOne), [], "exactly 1 is exact: it reflects nothing");
    assert_eq!(dielectric(0.5, refracted_cos2(0.5, 1.0).sqrt(), 1.0), 0.0);
    // Where the index rounds to 1 there is no boundary.
    assert_eq!(found(&glass(1.00000001), Limit::IorNearOne)[0].predicted.value, 1.0);
    assert_eq!(1.00000001f64 as f32, 1.0);
}

/// Returns the root mean square error of the refracted ray's squared cosine, within the cone in
/// which light leaves glass.
fn refraction_error(ior: f64) -> f64 {
    let mut random = Random(8);
    let errors = (0..3000).map(|_| {
        let normal = random.direction();
        let (x, y) = normal.any_orthonormal_pair();
        let cos = 1.0 - 0.5 * random.number() / (ior * ior);
        let direction = normal * cos + (x * 0.6 + y * 0.8) * (1.0 - cos * cos).sqrt();
        let (normal, direction) = (normalize(normal.as_vec3()), normalize(direction.as_vec3()));
        // The reference is that of the rounded vectors: what the kernels would compute if they did
        // not round.
        let cos = normal.as_dvec3().normalize().dot(direction.as_dvec3().normalize());
        let want = (1.0 - ior) * (1.0 + ior) + (ior * cos).powi(2);
        f64::from(refracted_cos2(normal.dot(direction).min(1.0), ior as f32)) - want
    });
    spread(errors).0
}

#[test]
fn extreme_indices() {
    for ior in [1.5, 4.0, 30.0, 150.0, 1000.0] {
        let measured = refraction_error(ior);
        agrees(&glass(ior), Limit::IorExtreme, measured).unwrap();
        agrees(&glass(1.0 / ior), Limit::IorExtreme, measured).unwrap();
    }
    let rough = |ior: f64| {
        format!("materials: {{ \"a\": RoughDielectric(ior: {ior}, roughness: 0.5) }}, objects: []")
    };
    assert_eq!(found(&described(&rough(200.0)), Limit::IorExtreme)[0].what, "material \"a\"");
    assert_eq!(found(&described(&rough(1.5)), Limit::IorExtreme), []);
}
