//! The choice among lobes by the largest and the smallest random number.

use crate::materials::Setup;
use crate::statistics::samples;
use glam::Vec3;
use trisect_shared::bsdf::METALLIC_ROUGHNESS;
use trisect_shared::features::{BOOK, FeatureSet, MICROFACETS};
use trisect_shared::material::Material;
use trisect_shared::rng::Words;

const ALL: FeatureSet<{ BOOK | MICROFACETS }> = FeatureSet::ALL;

/// Returns how many of some views of a smooth material have a weight that is no number, if
/// `random.z` is `choice`.
fn faults(material: Material, choice: u32) -> u32 {
    let setup = Setup::new("smooth", material);
    let count = samples(20_000);
    let is_fault = |i: &u32| {
        let cos = (*i as f32 + 0.5) / count as f32;
        let random = Words { x: 7 * i, y: 11 * i, z: choice, w: 0 };
        let sample = setup.view(cos).bsdf.sample(ALL, random);
        !sample.absorbed && !sample.weight.is_finite()
    };
    (0..count).filter(is_fault).count() as u32
}

/// The probabilities of the lobes add up to 1 but for rounding, so the largest number may lie above
/// their sum: it chooses no lobe of probability 0, whose weight would be no number.
#[test]
fn the_largest_number_chooses_a_lobe() {
    for albedo in [0.0, 0.1, 0.35, 0.8, 1.0] {
        for (metallic, transmission) in [(0.0, 0.0), (0.3, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5)] {
            let albedo = Vec3::new(albedo, 0.7 * albedo, 0.2 * albedo);
            let material =
                Material { metallic, transmission, ior: 1.5, ..Material::new(METALLIC_ROUGHNESS, albedo) };
            for choice in [0, u32::MAX] {
                assert_eq!(faults(material, choice), 0, "{albedo} {metallic} {transmission} {choice:#x}");
            }
        }
    }
}
