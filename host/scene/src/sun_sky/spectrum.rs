//! Wavelengths of the sky, and their colours: the spectra of the sun and of ozone, and the weights
//! that make linear Rec. 709 of them.

use libm::exp;
use std::sync::LazyLock;

/// Number of wavelengths at which light is transported.
pub(super) const WAVELENGTHS: usize = 16;
/// First of the wavelengths in nanometres.
const FIRST: f64 = 400.0;
/// Distance of neighbouring wavelengths in nanometres.
const STEP: f64 = 20.0;
/// Centre of the first bin of the tables in nanometres.
const FIRST_BIN: f64 = 365.0;
/// Width of the bins of the tables in nanometres.
const BIN: f64 = 10.0;
/// Number of bins of the tables.
const BINS: usize = 36;

/// Irradiance of the sun outside the atmosphere, at its mean distance, in W m⁻² nm⁻¹: means over
/// bins of 10 nm from 360 nm on (ASTM G173-03, extraterrestrial spectrum).
const SOLAR: [f64; BINS] = [
    1.11776, 1.14259, 1.01249, 1.14716, 1.72765, 1.73054, 1.6887, 1.61253, 1.91198, 2.03474, 2.02042,
    2.02212, 1.93377, 1.95809, 1.91686, 1.8298, 1.8685, 1.8931, 1.85149, 1.8504, 1.8341, 1.8345, 1.8147,
    1.78158, 1.7533, 1.6965, 1.68194, 1.64654, 1.6048, 1.52143, 1.55622, 1.5113, 1.474, 1.4482, 1.41018,
    1.36775,
];

/// Absorption cross section of ozone at 233 K in 1e-25 m²: means over the same bins (Serdyuchenko
/// et al., Atmospheric Measurement Techniques 7, 2014).
const OZONE: [f64; BINS] = [
    0.0118, 0.002182, 0.002818, 0.006636, 0.01527, 0.02763, 0.0552, 0.08451, 0.1582, 0.2316, 0.3669, 0.4924,
    0.7752, 0.9016, 1.48, 1.602, 2.139, 2.755, 3.091, 3.5, 4.266, 4.672, 4.398, 4.701, 5.019, 4.305, 3.74,
    3.215, 2.662, 2.238, 1.852, 1.473, 1.209, 0.9423, 0.7455, 0.6566,
];

/// A number for each wavelength.
pub(super) type Spectrum = [f64; WAVELENGTHS];

/// Returns wavelength `index` in nanometres.
pub(super) fn wavelength(index: usize) -> f64 {
    FIRST + STEP * index as f64
}

/// Returns the centre of a bin of the tables in nanometres.
fn bin_centre(bin: usize) -> f64 {
    FIRST_BIN + BIN * bin as f64
}

/// Returns the share of wavelength `index` in the interpolated spectrum at `lambda` nanometres. The
/// first and the last wavelength stand for all beyond them.
fn share(index: usize, lambda: f64) -> f64 {
    let place = ((lambda - FIRST) / STEP).clamp(0.0, (WAVELENGTHS - 1) as f64);
    (1.0 - (place - index as f64).abs()).max(0.0)
}

/// Returns the absorption cross section of ozone at each wavelength in m², averaged over the
/// wavelength's share.
pub(super) fn ozone_cross_section() -> Spectrum {
    std::array::from_fn(|index| {
        let shares = || (0..BINS).map(|bin| (share(index, bin_centre(bin)), OZONE[bin]));
        let sum: f64 = shares().map(|(share, value)| share * value).sum();
        sum / shares().map(|(share, _)| share).sum::<f64>() * 1e-25
    })
}

/// Returns the CIE 1931 colour matching functions: the fits of Wyman, Sloan and Shirley, Journal of
/// Computer Graphics Techniques 2(2), 2013, section 2.2.
fn color_matching(lambda: f64) -> [f64; 3] {
    let lobe = |height: f64, centre: f64, below: f64, above: f64| {
        let t = (lambda - centre) / if lambda < centre { below } else { above };
        height * exp(-0.5 * t * t)
    };
    [
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    ]
}

/// Returns linear Rec. 709 of a colour in CIE XYZ (IEC 61966-2-1).
fn rec_709([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    ]
}

/// Colour of the sun's light at each wavelength: the sum of a spectrum times these weights is the
/// colour of sunlight that the spectrum filters. Light of the same power at all wavelengths, 1 W
/// m⁻² nm⁻¹, has luminance 1.
static COLORS: LazyLock<[[f64; 3]; WAVELENGTHS]> = LazyLock::new(|| {
    let luminance: f64 = (0..BINS).map(|bin| color_matching(bin_centre(bin))[1]).sum();
    std::array::from_fn(|index| {
        let mut xyz = [0.0; 3];
        for (bin, solar) in SOLAR.iter().enumerate() {
            let lambda = bin_centre(bin);
            let weight = solar * share(index, lambda) / luminance;
            for (sum, response) in xyz.iter_mut().zip(color_matching(lambda)) {
                *sum += weight * response;
            }
        }
        rec_709(xyz)
    })
});

/// Returns the colour of sunlight that a spectrum filters, in linear Rec. 709.
pub(super) fn sunlight(filter: &Spectrum) -> [f64; 3] {
    let mut color = [0.0; 3];
    for (weight, filter) in COLORS.iter().zip(filter) {
        for (sum, weight) in color.iter_mut().zip(weight) {
            *sum += weight * filter;
        }
    }
    color
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sunlight_outside_the_atmosphere_is_nearly_white() {
        let [r, g, b] = sunlight(&[1.0; WAVELENGTHS]);
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        // 133.1 klx (Darula, Kittler and Gueymard, Solar Energy 79, 2005) over 72,983 lm/W nm.
        assert!((luminance / (133_100.0 / 72_983.0) - 1.0).abs() < 0.01, "{luminance}");
        assert!(r / g > 1.0 && r / g < 1.15 && b / g > 0.9 && b / g < 1.1, "{r} {g} {b}");
    }

    #[test]
    fn shares_of_a_wavelength_sum_to_1() {
        for bin in 0..BINS {
            let sum: f64 = (0..WAVELENGTHS).map(|index| share(index, bin_centre(bin))).sum();
            assert!((sum - 1.0).abs() < 1e-12);
        }
    }
}
