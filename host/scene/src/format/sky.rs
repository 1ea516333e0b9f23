//! The field `sky` of a scene file.

use super::Name;
use crate::sun_sky::{SunSky, angles};
use crate::values::{Angle, Colour, Direction, Elevation, Gain, Share, SunRadius, Turbidity, some};
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// Radiance from infinity.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub enum Sky<'a> {
    /// No radiance.
    #[default]
    Black,
    /// Equal radiance from all directions.
    Uniform {
        /// Radiance from each direction.
        radiance: Colour,
    },
    /// Gradient from straight down to straight up, linear in the y of the unit direction.
    Gradient {
        /// Radiance straight down.
        bottom: Colour,
        /// Radiance straight up.
        top: Colour,
    },
    /// A panorama (environment map).
    Image {
        /// File name, relative to the scene file.
        #[serde(borrow)]
        file: Name<'a>,
        /// Factor on the file's radiance.
        #[serde(default = "default_gain")]
        scale: Gain,
        /// Rotation about +y, in degrees, counter-clockwise seen from above.
        #[serde(default = "default_rotation")]
        rotation: Angle,
    },
    /// The built-in panorama of a studio.
    Studio {
        /// Factor on its radiance.
        #[serde(default = "default_gain")]
        scale: Gain,
        /// Rotation about +y, in degrees, counter-clockwise seen from above.
        #[serde(default = "default_rotation")]
        rotation: Angle,
    },
    /// A clear sky with the sun, at `direction` or at `elevation` and `azimuth`.
    Sun {
        /// Height of the sun above the horizon, in degrees.
        #[serde(default, deserialize_with = "some")]
        elevation: Option<Elevation>,
        /// Azimuth of the sun, in degrees: 0 is -z, 90 is +x; default: 0.
        #[serde(default, deserialize_with = "some")]
        azimuth: Option<Angle>,
        /// Direction towards the sun.
        #[serde(default, deserialize_with = "some")]
        direction: Option<Direction>,
        /// Turbidity of the air.
        #[serde(default = "default_turbidity")]
        turbidity: Turbidity,
        /// Share of light that the ground reflects.
        #[serde(default = "default_ground_albedo")]
        ground_albedo: Share,
        /// True if the sun's disc is part of the sky.
        #[serde(default = "default_sun_disc")]
        sun_disc: bool,
        /// Angular radius of the disc, in degrees.
        #[serde(default = "default_sun_radius")]
        sun_radius: SunRadius,
        /// Factor on all radiance.
        #[serde(default = "default_gain")]
        scale: Gain,
    },
}

fn default_gain() -> Gain {
    Gain(1.0)
}

fn default_rotation() -> Angle {
    Angle(0.0)
}

fn default_turbidity() -> Turbidity {
    Turbidity(SunSky::DEFAULT_TURBIDITY)
}

fn default_ground_albedo() -> Share {
    Share(SunSky::DEFAULT_GROUND_ALBEDO)
}

fn default_sun_disc() -> bool {
    true
}

fn default_sun_radius() -> SunRadius {
    SunRadius(SunSky::DEFAULT_SUN_RADIUS)
}

impl<'de: 'a, 'a> Deserialize<'de> for Sky<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let sky = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        let Self::Sun { elevation, azimuth, direction, .. } = &sky else { return Ok(sky) };
        match (elevation, azimuth, direction) {
            (None, _, None) => Err(D::Error::custom(
                "Sun: no place of the sun; give its elevation and azimuth in degrees, or a direction towards it",
            )),
            (Some(_), _, Some(_)) | (_, Some(_), Some(_)) => Err(D::Error::custom(
                "Sun: the place of the sun is given twice; give elevation and azimuth, or direction",
            )),
            (None, None, Some(direction)) if direction.0.y < 0.0 => Err(D::Error::custom(
                "Sun: direction points below the horizon; it points towards the sun, so its y must be 0 or more",
            )),
            _ => Ok(sky),
        }
    }
}

impl Sky<'_> {
    /// Returns the parameters of a sky with the sun; `None` for another sky.
    pub fn sun(&self) -> Option<SunSky> {
        let &Self::Sun {
            elevation,
            azimuth,
            direction,
            turbidity,
            ground_albedo,
            sun_disc,
            sun_radius,
            scale,
        } = self
        else {
            return None;
        };
        let (azimuth, elevation) = match (direction, elevation) {
            (Some(direction), _) => angles(direction.0),
            (None, elevation) => {
                (azimuth.map_or(0.0, |angle| angle.0), elevation.map_or(0.0, |angle| angle.0))
            }
        };
        Some(SunSky {
            azimuth,
            elevation,
            turbidity: turbidity.0,
            ground_albedo: ground_albedo.0,
            sun_disc,
            sun_radius: sun_radius.0,
            scale: scale.0,
        })
    }
}
