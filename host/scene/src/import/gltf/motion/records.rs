//! Records of the document that an animation changes at a time (KHR_animation_pointer): its
//! materials, lights and cameras.

use super::super::super::source_location::{SourceLocation, shown};
use super::super::buffers::get;
use super::super::json::{Camera, LightList, Material, Root};
use super::super::{Document, Output};
use super::animation::{Chosen, Track};
use super::properties::{self, Found};
use crate::error::SceneError;
use std::mem::swap;

/// Copies of records, with the numbers of an animation in place of the file's own.
pub struct Records {
    materials: Vec<Material>,
    lights: Option<LightList>,
    cameras: Vec<Camera>,
}

impl Records {
    /// Returns the records as the chosen animation changes them; `None` if it changes none. Warns
    /// of properties that are not supported.
    ///
    /// # Errors
    ///
    /// * [`SceneError::Malformed`] for an animation that violates the specification
    pub fn of(document: &Document, output: &mut Output, chosen: Chosen) -> Result<Option<Self>, SceneError> {
        let mut records = None;
        let Some(animation) = document.root.animations.get(chosen.animation) else { return Ok(None) };
        for (place, channel) in animation.channels.iter().enumerate() {
            if channel.target.node.is_some() || &*channel.target.path != "pointer" {
                continue;
            }
            let site = document.site(format!("animations[{}].channels[{place}]", chosen.animation));
            let Some(pointer) = channel.target.pointer() else {
                let text = "animated properties without a pointer (KHR_animation_pointer) are ignored";
                output.warnings.once(text);
                continue;
            };
            let parts: Vec<&str> = pointer.split('/').skip(1).collect();
            if super::node_property(&parts).is_some() {
                continue; // the pose has it
            }
            let records = records.get_or_insert_with(|| Self::at_rest(&document.root));
            let numbers = match records.find(&parts, &site)? {
                Found::Numbers(numbers) => numbers,
                Found::WithoutEffect => continue,
                Found::Absent => {
                    output.warnings.once(format!(
                        "an animation changes \"{}\", which the file does not have: ignored",
                        pattern(&parts)
                    ));
                    continue;
                }
                Found::Unsupported => {
                    output.warnings.once(format!(
                        "an animation changes \"{}\", which is not supported and ignored",
                        pattern(&parts)
                    ));
                    continue;
                }
            };
            let sampler = get(&animation.samplers, channel.sampler, "samplers", &site)?;
            let values = Track::numbers(document, output, sampler, numbers.len(), chosen.time, &site)?;
            // A spline may leave the range of its keys.
            let signed = properties::is_signed(&parts);
            for (number, value) in numbers.iter_mut().zip(values) {
                *number = if signed { value } else { value.max(0.0) };
            }
        }
        Ok(records)
    }

    fn at_rest(root: &Root) -> Self {
        let Root { materials, cameras, extensions, .. } = root;
        Self { materials: materials.clone(), lights: extensions.lights.clone(), cameras: cameras.clone() }
    }

    /// Exchanges the records with those of the document.
    pub fn exchange(&mut self, root: &mut Root) {
        swap(&mut self.materials, &mut root.materials);
        swap(&mut self.lights, &mut root.extensions.lights);
        swap(&mut self.cameras, &mut root.cameras);
    }

    /// Returns the numbers that a pointer of these parts names.
    fn find(&mut self, parts: &[&str], site: &SourceLocation) -> Result<Found<'_>, SceneError> {
        Ok(match parts {
            ["materials", index, path @ ..] => {
                properties::of_material(entry(&mut self.materials, index, "materials", site)?, path)
            }
            ["cameras", index, path @ ..] => {
                properties::of_camera(entry(&mut self.cameras, index, "cameras", site)?, path)
            }
            ["extensions", "KHR_lights_punctual", "lights", index, path @ ..] => {
                let lights = self.lights.as_mut().map_or(&mut [][..], |list| &mut list.lights);
                let name = "extensions.KHR_lights_punctual.lights";
                properties::of_light(entry(lights, index, name, site)?, path)
            }
            _ => Found::Unsupported,
        })
    }
}

/// Returns the entry of a list that a part of a pointer names.
fn entry<'l, T>(
    list: &'l mut [T],
    part: &str,
    name: &str,
    site: &SourceLocation,
) -> Result<&'l mut T, SceneError> {
    let count = list.len();
    part.parse::<usize>().ok().and_then(|index| list.get_mut(index)).ok_or_else(|| {
        let problem = format!("its pointer names {name}/{}, and there are {count}", shown(part));
        site.malformed(problem, "the index must be that of an existing entry")
    })
}

/// Returns a pointer's text, with `{}` in place of indices, so that many pointers give one warning.
fn pattern(parts: &[&str]) -> String {
    let general = |part: &&str| if part.parse::<u32>().is_ok() { "{}".to_owned() } else { shown(part) };
    parts.iter().map(|part| format!("/{}", general(part))).collect()
}
