//! Sampled directions against their pdf (torture test 34), and each sample's weight against value
//! over pdf.

use crate::chart::{CELLS, Chart};
use crate::materials::{self, BsdfView, Setup};
use crate::statistics::{SLOW, chi_square, samples, sidak};
use glam::Vec3;
use trisect_shared::fresnel::refracted_cos2;
use trisect_shared::math::max_component;

/// Cosines of the angle between viewer and normal.
const COSINES: [f32; 4] = [1.0, 0.7, 0.3, 0.1];

/// Quadrature points in a cell, in each direction.
const POINTS: usize = if SLOW { 4 } else { 12 };

/// Result of one material at one angle.
#[derive(Debug)]
struct Outcome {
    p: f64,
    /// Fraction of the samples that are absorbed or scattered by a delta lobe.
    lost: f64,
    /// Standard deviation of `lost`.
    lost_error: f64,
    /// Integral of the pdf.
    total: f64,
    /// Fraction of the samples whose weight times pdf differs from the value evaluated at their
    /// direction, or whose pdf differs from the evaluated one, by more than rounding explains.
    disagreement: f64,
}

/// Compares the samples of `of` with the pdf of `by`.
fn compare(of: &BsdfView, by: &BsdfView, eta: f32, stream: u32) -> Outcome {
    let n = samples(400_000);
    let cos2 = refracted_cos2(of.viewer.dot(of.normal), eta);
    let mirrored = of.mirrored();
    // Peak of the transmitted lobe: direction through a thin wall, or the refracted one.
    let through = if eta == 1.0 || cos2 <= 0.0 {
        mirrored - of.normal * (2.0 * mirrored.dot(of.normal))
    } else {
        of.normal * (eta * of.viewer.dot(of.normal) - cos2.sqrt()) - of.viewer * eta
    };
    let charts = [mirrored, through].map(|axis| Chart::new(axis.normalize()));
    let mut observed = vec![0.0; 2 * CELLS];
    let (mut lost, mut disagreeing) = (0.0, 0.0);
    for i in 0..n {
        let s = of.sample(stream, i);
        if s.absorbed || s.pdf == 0.0 {
            lost += 1.0;
            continue;
        }
        let below = s.direction.dot(of.normal) < 0.0;
        assert_eq!(below, s.transmitted);
        observed[usize::from(below) * CELLS + charts[usize::from(below)].cell(s.direction)] += 1.0;
        let e = of.evaluate(s.direction);
        // The direction is rounded to 1e-7: relative to its cosine with the normal, and to the
        // width of the narrowest lobe over the viewer's cosine.
        let allowed = 2e-4 + 1e-6 / f64::from(s.direction.dot(of.normal).abs());
        let relative = |a: f32, b: f32| f64::from((a - b).abs()) / f64::from(b.abs().max(1e-6)) / allowed;
        let value = max_component(e.value);
        let pdf_error = relative(s.pdf, e.pdf);
        let value_error = relative(max_component(s.weight) * e.pdf, value);
        disagreeing += if pdf_error < 1.0 && value_error < 1.0 { 0.0 } else { 1.0 };
    }
    let mut expected = Vec::with_capacity(observed.len());
    for (chart, below) in charts.iter().zip([false, true]) {
        let pdf = |d: Vec3| {
            if (d.dot(by.normal) < 0.0) == below { f64::from(by.evaluate(d).pdf) } else { 0.0 }
        };
        expected.extend((0..CELLS).map(|cell| chart.integral(cell, POINTS, pdf)));
    }
    let total: f64 = expected.iter().sum();
    let scale = (f64::from(n) - lost) / total;
    expected.iter_mut().for_each(|e| *e *= scale);
    let share = lost / f64::from(n);
    Outcome {
        p: chi_square(&observed, &expected),
        lost: share,
        lost_error: (share * (1.0 - share) / f64::from(n)).sqrt(),
        total,
        disagreement: disagreeing / f64::from(n),
    }
}

fn relative_index(setup: &Setup) -> f32 {
    let ior = setup.material.ior;
    if !setup.name.starts_with("rough glass") {
        1.0
    } else if setup.front {
        1.0 / ior
    } else {
        ior
    }
}

fn check(setups: &[Setup]) {
    let min_p = sidak(60 * COSINES.len()); // of all tests of this file together
    for (k, setup) in setups.iter().enumerate() {
        for cos in COSINES {
            let (seen, eta) = (setup.view(cos), relative_index(setup));
            let outcome = compare(&seen, &seen, eta, k as u32);
            let name = format!("{} at {cos}: {outcome:?}", setup.name);
            println!("{name}");
            assert!(outcome.p > min_p, "{name}");
            // 2e-3 is the quadrature's error in the cells that contain an edge of the pdf.
            let missing = (outcome.total + outcome.lost - 1.0).abs();
            assert!(missing < 4.5 * outcome.lost_error + if SLOW { 2e-2 } else { 2e-3 }, "{missing} {name}");
            // At most one in 5000: facets at glass's critical angle, where the transmitted fraction
            // behaves like a square root.
            assert!(outcome.disagreement < 2e-4, "{name}");
        }
    }
}

#[test]
fn books_materials() {
    check(&[materials::lambertian(), materials::metal(0.1), materials::metal(0.5), materials::metal(1.0)]);
}

#[test]
fn rough_conductors() {
    check(&[0.2, 0.5, 1.0].map(materials::conductor));
    check(&[materials::copper(0.4)]);
}

#[test]
fn rough_glass() {
    check(&materials::rough_glasses(0.2));
    check(&materials::rough_glasses(0.5));
}

#[test]
fn metallic_roughness() {
    check(&materials::mixes());
}

#[test]
fn layers() {
    check(&materials::layers());
}

/// Negative control: a pdf whose width is wrong by a tenth must be found.
#[test]
fn negative_control_other_widths_are_found() {
    if SLOW {
        return;
    }
    let setups = [
        materials::metal(0.5),
        materials::conductor(0.2),
        materials::conductor(0.5),
        materials::rough_glass(1.5, 0.5, true),
        materials::mix(0.5, 0.6, 0.0),
    ];
    for setup in setups {
        let (of, by) = (setup.view(0.7), setup.with_alpha(1.1).view(0.7));
        let outcome = compare(&of, &by, relative_index(&setup), 9);
        assert!(outcome.p < 1e-9 && outcome.disagreement < 2e-4, "{}: {outcome:?}", setup.name);
    }
}
