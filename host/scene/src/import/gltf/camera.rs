//! Reads the camera of a glTF node as a [`CameraPose`].

use super::super::source_location::{SourceLocation, shown};
use super::buffers::get;
use super::{Document, Output};
use crate::CameraPose;
use crate::error::SceneError;
use crate::values::{MAX_MAGNITUDE, MIN_MAGNITUDE};
use glam::DAffine3;
use std::f64::consts::FRAC_PI_2;

/// Adds the camera of a node to the description.
pub fn read(
    document: &Document,
    output: &mut Output,
    index: u32,
    node_name: Option<&str>,
    world: DAffine3,
    user: &SourceLocation,
) -> Result<(), SceneError> {
    let camera = get(&document.root.cameras, index, "cameras", user)?;
    let site = document.site(format!("cameras[{index}]"));
    let (vertical_fov, parallel_height) =
        match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
            ("perspective", Some(perspective), _) => (perspective.yfov, 0.0),
            // A negative number mirrors the image, which the specification advises against.
            ("orthographic", _, Some(orthographic)) => (FRAC_PI_2, 2.0 * orthographic.ymag.abs()),
            ("perspective", None, _) => {
                return Err(site.malformed("it has no perspective", "a perspective camera must have one"));
            }
            ("orthographic", _, None) => {
                return Err(site.malformed("it has no orthographic", "an orthographic camera must have one"));
            }
            (other, _, _) => {
                let problem = format!("its type is \"{}\"", shown(other));
                return Err(site.malformed(problem, "it must be perspective or orthographic"));
            }
        };
    if !(1e-3f64.to_radians()..=179f64.to_radians()).contains(&vertical_fov) {
        let problem = format!("yfov is {vertical_fov} radians");
        return Err(site.malformed(problem, "it must be between 0.001 and 179 degrees, in radians"));
    }
    if parallel_height != 0.0 && !(MIN_MAGNITUDE..=MAX_MAGNITUDE).contains(&parallel_height)
        || parallel_height == 0.0 && camera.kind == "orthographic"
    {
        let problem = format!("ymag is {}", 0.5 * parallel_height);
        return Err(site.malformed(problem, "it must be a number other than 0, of 1e-18 to 1e18"));
    }
    let look_from = world.translation;
    let axes = world.y_axis.try_normalize().zip((-world.z_axis).try_normalize());
    let axes = axes.filter(|(up, forward)| up.cross(*forward).length() > 1e-6);
    let Some((up, forward)) = axes.filter(|_| look_from.abs().max_element() <= MAX_MAGNITUDE / 4.0) else {
        output.warnings.tally("cameras that are flattened or too far away, left out", 1, &user.place);
        return Ok(());
    };
    // Far from the origin, rounding would change the direction to a point nearby.
    let look_at = look_from + forward * look_from.abs().max_element().max(1.0);
    let pose = CameraPose { look_from, look_at, up, vertical_fov, parallel_height, ..CameraPose::PINHOLE };
    output.budget.take(256, user)?; // many nodes may use one camera
    let name = node_name.or(camera.name.as_deref()).map_or_else(|| site.place.clone(), shown);
    output.description.cameras.push((name, pose));
    Ok(())
}

/// Appends a number to each camera's name that occurred before.
pub fn distinguish(cameras: &mut [(String, CameraPose)]) {
    let mut names = std::collections::HashMap::new();
    for (name, _) in cameras.iter() {
        names.entry(name.clone()).or_insert(1u32);
    }
    let mut first = std::collections::HashSet::new();
    for (name, _) in cameras {
        if first.insert(name.clone()) {
            continue;
        }
        let base = name.clone();
        let mut number = names.get(&base).copied().unwrap_or(1);
        while names.contains_key(name.as_str()) {
            number += 1;
            *name = format!("{base} {number}");
        }
        names.insert(base, number);
        names.insert(name.clone(), 1);
        first.insert(name.clone());
    }
}
