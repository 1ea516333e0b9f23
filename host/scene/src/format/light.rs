//! The lights without extent of a scene file.

use crate::values::{Direction, HalfAngle, Light as Strengths, Point};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A light without extent.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub enum Light {
    /// A point light, equal in all directions.
    Point {
        /// Position in the world.
        position: Point,
        /// Radiant intensity (power per solid angle).
        intensity: Strengths,
    },
    /// A spot light: a cone.
    Spot {
        /// Position in the world.
        position: Point,
        /// Direction of the axis.
        direction: Direction,
        /// Radiant intensity (power per solid angle) on the axis.
        intensity: Strengths,
        /// Half angle of full intensity, in degrees; default: 0.
        #[serde(default = "default_inner")]
        inner_angle: HalfAngle,
        /// Half angle beyond which the light is dark, in degrees; default: 45.
        #[serde(default = "default_outer")]
        outer_angle: HalfAngle,
    },
    /// A directional light: parallel light from infinity.
    Directional {
        /// Direction in which the light travels.
        direction: Direction,
        /// Irradiance (power per area) of a surface perpendicular to the light.
        irradiance: Strengths,
    },
}

fn default_inner() -> HalfAngle {
    HalfAngle(0.0)
}

fn default_outer() -> HalfAngle {
    HalfAngle(45.0)
}

impl<'de> Deserialize<'de> for Light {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let light = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        match &light {
            Self::Spot { inner_angle, outer_angle, .. } if inner_angle.0 >= outer_angle.0 => {
                Err(D::Error::custom(format!(
                    "Spot: inner_angle {} must be less than outer_angle {}",
                    inner_angle.0, outer_angle.0
                )))
            }
            _ => Ok(light),
        }
    }
}
