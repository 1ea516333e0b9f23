//! Where to compute.

use crate::scene::values::{Coordinate, Magnification, Point, vector};
use ron::value::RawValue;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// Origin and unit of length of the renderer, and the text that says so.
#[derive(Clone, Copy, Debug, Default)]
pub struct Space<'a> {
    /// For the description.
    pub space: crate::scene::Rebase,
    /// Of the file's text; none where the file does not say.
    pub place: Option<&'a str>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default, rename = "Space")]
struct Fields {
    /// The point that becomes 0.
    origin: Point,
    /// Factor on lengths.
    scale: Magnification,
}

impl Default for Fields {
    fn default() -> Self {
        Self { origin: (Coordinate(0.0), Coordinate(0.0), Coordinate(0.0)), scale: Magnification(1.0) }
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Space<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&'de RawValue>::deserialize(deserializer)?;
        let Fields { origin, scale } =
            raw.into_rust().map_err(|error| D::Error::custom(format!("space: {}", error.code)))?;
        let space = crate::scene::Rebase { origin: vector(origin), scale: scale.0 };
        Ok(Self { space, place: Some(raw.get_ron()) })
    }
}
