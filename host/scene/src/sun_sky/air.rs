//! The atmosphere: how much of it lies along a ray, and how much light it scatters and absorbs.
//!
//! Three kinds of particles, each with a profile over the altitude: air (Rayleigh scattering),
//! aerosol (haze) and ozone. Lengths are in kilometres.

use super::quadrature::Gauss;
use super::spectrum::{Spectrum, WAVELENGTHS, ozone_cross_section, wavelength};
use glam::DVec3;
use libm::{exp, pow};
use std::sync::LazyLock;

/// Radius of the Earth.
pub(super) const EARTH: f64 = 6371.0;
/// Altitude above which there is no air.
pub(super) const TOP: f64 = 80.0;
/// Altitude over which the density of air falls by the factor e.
const AIR_HEIGHT: f64 = 8.0;
/// Altitude over which the density of aerosol falls by the factor e (Bruneton and Neyret, Computer
/// Graphics Forum 27(4), 2008).
const AEROSOL_HEIGHT: f64 = 1.2;
/// Altitude of the most ozone; its density falls linearly to 0 at [`OZONE_SPREAD`] from it.
const OZONE_PEAK: f64 = 25.0;
/// Half the thickness of the layer of ozone.
const OZONE_SPREAD: f64 = 15.0;
/// Molecules of ozone over a square metre: 300 Dobson units.
const OZONE_COLUMN: f64 = 300.0 * 2.687e20;
/// Share of extinction by aerosol that is scattering: continental average at 550 nm and 80 %
/// humidity (Hess, Koepke and Schult, Bulletin of the American Meteorological Society 79, 1998,
/// table 4).
pub(super) const AEROSOL_ALBEDO: f64 = 0.925;
/// Lobes of the phase function of aerosol, forward and back: their asymmetries, and the share of
/// the first. Their mean cosine is 0.703, as in the same source. Light scattered straight back is
/// 1/57 sr⁻¹ of extinction: Müller et al. (Journal of Geophysical Research 112, 2007) measured 1/53
/// with a spread of 11 over Central Europe.
const AEROSOL_LOBES: [f64; 2] = [0.75, -0.4];
const FORWARD: f64 = 0.959;
/// Number of points of an integral along a ray.
const POINTS: usize = 24;

/// Amounts of air, aerosol and ozone along a ray, each relative to that of a vertical ray from the
/// ground.
pub(super) type Column = [f64; 3];

/// Returns the density of each kind of particle at an altitude, per kilometre: its integral over
/// all altitudes is 1.
pub(super) fn density(altitude: f64) -> Column {
    let ozone = (1.0 - (altitude - OZONE_PEAK).abs() / OZONE_SPREAD).max(0.0) / OZONE_SPREAD;
    [exp(-altitude / AIR_HEIGHT) / AIR_HEIGHT, exp(-altitude / AEROSOL_HEIGHT) / AEROSOL_HEIGHT, ozone]
}

/// Returns the amount of each kind of particle between two altitudes, straight up.
pub(super) fn between(low: f64, high: f64) -> Column {
    let exponential = |height: f64| exp(-low / height) - exp(-high / height);
    let below = |altitude: f64| {
        let t = ((altitude - OZONE_PEAK) / OZONE_SPREAD).clamp(-1.0, 1.0);
        0.5 + t - 0.5 * t * t.abs()
    };
    [exponential(AIR_HEIGHT), exponential(AEROSOL_HEIGHT), below(high) - below(low)]
}

/// Returns the distance from a point at `altitude` to the end of the atmosphere, along a ray with
/// this cosine from straight up.
pub(super) fn distance_to_top(altitude: f64, cosine: f64) -> f64 {
    let (radius, top) = (EARTH + altitude, EARTH + TOP);
    let along = radius * cosine;
    // (top² - radius²) + along² is positive below the top.
    let root = ((TOP - altitude) * (top + radius) + along * along).max(0.0).sqrt();
    if along > 0.0 { (TOP - altitude) * (top + radius) / (along + root) } else { root - along }
}

/// Returns the altitude at a distance along a ray from `altitude` with this cosine from straight
/// up.
pub(super) fn altitude_at(altitude: f64, cosine: f64, distance: f64) -> f64 {
    let radius = EARTH + altitude;
    let more = distance * (distance + 2.0 * radius * cosine);
    altitude + more / ((radius * radius + more).max(0.0).sqrt() + radius)
}

/// Returns the amount of each kind of particle from a point to the end of the atmosphere along a
/// ray; `None` if the ray meets the Earth.
pub(super) fn column_to_top(altitude: f64, cosine: f64) -> Option<Column> {
    static GAUSS: LazyLock<Gauss<POINTS>> = LazyLock::new(Gauss::new);
    let radius = EARTH + altitude;
    if cosine < 0.0 && radius * radius * (1.0 - cosine * cosine) < EARTH * EARTH {
        return None;
    }
    // Below its horizon a ray passes a lowest point: from there on it is one that rises.
    let lowest = if cosine < 0.0 { -radius * cosine } else { 0.0 };
    let end = distance_to_top(altitude, cosine);
    let mut column = [0.0; 3];
    // Points are the closer together, the lower they are.
    let mut add = |from: f64, length: f64| {
        for (s, weight) in GAUSS.points() {
            let (distance, step) = (from + length * s * s, length.abs() * 2.0 * s * weight);
            let here = density(altitude_at(altitude, cosine, distance).max(0.0));
            column.iter_mut().zip(here).for_each(|(sum, density)| *sum += density * step);
        }
    };
    add(lowest, end - lowest);
    if lowest > 0.0 {
        add(lowest, -lowest);
    }
    Some(column)
}

/// The phase function of air per steradian, of the cosine of the angle of deflection.
pub(super) fn air_phase(cosine: f64) -> f64 {
    3.0 / (16.0 * std::f64::consts::PI) * (1.0 + cosine * cosine)
}

/// The phase function of aerosol per steradian: two lobes of Henyey and Greenstein (Astrophysical
/// Journal 93, 1941).
pub(super) fn aerosol_phase(cosine: f64) -> f64 {
    let lobe = |g: f64| {
        let base = 1.0 + g * g - 2.0 * g * cosine;
        (1.0 - g * g) / (4.0 * std::f64::consts::PI * base * base.sqrt())
    };
    FORWARD * lobe(AEROSOL_LOBES[0]) + (1.0 - FORWARD) * lobe(AEROSOL_LOBES[1])
}

/// Optical depths of the whole atmosphere, straight up, by wavelength.
#[derive(Clone, Debug)]
pub(super) struct Air {
    /// Air, aerosol and ozone, at each wavelength.
    pub depths: [Column; WAVELENGTHS],
}

impl Air {
    /// Returns the atmosphere of this turbidity: the ratio of the optical depths of air with
    /// aerosol and of air alone.
    ///
    /// Air: Hansen and Travis, Space Science Reviews 16, 1974, equation 2.30, at 1013.25 hPa.
    /// Aerosol by turbidity: Preetham, Shirley and Smits, SIGGRAPH 1999, appendix A.2 (Ångström's
    /// formula with exponent 1.3).
    pub fn new(turbidity: f64) -> Self {
        let beta = (0.04608 * turbidity - 0.04586).max(0.0);
        let ozone = ozone_cross_section();
        let depths = std::array::from_fn(|index| {
            let micrometres = wavelength(index) * 1e-3;
            let inverse = 1.0 / (micrometres * micrometres);
            let air = 0.008569 * inverse * inverse * (1.0 + 0.0113 * inverse + 0.00013 * inverse * inverse);
            [air, beta * pow(micrometres, -1.3), OZONE_COLUMN * ozone[index]]
        });
        Self { depths }
    }

    /// Returns the share of light that passes a column, by wavelength.
    pub fn transmittance(&self, column: Column) -> Spectrum {
        self.depths
            .map(|depths| exp(-(depths[0] * column[0] + depths[1] * column[1] + depths[2] * column[2])))
    }

    /// Returns the share of light that reaches a point from infinity, by wavelength; `None` if the
    /// Earth is in between.
    pub fn sunlight_at(&self, altitude: f64, cosine: f64) -> Option<Spectrum> {
        column_to_top(altitude, cosine).map(|column| self.transmittance(column))
    }
}

/// Returns the unit vector at this height above the horizon and this angle from the sun about the
/// vertical, in radians: y is up, and the sun is over -z.
pub(super) fn direction(elevation: f64, azimuth: f64) -> DVec3 {
    let (up, along) = (libm::sin(elevation), libm::cos(elevation));
    DVec3::new(along * libm::sin(azimuth), up, -along * libm::cos(azimuth))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of curved air, relative to a vertical one: air masses of Kasten and Young (Applied
    /// Optics 28, 1989), within 2 %, and 5 % at 2 degrees, where refraction, which is left
    /// out, matters.
    #[test]
    fn air_masses_are_the_published_ones() {
        for (elevation, mass, error) in [
            (90.0, 1.0, 1e-3),
            (30.0, 1.9939, 0.01),
            (10.0, 5.5841, 0.01),
            (5.0, 10.3164, 0.02),
            (2.0, 19.4, 0.05),
        ] {
            let cosine = libm::sin(f64::to_radians(elevation));
            let column = column_to_top(0.0, cosine).unwrap();
            assert!((column[0] / mass - 1.0).abs() < error, "{elevation}: {}", column[0]);
        }
    }

    #[test]
    fn vertical_columns_have_a_closed_form() {
        for altitude in [0.0, 0.5, 3.0, 12.0, 30.0, 79.0] {
            let (numeric, exact) = (column_to_top(altitude, 1.0).unwrap(), between(altitude, TOP));
            for (kind, (numeric, exact)) in numeric.iter().zip(exact).enumerate() {
                // The density of ozone has edges.
                let error = if kind == 2 { 0.03 } else { 1e-5 };
                assert!((numeric - exact).abs() < error * exact.max(0.1), "{altitude}: {numeric} {exact}");
            }
        }
        let all: f64 = between(0.0, TOP)[2];
        assert!((all - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_earth_casts_a_shadow() {
        assert!(column_to_top(0.0, 0.0).is_some() && column_to_top(0.0, -0.01).is_none());
        assert!(column_to_top(10.0, -0.01).is_some() && column_to_top(10.0, -0.1).is_none());
        // A ray below the horizon is as long as both of its halves.
        let (lowest, half) = (column_to_top(0.0, 0.0).unwrap(), 0.05);
        let high = altitude_at(0.0, 0.0, 300.0);
        let down = column_to_top(high, -300.0 / (EARTH + high)).unwrap();
        let up = column_to_top(high, 300.0 / (EARTH + high)).unwrap();
        assert!(
            (down[0] + up[0] - 2.0 * lowest[0]).abs() < half * 0.01 * lowest[0],
            "{down:?} {up:?} {lowest:?}"
        );
    }

    /// Depths at 550 nm: air 0.0973 (Hansen and Travis: 0.0972 to 0.0975); transmittance of a clear
    /// sky at the zenith.
    #[test]
    fn depths_are_the_published_ones() {
        let at = |turbidity: f64, lambda: f64| Air::new(turbidity).depths[((lambda - 400.0) / 20.0) as usize];
        let [air, aerosol, ozone] = at(3.0, 560.0);
        assert!((air - 0.0973 * (550f64 / 560.0).powi(4)).abs() < 5e-4, "{air}");
        assert!((aerosol - 0.09238 * 0.56f64.powf(-1.3)).abs() < 1e-4, "{aerosol}");
        // The Chappuis band peaks at about 0.039 near 600 nm for 300 DU.
        assert!((0.03..0.04).contains(&at(1.0, 600.0)[2]) && ozone < at(1.0, 600.0)[2], "{ozone}");
        assert!(at(1.0, 560.0)[1] < 5e-4);
    }

    #[test]
    fn phase_functions_have_integral_1() {
        let gauss = Gauss::<96>::new();
        for phase in [air_phase, aerosol_phase] {
            let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
                gauss.points().map(|(t, weight)| 2.0 * weight * f(2.0 * t - 1.0)).sum()
            };
            let all = 2.0 * std::f64::consts::PI * sum(&|c| phase(c));
            assert!((all - 1.0).abs() < 1e-9, "{all}");
        }
        let points = gauss.points().map(|(t, weight)| (2.0 * t - 1.0, 2.0 * weight));
        let mean: f64 =
            points.map(|(c, weight)| 2.0 * std::f64::consts::PI * weight * c * aerosol_phase(c)).sum();
        assert!((mean - 0.703).abs() < 5e-4, "{mean}");
        let lidar_ratio = 1.0 / (AEROSOL_ALBEDO * aerosol_phase(-1.0));
        assert!((lidar_ratio - 57.0).abs() < 1.0, "{lidar_ratio}");
    }
}
