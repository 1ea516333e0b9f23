//! Portals: openings, such as windows, through which a room sees the sky. They are no surfaces;
//! connections to the sky aim at them.

use crate::limits::has_area;
use crate::ranges::each;
use crate::values::{Coordinate, numbers};
use glam::DVec3;
use serde::{Deserialize, Deserializer, de::Error};

/// Maximum number of portals: each connection looks at all of them.
pub const MAX_PORTALS: usize = 64;

/// A parallelogram in an opening; its front, where u × v points, is on the side of the room.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct Portal {
    /// One corner.
    #[serde(deserialize_with = "numbers::<Coordinate, _>")]
    pub corner: DVec3,
    /// Edge from `corner` to the next corner.
    #[serde(deserialize_with = "numbers::<Coordinate, _>")]
    pub u: DVec3,
    /// Edge from `corner` to the other adjacent corner.
    #[serde(deserialize_with = "numbers::<Coordinate, _>")]
    pub v: DVec3,
}

impl Portal {
    /// Checks that each number is finite and in range, and that there is an area.
    pub(crate) fn check(&self) -> Result<(), String> {
        each::<Coordinate>("corner", self.corner)?;
        each::<Coordinate>("u", self.u)?;
        each::<Coordinate>("v", self.v)?;
        has_area(self.u, self.v)
    }
}

impl<'de> Deserialize<'de> for Portal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let portal = Self::deserialize(deserializer)?; // the inherent function of serde's derive
        portal.check().map_err(D::Error::custom)?;
        Ok(portal)
    }
}

/// Checks the number of portals.
pub(crate) fn check_count(count: usize) -> Result<(), String> {
    match count {
        ..=MAX_PORTALS => Ok(()),
        _ => Err(format!(
            "{count} portals; at most {MAX_PORTALS} are possible: let one cover several openings side by side"
        )),
    }
}
