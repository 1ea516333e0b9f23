//! Lights without extent. Scene files, importers and programs that build scenes give them;
//! `PunctualLight::record` makes the device record.

use crate::ranges::{MAX_INTENSITY, at_most, each, is_direction};
use crate::values::{Coordinate, HalfAngle, Strength, direction, numbers};
use glam::DVec3;
use serde::{Deserialize, Deserializer, de::Error};
use trisect_shared::light::{DIRECTIONAL, Light as Record, POINT};

/// A light without extent.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub enum PunctualLight {
    /// A point light, equal in all directions.
    Point {
        /// Position in the world.
        #[serde(deserialize_with = "numbers::<Coordinate, _>")]
        position: DVec3,
        /// Radiant intensity (power per solid angle), by channel.
        #[serde(deserialize_with = "numbers::<Strength, _>")]
        intensity: DVec3,
    },
    /// A spot light: a cone.
    Spot {
        /// Position in the world.
        #[serde(deserialize_with = "numbers::<Coordinate, _>")]
        position: DVec3,
        /// Unit vector along the axis; of any length but 0 in a file.
        #[serde(deserialize_with = "direction")]
        direction: DVec3,
        /// Radiant intensity (power per solid angle) on the axis, by channel.
        #[serde(deserialize_with = "numbers::<Strength, _>")]
        intensity: DVec3,
        /// Half angle of full intensity, in radians; degrees in a file.
        #[serde(rename = "inner_angle", default, deserialize_with = "half_angle")]
        inner: f64,
        /// Half angle beyond which the light is dark, in radians; greater than `inner`, at most
        /// π / 2. Between the two is glTF's smooth falloff. In a file, in degrees.
        #[serde(rename = "outer_angle", default = "half_of_right_angle", deserialize_with = "half_angle")]
        outer: f64,
    },
    /// A directional light: parallel light from infinity.
    Directional {
        /// Unit vector along which the light travels; of any length but 0 in a file.
        #[serde(deserialize_with = "direction")]
        direction: DVec3,
        /// Irradiance (power per area) of a surface perpendicular to the light, by channel.
        #[serde(deserialize_with = "numbers::<Strength, _>")]
        irradiance: DVec3,
    },
}

/// Parts of a light that a change of its place changes.
#[derive(Debug)]
pub(crate) struct Parts<'a> {
    /// Position and radiant intensity; `None` for a light at infinity.
    pub placed: Option<(&'a mut DVec3, &'a mut DVec3)>,
    /// Unit vector along which the light shines; `None` if it shines in all directions.
    pub direction: Option<&'a mut DVec3>,
}

impl PunctualLight {
    /// Returns the intensity of a point or spot light, or the irradiance of a directional light.
    pub fn strength(&self) -> DVec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// Returns the position; `None` for a light at infinity.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

    /// Returns the unit vector along which light arrives at `point`, and the irradiance of a
    /// surface there that is perpendicular to it, without the falloff of a spot; `None` where the
    /// light does not shine.
    pub fn arrival(&self, point: DVec3) -> Option<(DVec3, DVec3)> {
        let from = |position: DVec3, intensity: DVec3| {
            let along = (point - position).try_normalize()?;
            Some((along, intensity / (point - position).length_squared()))
        };
        match *self {
            Self::Point { position, intensity } => from(position, intensity),
            Self::Spot { position, direction, intensity, outer, .. } => {
                from(position, intensity).filter(|(along, _)| along.dot(direction) >= outer.cos())
            }
            Self::Directional { direction, irradiance } => Some((direction, irradiance)),
        }
    }

    pub(crate) fn parts_mut(&mut self) -> Parts<'_> {
        match self {
            Self::Point { position, intensity } => {
                Parts { placed: Some((position, intensity)), direction: None }
            }
            Self::Spot { position, direction, intensity, .. } => {
                Parts { placed: Some((position, intensity)), direction: Some(direction) }
            }
            Self::Directional { direction, .. } => Parts { placed: None, direction: Some(direction) },
        }
    }

    /// Checks that each number is finite and in range.
    pub(crate) fn check(&self) -> Result<(), String> {
        let strength = self.strength();
        at_most("strength", strength, MAX_INTENSITY)?;
        if strength.min_element() < 0.0 {
            return Err(format!("strength: {strength} is below 0"));
        }
        self.position().map_or(Ok(()), |position| each::<Coordinate>("position", position))?;
        match *self {
            Self::Point { .. } => Ok(()),
            Self::Directional { direction, .. } => is_direction("direction", direction),
            Self::Spot { direction, inner, outer, .. } => {
                is_direction("direction", direction)?;
                match 0.0 <= inner && inner < outer && outer <= std::f64::consts::FRAC_PI_2 {
                    true => Ok(()),
                    false => Err(format!(
                        "angles: from {inner} to {outer} radians is no cone; both must be from 0 to π / 2, in order"
                    )),
                }
            }
        }
    }

    /// Returns the device record; `trisect::lights` fills in its probability and its row of the
    /// alias table.
    pub(crate) fn record(&self) -> Record {
        let mut record: Record = bytemuck::Zeroable::zeroed();
        record.kind = POINT;
        record.cone_offset = 1.0;
        record.intensity = self.strength().as_vec3();
        record.position = self.position().unwrap_or_default().as_vec3();
        match *self {
            Self::Point { .. } => {}
            Self::Spot { direction, inner, outer, .. } => {
                record.axis = direction.normalize_or_zero().as_vec3();
                // KHR_lights_punctual: scale = 1 / max(0.001, cos inner - cos outer), offset = -cos
                // outer · scale.
                let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-3);
                record.cone_scale = scale as f32;
                record.cone_offset = (-outer.cos() * scale) as f32;
            }
            Self::Directional { direction, .. } => {
                record.kind = DIRECTIONAL;
                record.position = -direction.normalize_or_zero().as_vec3();
            }
        }
        record
    }
}

fn half_angle<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    HalfAngle::deserialize(deserializer).map(|angle| angle.0.to_radians())
}

fn half_of_right_angle() -> f64 {
    std::f64::consts::FRAC_PI_4
}

/// Returns an angle in degrees, rounded so that it is what a file says.
fn degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e9).round() / 1e9
}

impl<'de> Deserialize<'de> for PunctualLight {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let light = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        match light {
            Self::Spot { inner, outer, .. } if inner >= outer => Err(D::Error::custom(format!(
                "Spot: inner_angle {} must be less than outer_angle {}",
                degrees(inner),
                degrees(outer)
            ))),
            _ => Ok(light),
        }
    }
}
