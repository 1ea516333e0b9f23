//! Radiance of the clear sky: light along a ray through the curved atmosphere.

use super::SunSky;
use super::air::{
    AEROSOL_ALBEDO, Air, EARTH, aerosol_phase, air_phase, altitude_at, density, direction, distance_to_top,
};
use super::scattering::{Directions, Scattered};
use super::spectrum::{Spectrum, WAVELENGTHS, sunlight};
use glam::DVec3;
use libm::exp;
use std::f64::consts::PI;

/// Number of steps along a ray.
const STEPS: usize = if cfg!(fuzzing) { 2 } else { 64 };
/// Intervals of the table between the horizon and straight up, the narrower the lower.
const HEIGHTS: usize = 64;
/// Intervals of the table between the azimuth of the sun and its opposite.
const AZIMUTHS: usize = 32;
/// Heights of the sun, in degrees from that at the observer, for which scattered light is computed:
/// far along a ray the sun stands higher or lower.
const SUNS: [f64; 3] = [-3.0, 0.0, 3.0];

/// Radiance along a ray, without the phase functions, which are steep near the sun.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Parts {
    /// Sunlight scattered once by air, over its phase function.
    air: DVec3,
    /// Sunlight scattered once by aerosol, over its phase function.
    aerosol: DVec3,
    /// Light scattered more than once.
    more: DVec3,
}

impl Parts {
    fn lerp(self, other: Self, t: f64) -> Self {
        let mix = |a: DVec3, b: DVec3| a + (b - a) * t;
        Self {
            air: mix(self.air, other.air),
            aerosol: mix(self.aerosol, other.aerosol),
            more: mix(self.more, other.more),
        }
    }

    fn radiance(&self, cosine: f64) -> DVec3 {
        let sum = self.air * air_phase(cosine) + self.aerosol * aerosol_phase(cosine) + self.more;
        // A blue that Rec. 709 does not have is cut off.
        sum.max(DVec3::ZERO)
    }
}

/// Clear sky of a sun over -z.
#[derive(Debug)]
pub(super) struct ClearSky {
    /// Unit vector towards the sun.
    sun: DVec3,
    /// Irradiance of a surface that faces the sun, in linear Rec. 709, without the sky's.
    pub sun_irradiance: DVec3,
    /// Parts by height, from the horizon up, and by azimuth from the sun's.
    table: Vec<Parts>,
}

/// Air, and the light in it, that a ray passes.
struct Medium<'a> {
    air: &'a Air,
    /// Height of the sun in radians.
    sun: f64,
    /// Scattered light under a sun of the heights [`SUNS`].
    scattered: [Scattered; 3],
}

impl ClearSky {
    /// Computes the sky.
    pub fn new(sky: &SunSky) -> Self {
        let air = Air::new(sky.turbidity);
        let directions = Directions::new();
        let height = sky.elevation.to_radians();
        let scattered = SUNS.map(|degrees| {
            let sine = libm::sin((height + degrees.to_radians()).min(0.5 * PI));
            Scattered::new(&air, &directions, sine, sky.ground_albedo)
        });
        let medium = Medium { air: &air, sun: height, scattered };
        let mut table = Vec::with_capacity((HEIGHTS + 1) * (AZIMUTHS + 1));
        for row in 0..=HEIGHTS {
            let t = row as f64 / HEIGHTS as f64;
            for column in 0..=AZIMUTHS {
                table.push(medium.along(0.5 * PI * t * t, PI * column as f64 / AZIMUTHS as f64));
            }
        }
        Self { sun: direction(height, 0.0), sun_irradiance: sun_irradiance(&air, height), table }
    }

    /// Returns the radiance from a unit direction above the horizon, in linear Rec. 709.
    pub fn radiance(&self, toward: DVec3) -> DVec3 {
        let height = libm::asin(toward.y.clamp(0.0, 1.0));
        let row = (height / (0.5 * PI)).sqrt() * HEIGHTS as f64;
        let azimuth = libm::atan2(toward.x.abs(), -toward.z).abs();
        let column = azimuth / PI * AZIMUTHS as f64;
        let (i, j) = ((row as usize).min(HEIGHTS - 1), (column as usize).min(AZIMUTHS - 1));
        let across = |row: usize| {
            let first = row * (AZIMUTHS + 1) + j;
            self.table[first].lerp(self.table[first + 1], column - j as f64)
        };
        across(i).lerp(across(i + 1), row - i as f64).radiance(toward.dot(self.sun))
    }

    /// Returns the unit vector towards the sun.
    pub fn sun(&self) -> DVec3 {
        self.sun
    }
}

/// Returns the irradiance of a surface on the ground that faces the sun at this height in radians,
/// without the sky's.
pub(super) fn sun_irradiance(air: &Air, height: f64) -> DVec3 {
    let passed = air.sunlight_at(0.0, libm::sin(height)).unwrap_or([0.0; WAVELENGTHS]);
    DVec3::from(sunlight(&passed)).max(DVec3::ZERO)
}

impl Medium<'_> {
    /// Returns the light along a ray at this height above the horizon, and this angle from the sun
    /// about the vertical, in radians.
    fn along(&self, height: f64, azimuth: f64) -> Parts {
        let toward = direction(height, azimuth);
        let sun = direction(self.sun, 0.0);
        let length = distance_to_top(0.0, toward.y);
        let mut passed = [1.0; WAVELENGTHS];
        let [mut by_air, mut by_aerosol, mut more]: [Spectrum; 3] = [[0.0; WAVELENGTHS]; 3];
        for step in 0..STEPS {
            // Steps are the longer, the farther they are.
            let square = |i: usize| (i * i) as f64 / (STEPS * STEPS) as f64;
            let (from, to) = (length * square(step), length * square(step + 1));
            let middle = 0.5 * (from + to);
            let point = DVec3::new(0.0, EARTH, 0.0) + toward * middle;
            let (up, altitude) = (point.normalize(), altitude_at(0.0, toward.y, middle));
            let (sun_sine, sine) = (up.dot(sun), up.dot(toward));
            let here = density(altitude);
            let sunlit = self.air.sunlight_at(altitude, sun_sine);
            let (low, place, t) = {
                let place = (libm::asin(sun_sine.clamp(-1.0, 1.0)) - self.sun).to_degrees();
                let low = if place < 0.0 { 0 } else { 1 };
                let t = ((place - SUNS[low]) / (SUNS[low + 1] - SUNS[low])).clamp(0.0, 1.0);
                (low, self.scattered[low].place(altitude, sine, azimuth), t)
            };
            for index in 0..WAVELENGTHS {
                let depths = self.air.depths[index];
                let air = depths[0] * here[0];
                let aerosol = depths[1] * here[1];
                let extinction = air + aerosol + depths[2] * here[2];
                let depth = extinction * (to - from);
                let pass = exp(-depth);
                // The light that this step adds for a source of 1 per kilometre.
                let gain = if depth < 1e-6 { to - from } else { (1.0 - pass) / extinction };
                let gain = gain * passed[index];
                if let Some(sunlight) = &sunlit {
                    by_air[index] += gain * air * sunlight[index];
                    by_aerosol[index] += gain * AEROSOL_ALBEDO * aerosol * sunlight[index];
                }
                let source = |sun: usize| self.scattered[sun].source(index, &place);
                more[index] += gain * extinction * (source(low) + (source(low + 1) - source(low)) * t);
                passed[index] *= pass;
            }
        }
        let color = |spectrum| DVec3::from(sunlight(spectrum));
        Parts { air: color(&by_air), aerosol: color(&by_aerosol), more: color(&more) }
    }
}
