//! Reads the light of a glTF node (KHR_lights_punctual).

use super::super::source_location::{SourceLocation, shown};
use super::buffers::get;
use super::json::Spot;
use super::{Document, Output};
use crate::description::PunctualLight;
use crate::error::SceneError;
use crate::values::MAX_MAGNITUDE;
use glam::{DAffine3, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Adds the light of a node to the description.
pub fn read(
    document: &Document,
    output: &mut Output,
    index: u32,
    world: DAffine3,
    user: &SourceLocation,
) -> Result<(), SceneError> {
    let lights = document.root.extensions.lights.as_ref().map_or(&[][..], |list| &list.lights);
    let light = get(lights, index, "extensions.KHR_lights_punctual.lights", user)?;
    let site = document.site(format!("extensions.KHR_lights_punctual.lights[{index}]"));
    let power = DVec3::from(light.color) * light.intensity;
    if !(power.cmpge(DVec3::ZERO).all() && power.cmple(DVec3::splat(MAX_MAGNITUDE)).all()) {
        let problem = format!("color times intensity is {power}");
        return Err(site.malformed(problem, "it must be 0 or more and at most 1e18"));
    }
    if light.range.is_some() {
        output
            .warnings
            .once("the range of lights (KHR_lights_punctual) is not supported: they reach everywhere");
    }
    let position = world.translation;
    if position.abs().max_element() > MAX_MAGNITUDE {
        return Err(user.too_large("the light is too far from the origin", "1e18 from 0"));
    }
    let direction = (-world.z_axis).try_normalize();
    let light = match (light.kind.as_str(), direction) {
        ("point", _) => PunctualLight::Point { position, intensity: power },
        ("spot", Some(direction)) => {
            let (inner, outer) = cone(light.spot.as_ref(), &site)?;
            PunctualLight::Spot { position, direction, intensity: power, inner, outer }
        }
        ("directional", Some(direction)) => PunctualLight::Directional { direction, irradiance: power },
        ("spot" | "directional", None) => {
            output.warnings.tally("lights whose node is scaled to nothing, left out", 1, &user.place);
            return Ok(());
        }
        (other, _) => {
            let problem = format!("its type is \"{}\"", shown(other));
            return Err(site.malformed(problem, "it must be point, spot or directional"));
        }
    };
    output.budget.take(size_of::<PunctualLight>() as u64, user)?;
    output.description.lights.push(light);
    Ok(())
}

/// Returns the inner and outer half angle of a spot light.
fn cone(spot: Option<&Spot>, site: &SourceLocation) -> Result<(f64, f64), SceneError> {
    let Some(spot) = spot else {
        return Err(site.malformed("it has no spot", "a light of type spot must have one, which may be {}"));
    };
    let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
    // Exporters round pi / 2 to f32, which may be above pi / 2.
    if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2 * (1.0 + 1e-6)) {
        return Err(site.malformed(
            format!("innerConeAngle is {inner}, outerConeAngle {outer}"),
            "0 <= innerConeAngle < outerConeAngle <= pi / 2 must hold",
        ));
    }
    let outer = outer.min(FRAC_PI_2);
    Ok((inner.min(outer.next_down()), outer))
}
