//! Lights without extent.

use crate::scene::values::{Direction, HalfAngle, Light as Strengths, Point};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// A light without extent.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub enum Light {
    /// The same in all directions.
    Point {
        /// Where.
        position: Point,
        /// Power a solid angle.
        intensity: Strengths,
    },
    /// A cone.
    Spot {
        /// Where.
        position: Point,
        /// Along its axis.
        direction: Direction,
        /// Power a solid angle, on the axis.
        intensity: Strengths,
        /// Within it, the light has its full intensity.
        #[serde(default = "default_inner")]
        inner_angle: HalfAngle,
        /// Beyond it, there is none.
        #[serde(default = "default_outer")]
        outer_angle: HalfAngle,
    },
    /// From infinitely far.
    Directional {
        /// Along which the light travels.
        direction: Direction,
        /// Power an area perpendicular to the light.
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
        let light = Self::deserialize(deserializer)?; // the derived one
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
