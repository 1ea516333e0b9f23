//! Clear sky with the sun, computed from the physics of the atmosphere.
//!
//! Sunlight is scattered by air, scattered and absorbed by haze, and absorbed by ozone, at sixteen
//! wavelengths: once along rays through curved air ([`radiance`]), and more than once in plane
//! layers ([`scattering`]). The result is a panorama with the sun over its middle column.
//!
//! Sines, exponentials and powers are those of the crate libm: they have the same bits on all
//! machines.

mod air;
mod disc;
mod grid;
mod panorama;
mod quadrature;
mod radiance;
mod scattering;
mod spectrum;

#[cfg(test)]
mod tests;

use crate::ranges::all;
use crate::values::{Elevation, Gain, Share, SunRadius, Turbidity};
use glam::DVec3;
use std::sync::{Arc, OnceLock};
use trisect_image::Image;

/// Clear sky with the sun.
///
/// Radiance is in W m⁻² sr⁻¹ nm⁻¹, in linear Rec. 709: light of the same power at all wavelengths,
/// 1 W m⁻² sr⁻¹ nm⁻¹, has luminance 1, which is 72,983 cd/m².
///
/// ```
/// use trisect_scene::builder::{SceneBuilder, SunSky};
///
/// let mut scene = SceneBuilder::new();
/// scene.sky(SunSky { turbidity: 4.0, ..SunSky::new(120.0, 35.0) });
/// # let _ = scene;
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunSky {
    /// Azimuth of the sun in degrees: 0 is -z, 90 is +x, clockwise seen from above.
    pub azimuth: f64,
    /// Height of the sun above the horizon in degrees, 0 to 90.
    pub elevation: f64,
    /// Turbidity, 1 to 10: the ratio of the optical depths of air with haze and of air alone. 2 is
    /// very clear, 3 clear, 6 hazy.
    pub turbidity: f64,
    /// Share of light that the ground reflects, 0 to 1: it lights the sky, and is what is seen
    /// below the horizon.
    pub ground_albedo: f64,
    /// True if the sun's disc is part of the sky.
    pub sun_disc: bool,
    /// Angular radius of the disc in degrees, 0.2 to 5. A larger disc is dimmer: the irradiance is
    /// that of the sun.
    pub sun_radius: f64,
    /// Factor on all radiance.
    pub scale: f64,
}

impl SunSky {
    /// Default turbidity: a clear sky.
    pub const DEFAULT_TURBIDITY: f64 = 3.0;
    /// Default albedo of the ground.
    pub const DEFAULT_GROUND_ALBEDO: f64 = 0.3;
    /// Default angular radius of the disc in degrees: that of the sun at its mean distance.
    pub const DEFAULT_SUN_RADIUS: f64 = 0.2665;

    /// Returns the sky of a sun at this azimuth and elevation, in degrees, with defaults for all
    /// else.
    pub fn new(azimuth: f64, elevation: f64) -> Self {
        Self {
            azimuth,
            elevation,
            turbidity: Self::DEFAULT_TURBIDITY,
            ground_albedo: Self::DEFAULT_GROUND_ALBEDO,
            sun_disc: true,
            sun_radius: Self::DEFAULT_SUN_RADIUS,
            scale: 1.0,
        }
    }

    /// Returns the sky of a sun in this direction, of any length but 0, with defaults for all else.
    /// A direction below the horizon has a negative elevation, which is refused when the scene is
    /// built.
    pub fn toward(direction: impl Into<DVec3>) -> Self {
        let (azimuth, elevation) = angles(direction.into());
        Self::new(azimuth, elevation)
    }

    /// Returns the luminance of the irradiance of a surface that faces the sun, in W m⁻² nm⁻¹ (see
    /// above), of the whole disc, at scale 1.
    pub(crate) fn sun_luminance(&self) -> f64 {
        let color = radiance::sun_irradiance(&air::Air::new(self.turbidity), self.elevation.to_radians());
        color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
    }

    /// Checks that each number is finite and in range.
    pub(crate) fn check(&self) -> Result<(), String> {
        if !self.azimuth.is_finite() {
            return Err(format!("azimuth: {} is not finite", self.azimuth));
        }
        all::<Elevation>("elevation", &[self.elevation])?;
        all::<Turbidity>("turbidity", &[self.turbidity])?;
        all::<Share>("ground_albedo", &[self.ground_albedo])?;
        all::<SunRadius>("sun_radius", &[self.sun_radius])?;
        all::<Gain>("scale", &[self.scale])
    }
}

/// Returns azimuth and elevation of a direction in degrees; those of straight up are 0 and 90.
pub(crate) fn angles(direction: DVec3) -> (f64, f64) {
    let along = libm::hypot(direction.x, direction.z);
    let azimuth = if along > 0.0 { libm::atan2(direction.x, -direction.z).to_degrees() } else { 0.0 };
    (azimuth, libm::atan2(direction.y, along).to_degrees())
}

/// A clear sky with its panorama, which is computed when it is first asked for. Copies share it.
#[derive(Clone, Debug)]
pub struct SunSkyPanorama {
    sky: SunSky,
    panorama: Arc<OnceLock<Image>>,
}

impl SunSkyPanorama {
    /// Returns the parameters of the sky.
    pub fn parameters(&self) -> SunSky {
        self.sky
    }

    /// Returns the panorama, without the sky's scale, and its rotation about +y in radians.
    pub(crate) fn panorama(&self) -> (&Image, f64) {
        (self.panorama.get_or_init(|| panorama::build(&self.sky)), -self.sky.azimuth.to_radians())
    }
}

impl From<SunSky> for SunSkyPanorama {
    fn from(sky: SunSky) -> Self {
        Self { sky, panorama: Arc::default() }
    }
}
