//! Reciprocity: exchange of light and viewer.

use crate::materials::{self, Setup};
use crate::statistics::{SLOW, samples, words};
use glam::Vec3;
use trisect_shared::bsdf::{LAYERED, METALLIC_ROUGHNESS, ROUGH_DIELECTRIC};
use trisect_shared::fresnel::refracted_cos2;
use trisect_shared::math::{max_component, normalize, unit_sphere};

/// Compares value over both cosines in both directions, for random pairs of directions on one side
/// of the surface or (`through`) on both. Returns the maximum relative difference, with the second
/// value times `factor`, and the number of pairs that scatter.
fn difference(there: &Setup, back: &Setup, through: bool, factor: f32) -> (f32, u32) {
    let normal = normalize(Vec3::new(0.48, 0.6, -0.64));
    let (mut worst, mut count) = (0.0f32, 0);
    for i in 0..samples(200_000) {
        let w = words(5, i);
        let mut o = unit_sphere(w.x, w.y);
        let mut i = unit_sphere(w.z, w.w);
        o = if o.dot(normal) < 0.0 { -o } else { o };
        i = if (i.dot(normal) < 0.0) != through { -i } else { i };
        let cosines = (o.dot(normal), i.dot(normal).abs());
        if cosines.0.min(cosines.1) < 0.02 {
            continue; // rounding, 1e-7 over the cosine, is magnified
        }
        if is_critical(there, o, i, through) {
            continue;
        }
        let forth = max_component(there.view_from(o, normal).evaluate(i).value) / cosines.1;
        let other_normal = if through { -normal } else { normal };
        let other = max_component(back.view_from(i, other_normal).evaluate(o).value) / cosines.0 * factor;
        // The tails of a narrow lobe are small differences of large numbers.
        if forth.max(other) > 1e-3 {
            worst = worst.max((forth - other).abs() / forth.max(other));
            count += 1;
        }
    }
    assert!(count > samples(200_000) / 100, "{}: {count}", there.name);
    (worst, count)
}

/// Returns whether the facet that sends one direction to the other is glass near the critical
/// angle: there the transmitted fraction follows the cosine of refraction, whose square, below
/// 0.003, has a rounding error of 1e-7.
fn is_critical(setup: &Setup, o: Vec3, i: Vec3, through: bool) -> bool {
    if setup.material.kind != ROUGH_DIELECTRIC {
        return false;
    }
    let eta = if setup.front { 1.0 / setup.material.ior } else { setup.material.ior };
    let h = normalize(if through { o * eta + i } else { o + i });
    let (c, passes) = (o.dot(h), refracted_cos2(o.dot(h).abs(), eta));
    passes.abs() < 3e-3 || c * c < 3e-3
}

/// A few roundings over the minimum cosine, 0.02, or over twice the minimum square of the cosine of
/// refraction, 0.003.
const ROUNDING: f32 = 2e-4;

/// Returns a setup whose diffuse base is black: the boundary weakens it by the viewer's angle
/// alone, and with it returns all light.
fn without_base(setup: Setup) -> Setup {
    let mut setup = setup;
    if [METALLIC_ROUGHNESS, LAYERED].contains(&setup.material.kind) && setup.material.metallic < 1.0 {
        setup.material.albedo = Vec3::ZERO;
    }
    setup
}

fn reflects_alike(setup: &Setup) -> bool {
    difference(setup, setup, false, 1.0).0 < ROUNDING
}

#[test]
fn reflection() {
    let mut setups = vec![materials::lambertian()];
    setups.extend([0.2, 0.5, 1.0].map(materials::conductor));
    setups.extend([0.3, 0.7].map(materials::copper));
    setups.extend(materials::mixes().into_iter().filter(|setup| setup.material.roughness > 0.0));
    // The extension mixes a coat by the viewer's angle alone.
    let is_reciprocal = |setup: &Setup| setup.layers.coat == 0.0 && !setup.name.starts_with("rough glass");
    setups.extend(materials::layers().into_iter().filter(is_reciprocal));
    // What glass scatters again is scaled by the viewer's albedo.
    let glass = |roughness| {
        materials::SIDES.map(|(ior, front)| materials::single_scattering_glass(ior, roughness, front))
    };
    setups.extend([0.3, 0.8].into_iter().flat_map(glass));
    for setup in setups.into_iter().map(without_base) {
        let (worst, count) = difference(&setup, &setup, false, 1.0);
        println!("{}: {worst:.1e} of {count}", setup.name);
        assert!(worst < ROUNDING, "{}: {worst} of {count}", setup.name);
    }
}

/// Negative control: a plastic with its base is not reciprocal.
#[test]
fn negative_control_the_base_is_not_reciprocal() {
    let plastic = materials::mix(0.0, 0.3, 0.0);
    assert!(!reflects_alike(&plastic) && reflects_alike(&without_base(plastic)));
}

/// Negative control: the book's fuzz is not reciprocal. Its pdf is symmetric, not its value over
/// the cosine.
#[test]
fn negative_control_fuzz_is_not_reciprocal() {
    assert!(!reflects_alike(&materials::metal(0.5)));
    let seen = |o, i| materials::metal(0.5).view_from(o, Vec3::Z).evaluate(i).pdf;
    let (o, i) = (normalize(Vec3::new(0.5, 0.1, 0.8)), normalize(Vec3::new(-0.7, 0.1, 0.6)));
    assert!((seen(o, i) / seen(i, o) - 1.0).abs() < 1e-5);
}

/// Without the factor eta² on radiance, a surface transports L / n², with n the index of the
/// medium. Value over both cosines times n² of the viewer's medium is then reciprocal.
#[test]
fn refraction() {
    for roughness in [0.3, 0.8] {
        for ior in [1.5, 0.67] {
            let sides = [true, false].map(|front| materials::single_scattering_glass(ior, roughness, front));
            let [outside, inside] = &sides;
            // The index is 1 as seen from outside, and `ior` as seen from inside.
            let worst = difference(outside, inside, true, ior * ior).0;
            println!("{}: {worst:.1e}", outside.name);
            assert!(worst < ROUNDING, "{}: {worst}", outside.name);
            let negative_control = difference(outside, inside, true, 1.0).0;
            assert!(negative_control > 0.1 || SLOW, "{negative_control}");
        }
    }
}

/// A thin wall has one medium on both sides.
#[test]
fn thin_walls() {
    let there = materials::mix(0.2, 0.4, 0.6);
    let back = Setup { front: false, ..there.clone() };
    let worst = difference(&there, &back, true, 1.0).0;
    assert!(worst < ROUNDING, "{worst}");
}
