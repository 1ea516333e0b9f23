//! Indices of refraction of metals and glasses by name.

use glam::DVec3;

/// Index of refraction of metals and other conductors: name, real part, imaginary part, for red,
/// green and blue.
///
/// The spectra are those of the SOPRA database and of Palik's handbook, as Mitsuba 3.9.1 reduces
/// them to linear Rec. 709 in its variants for RGB.
const METALS: &[(&str, [f64; 3], [f64; 3])] = &[
    ("a-C", [2.94405, 2.22714, 1.96816], [0.887465, 0.799299, 0.81529]),
    ("Ag", [0.155276, 0.116728, 0.138388], [4.82835, 3.12222, 2.1469]),
    ("Al", [1.6575, 0.880405, 0.521244], [9.22381, 6.2695, 4.837]),
    ("AlAs", [3.6053, 3.23294, 2.21632], [0.000679437, 0.0, 0.00751271]),
    ("AlSb", [1e-06, 4.13937, 4.66925], [0.0, 0.0940091, 1.30057]),
    ("Au", [0.143036, 0.375307, 1.44205], [3.983, 2.38556, 1.60336]),
    ("Be", [4.18501, 3.18503, 2.78406], [3.83547, 3.01012, 2.86899]),
    ("Cr", [4.36967, 2.91651, 1.6549], [5.20655, 4.23131, 3.7547]),
    ("CsI", [2.1449, 1.70232, 1.66243], [0.0, 0.0, 0.0]),
    ("Cu", [0.201005, 0.92375, 1.10222], [3.91326, 2.45305, 2.14209]),
    ("Cu2O", [3.55177, 2.94987, 2.75188], [0.114207, 0.193897, 0.606134]),
    ("CuO", [3.24754, 2.44781, 2.21022], [0.52109, 0.570031, 0.722179]),
    ("d-C", [2.70872, 2.31883, 2.2289], [0.0, 0.0, 0.0]),
    ("Hg", [2.39894, 1.44003, 0.90957], [6.32759, 4.37192, 3.42176]),
    ("HgTe", [4.77904, 3.2312, 2.6599], [1.63161, 1.58081, 1.72929]),
    ("Ir", [3.0863, 2.08219, 1.61791], [5.59215, 4.06709, 3.26731]),
    ("K", [0.0640432, 0.0464098, 0.0381849], [2.1042, 1.34894, 0.913126]),
    ("Li", [0.265791, 0.195618, 0.220949], [3.54015, 2.31112, 1.66861]),
    ("MgO", [2.08958, 1.65072, 1.59488], [0.0, 0.0, 0.0]),
    ("Mo", [4.48397, 3.52513, 2.77631], [4.11144, 3.42083, 3.15061]),
    ("Na_palik", [0.0602694, 0.0561409, 0.0619884], [3.17927, 2.11249, 1.57904]),
    ("Nb", [3.42007, 2.79009, 2.39563], [3.44139, 2.73767, 2.57975]),
    ("Rh", [2.58579, 1.86022, 1.55426], [6.78226, 4.70299, 3.97607]),
    ("Se", [4.05831, 2.84294, 2.82085], [0.75405, 0.638444, 0.521808]),
    ("SiC", [3.17234, 2.52597, 2.47937], [0.0, 0.0, 1.01925e-05]),
    ("SnTe", [4.52425, 1.98164, 1.28159], [0.0, 0.0, 0.0]),
    ("Ta", [2.06272, 2.39294, 2.62793], [2.40836, 1.74149, 1.94703]),
    ("Te", [7.39023, 4.4821, 2.63711], [3.25602, 3.52706, 3.29205]),
    ("ThF4", [1.83071, 1.44223, 1.38765], [0.0, 0.0, 0.0]),
    ("TiC", [3.70053, 2.83742, 2.58229], [3.26564, 2.35159, 2.17279]),
    ("TiN", [1.64845, 1.15052, 1.37982], [3.36833, 1.9435, 1.10207]),
    ("TiO2", [3.45661, 2.80174, 2.90517], [0.000105265, 0.0, 0.000652887]),
    ("VC", [3.65757, 2.75274, 2.53267], [3.0683, 2.19869, 1.96319]),
    ("V_palik", [4.27758, 3.51295, 2.76107], [3.4913, 2.88945, 3.11152]),
    ("VN", [2.8656, 2.11919, 1.94009], [3.03224, 2.05612, 1.61631]),
    ("W", [4.37082, 3.30025, 2.99841], [3.50064, 2.60487, 2.27323]),
    // Brass with 70 % copper, which pbrt names so.
    ("CuZn", [0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
];

/// Index of refraction at 587.6 nm of glasses and other transparent matter: names of pbrt, then
/// those of Mitsuba.
const GLASSES: &[(&str, f64)] = &[
    ("glass-BK7", 1.5168),
    ("glass-BAF10", 1.67),
    ("glass-FK51A", 1.4866),
    ("glass-LASF9", 1.8503),
    ("glass-F5", 1.6034),
    ("glass-F10", 1.6232),
    ("glass-F11", 1.6206),
    ("glass-SF5", 1.6727),
    ("glass-SF10", 1.7283),
    ("glass-SF11", 1.7847),
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// Returns real and imaginary part of a metal's index of refraction.
pub fn metal(name: &str) -> Option<(DVec3, DVec3)> {
    let (_, eta, k) = METALS.iter().find(|metal| metal.0 == name)?;
    Some((DVec3::from(*eta), DVec3::from(*k)))
}

/// Returns the index of refraction of a glass.
pub fn glass(name: &str) -> Option<f64> {
    GLASSES.iter().find(|glass| glass.0 == name).map(|glass| glass.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reflectance of gold, silver and copper at normal incidence: gold and copper are red, silver
    /// is nearly white.
    #[test]
    fn metals_have_their_colours() {
        let reflectance = |name: &str| {
            let (eta, k) = metal(name).unwrap();
            ((eta - 1.0) * (eta - 1.0) + k * k) / ((eta + 1.0) * (eta + 1.0) + k * k)
        };
        let [gold, silver, copper] = ["Au", "Ag", "Cu"].map(reflectance);
        assert!(gold.x > 0.95 && gold.z < 0.45 && copper.x > 0.9 && copper.z < 0.6, "{gold} {copper}");
        assert!(silver.min_element() > 0.88, "{silver}");
        assert!(metal("Unobtainium").is_none());
    }

    #[test]
    fn names_are_unique_and_numbers_are_in_range() {
        for (index, (name, eta, k)) in METALS.iter().enumerate() {
            assert!(METALS[..index].iter().all(|other| other.0 != *name), "{name}");
            assert!(
                eta.iter().all(|x| (1e-6..=1e3).contains(x)) && k.iter().all(|x| (0.0..=1e3).contains(x))
            );
        }
        assert!(GLASSES.iter().all(|glass| (1.0..=3.0).contains(&glass.1)));
        assert_eq!(glass("bk7"), Some(1.5046));
    }
}
