//! Checks of numbers by their ranges. An error names the number by `what`.

use crate::values::MAX_MAGNITUDE;
use glam::DVec3;

/// Maximum intensity: the square of the maximum length, because a change of space scales it so.
pub const MAX_INTENSITY: f64 = MAX_MAGNITUDE * MAX_MAGNITUDE;

/// Checks numbers by the type that a scene file reads them with.
pub fn all<T: TryFrom<f64, Error = String>>(what: &str, numbers: &[f64]) -> Result<(), String> {
    numbers
        .iter()
        .try_for_each(|&number| T::try_from(number).map(drop).map_err(|fault| format!("{what}: {fault}")))
}

/// Checks each component as [`all`] does.
pub fn each<T: TryFrom<f64, Error = String>>(what: &str, vector: DVec3) -> Result<(), String> {
    all::<T>(what, &vector.to_array())
}

/// Checks that a vector is finite, and no component is beyond `limit`.
pub fn at_most(what: &str, vector: DVec3, limit: f64) -> Result<(), String> {
    match vector.abs().cmple(DVec3::splat(limit)).all() {
        true => Ok(()),
        false => Err(format!("{what}: {vector} is not a finite vector within {limit:e}")),
    }
}

/// Checks that a vector is finite and not 0.
pub fn is_direction(what: &str, vector: DVec3) -> Result<(), String> {
    at_most(what, vector, MAX_MAGNITUDE)?;
    if vector == DVec3::ZERO { Err(format!("{what}: (0, 0, 0) is not a direction")) } else { Ok(()) }
}
