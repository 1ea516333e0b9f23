//! The field `space` of a scene file: origin and scale of the space that the renderer computes in.

use crate::values::{Coordinate, Magnification, Point, vector};
use ron::value::RawValue;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// The renderer's space, and the text that states it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Space<'a> {
    /// Origin and scale for the description.
    pub space: crate::Rebase,
    /// The field's value as a part of the file's text; `None` if the file has no such field.
    pub place: Option<&'a str>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default, rename = "Space")]
struct Fields {
    /// Point that becomes 0.
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
        let space = crate::Rebase { origin: vector(origin), scale: scale.0 };
        Ok(Self { space, place: Some(raw.get_ron()) })
    }
}
