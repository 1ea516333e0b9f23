//! Colours of spectra, in linear Rec. 709.
//!
//! A reflectance is seen in the light of the standard illuminant D65, so that a constant spectrum
//! is grey. Emitted light is seen as it is: equal power at all wavelengths is a little red. Its
//! luminance is 1 for a power of 1, as in Mitsuba.

use glam::{DMat3, DVec3};
use std::sync::LazyLock;

/// First wavelength of the tables in nanometres.
const FIRST: f64 = 380.0;

/// Distance of the wavelengths of the tables in nanometres.
const STEP: f64 = 10.0;

/// Relative power of the standard illuminant D65 from 380 to 730 nm (ISO/CIE 11664-2).
const D65: [f64; 36] = [
    49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923,
    108.811, 109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062,
    89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604,
    69.8856,
];

/// Steps per entry of the table in which spectra are integrated.
const SUBSTEPS: usize = 10;

/// Returns the CIE 1931 colour matching functions: the fits of Wyman, Sloan and Shirley, Journal of
/// Computer Graphics Techniques 2(2), 2013, section 2.2.
fn color_matching(lambda: f64) -> DVec3 {
    let lobe = |height: f64, centre: f64, below: f64, above: f64| {
        let t = (lambda - centre) / if lambda < centre { below } else { above };
        height * libm::exp(-0.5 * t * t)
    };
    DVec3::new(
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

/// Map from CIE XYZ to linear Rec. 709 (IEC 61966-2-1).
const REC_709: DMat3 = DMat3::from_cols(
    DVec3::new(3.2404542, -0.9692660, 0.0556434),
    DVec3::new(-1.5371385, 1.8760108, -0.2040259),
    DVec3::new(-0.4985314, 0.0415560, 1.0572252),
);

/// Wavelengths with the weight of each channel: for reflectances, and for emitted light.
static WEIGHTS: LazyLock<Vec<(f64, DVec3, DVec3)>> = LazyLock::new(|| {
    let steps = 0..(D65.len() - 1) * SUBSTEPS;
    let rows = steps.map(|step| {
        let place = (step as f64 + 0.5) / SUBSTEPS as f64;
        let (below, share) = (place as usize, place.fract());
        let lambda = FIRST + STEP * place;
        let daylight = D65[below] * (1.0 - share) + D65[below + 1] * share;
        (lambda, REC_709 * (color_matching(lambda) * daylight), color_matching(lambda))
    });
    let rows: Vec<_> = rows.collect();
    let white = rows.iter().fold(DVec3::ZERO, |sum, row| sum + row.1);
    let luminance: f64 = rows.iter().map(|row| row.2.y).sum();
    rows.into_iter().map(|(lambda, seen, cie)| (lambda, seen / white, REC_709 * (cie / luminance))).collect()
});

/// Returns the value of a spectrum at a wavelength: linear between its samples, which ascend by
/// wavelength, and 0 beyond them.
fn at(samples: &[(f64, f64)], lambda: f64) -> f64 {
    let above = samples.partition_point(|sample| sample.0 < lambda);
    match (above.checked_sub(1).and_then(|below| samples.get(below)), samples.get(above)) {
        (Some(&(from, low)), Some(&(to, high))) if to > from => {
            low + (high - low) * (lambda - from) / (to - from)
        }
        (_, Some(&(from, value))) if from == lambda => value,
        _ => 0.0,
    }
}

/// Returns the colour of a reflectance in daylight; negative channels are 0.
pub fn reflected(samples: &[(f64, f64)]) -> DVec3 {
    let sum = WEIGHTS.iter().fold(DVec3::ZERO, |sum, row| sum + row.1 * at(samples, row.0));
    sum.max(DVec3::ZERO)
}

/// Returns the colour of emitted light; negative channels are 0.
pub fn emitted(samples: &[(f64, f64)]) -> DVec3 {
    let sum = WEIGHTS.iter().fold(DVec3::ZERO, |sum, row| sum + row.2 * at(samples, row.0));
    sum.max(DVec3::ZERO)
}

/// Returns the colour of a black body at a temperature in kelvin, with luminance 1; `None` for a
/// temperature outside 500 to 100,000 K.
pub fn blackbody(temperature: f64) -> Option<DVec3> {
    if !(500.0..=1e5).contains(&temperature) {
        return None;
    }
    // Planck's law relative to that at 560 nm.
    let exponent = |lambda: f64| 1.438776877e7 / (lambda * temperature);
    let power =
        |lambda: f64| (560.0 / lambda).powi(5) * libm::expm1(exponent(560.0)) / libm::expm1(exponent(lambda));
    let color = WEIGHTS.iter().fold(DVec3::ZERO, |sum, row| sum + row.2 * power(row.0)).max(DVec3::ZERO);
    Some(color / color.dot(DVec3::new(0.2126, 0.7152, 0.0722)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns whether a colour is within a share of another's largest channel.
    fn near(found: DVec3, want: [f64; 3], share: f64) -> bool {
        let want = DVec3::from(want);
        (found - want).abs().max_element() <= share * want.max_element()
    }

    /// Colours that Mitsuba 3.9.1 computes from tables of the colour matching functions.
    #[test]
    fn spectra_have_the_colours_of_mitsuba() {
        let flat = [(300.0, 0.5), (900.0, 0.5)];
        assert!(near(reflected(&flat), [0.5; 3], 1e-12), "{}", reflected(&flat));
        let rising = [(400.0, 0.1), (700.0, 0.9)];
        let found = reflected(&rising);
        assert!(near(found, [0.742853, 0.48114, 0.208325], 0.01), "{found}");
        let white = [(300.0, 1.0), (900.0, 1.0)];
        let found = emitted(&white);
        assert!(near(found, [1.20488, 0.948228, 0.909267], 0.01), "{found}");
        let bent = [(400.0, 1.0), (550.0, 2.0), (700.0, 3.0)];
        let found = emitted(&bent);
        assert!(near(found, [3.08031, 1.85896, 1.13084], 0.01), "{found}");
        // Control: the light of one is not that of the other.
        assert!(!near(emitted(&bent), [1.20488, 0.948228, 0.909267], 0.01));
    }

    #[test]
    fn black_bodies_go_from_red_to_blue() {
        let colors = [1500.0, 3000.0, 6500.0, 12000.0].map(|kelvin| blackbody(kelvin).unwrap());
        let ratios = colors.map(|color| color.z / color.x);
        assert!(ratios.windows(2).all(|pair| pair[0] < pair[1]), "{ratios:?}");
        // 6500 K is nearly the white of the colour space.
        assert!(near(colors[2], [1.0; 3], 0.06), "{}", colors[2]);
        assert!(
            colors.iter().all(|color| (color.dot(DVec3::new(0.2126, 0.7152, 0.0722)) - 1.0).abs() < 1e-9)
        );
        assert!(blackbody(0.0).is_none() && blackbody(f64::NAN).is_none());
    }

    #[test]
    fn samples_are_interpolated_and_end() {
        let samples = [(400.0, 1.0), (500.0, 3.0)];
        assert_eq!([399.0, 400.0, 450.0, 500.0, 501.0].map(|l| at(&samples, l)), [0.0, 1.0, 2.0, 3.0, 0.0]);
        assert_eq!(at(&[], 500.0), 0.0);
        assert_eq!(at(&[(500.0, 1.0), (500.0, 2.0)], 500.0), 1.0);
    }
}
