//! Directions and solid angles of the texels of a panorama.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Size of a panorama, which decides the directions of its texels. Both are even.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub width: u32,
    pub height: u32,
}

impl Grid {
    /// Returns the direction in which a place is seen, in texels from the left and the top.
    pub fn direction(self, x: f64, y: f64) -> DVec3 {
        let polar = PI * y / f64::from(self.height);
        // The middle column is seen along -z, those right of it towards +x.
        let azimuth = TAU * (x / f64::from(self.width) - 0.5);
        let (across, up) = (libm::sin(polar), libm::cos(polar));
        DVec3::new(across * libm::sin(azimuth), up, -across * libm::cos(azimuth))
    }

    /// Returns the solid angle of a texel of this row: the integral of its share in the
    /// interpolated panorama, which repeats its first and last row up to the poles.
    pub fn solid_angle(self, y: u32) -> f64 {
        let step = PI / f64::from(self.height);
        let centre = (f64::from(y) + 0.5) * step;
        // Integral of a ramp from 0 at `a` to 1 at `b`, times the sine.
        let ramp = |a: f64, b: f64| (libm::sin(b) - libm::sin(a)) / (b - a) - libm::cos(b);
        let above = if y == 0 { 1.0 - libm::cos(centre) } else { ramp(centre - step, centre) };
        let mirrored = PI - centre;
        let below =
            if y + 1 == self.height { 1.0 - libm::cos(mirrored) } else { ramp(mirrored - step, mirrored) };
        (above + below) * TAU / f64::from(self.width)
    }
}
