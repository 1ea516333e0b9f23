//! The onset of total reflection (torture test 16).

use glam::Vec3;
use trisect_shared::bsdf::{DIELECTRIC, scatter};
use trisect_shared::features::{BOOK, FeatureSet};
use trisect_shared::material::Material;
use trisect_shared::rng::Words;

/// Returns the cosine moved by `steps` units in the last place.
fn step(cos: f32, steps: i32) -> f32 {
    f32::from_bits(cos.to_bits().wrapping_add_signed(steps))
}

/// Counts how often glass refracts where double precision says total reflection, or the other way
/// round, for cosines around the critical angle and several indices. `margin` is the number of
/// steps on either side of the edge that are left out.
fn wrong(refracts: impl Fn(f32, f32) -> bool, margin: i32) -> u32 {
    let mut wrong = 0;
    for ior in [1.000_1f32, 1.01, 1.1, 1.33, 1.5, 2.4, 4.0, 100.0] {
        let edge = (1.0 - 1.0 / f64::from(ior).powi(2)).sqrt() as f32;
        for steps in (-1000..=1000).filter(|steps: &i32| steps.abs() > margin) {
            let cos = step(edge, steps);
            if cos > 1.0 {
                continue; // for a high index the edge is close to 1
            }
            let sin2 = f64::from(ior).powi(2) * (1.0 - f64::from(cos).powi(2));
            wrong += u32::from(refracts(cos, ior) != (sin2 < 1.0));
        }
    }
    wrong
}

/// Refracts from inside, with the random number that refracts wherever anything is transmitted.
fn refracts(cos: f32, ior: f32) -> bool {
    let glass = Material { ior, ..Material::new(DIELECTRIC, Vec3::ONE) };
    let incoming = Vec3::new((1.0 - f64::from(cos).powi(2)).sqrt() as f32, -cos, 0.0);
    let random = Words { x: 0, y: 0, z: u32::MAX, w: 0 };
    let scatter = scatter(FeatureSet::<BOOK>::ALL, &glass, incoming, Vec3::Y, false, random);
    assert!((scatter.direction.length() - 1.0).abs() < 1e-6, "{ior} {cos}: {}", scatter.direction);
    let below = scatter.direction.y < 0.0;
    assert!(
        below == scatter.transmitted || scatter.direction.y.abs() < 1e-3,
        "{ior} {cos}: {}",
        scatter.direction
    );
    scatter.transmitted
}

#[test]
fn reflection_is_total_beyond_it_only() {
    // Two steps: 1 - eta² and eta² cos², which are nearly equal there, round by half a step each,
    // as do eta and the edge itself.
    let count = wrong(refracts, 2);
    assert_eq!(count, 0);
    // Negative control: an edge that is off by 1e-4 in the square of the cosine of refraction.
    let early = |cos: f32, ior: f32| (1.0 - ior) * (1.0 + ior) + (ior * cos) * (ior * cos) > 1e-4;
    assert!(wrong(early, 2) > 0);
}
