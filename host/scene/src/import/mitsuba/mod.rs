//! Reads scenes of Mitsuba 3 in XML.
//!
//! [`parse`] turns a file into a [`Description`] and its image settings;
//! docs/reference/scene-format/pbrt-and-mitsuba.md lists for users what is read.

mod bsdf;
mod document;
mod emitter;
mod medium;
mod model;
mod principled;
mod properties;
mod sensor;
mod shape;
#[cfg(test)]
mod tests;
mod texture;

use super::assembly::{Assembly, Item};
use super::budget::Budget;
use super::files::Files;
use super::source_location::{SourceLocation, shown};
use crate::ImageSettings;
use crate::description::Description;
use crate::error::SceneError;
use document::{Document, Element};
use std::collections::HashMap;
use std::rc::Rc;

/// Image that a scene without a film has: width, height, samples.
const IMAGE: (u32, u32, u32) = (768, 576, 4);

/// Reads a Mitsuba scene from `bytes`, and the files that it names from `files`; `name` stands for
/// the file in messages.
///
/// Coordinates, units and colours are Trisect's. Colours are those of Mitsuba's variants for RGB.
///
/// # Errors
///
/// * [`SceneError::Invalid`] for a file that is not XML, or is no scene, with line and column
/// * [`SceneError::Malformed`] for numbers that are out of range
/// * [`SceneError::Resource`] and [`SceneError::Outside`] for files that cannot or must not be read
/// * [`SceneError::TooLarge`] for data beyond the limits
pub fn parse(
    bytes: &[u8],
    name: &str,
    files: &mut dyn Files,
) -> Result<(Description, ImageSettings), SceneError> {
    let mut budget = Budget::new(bytes.len());
    let document = Document::read(bytes, name, files, &mut budget)?;
    let (width, height, samples) = IMAGE;
    let mut assembly = Assembly::new(0, files, (width, height, samples, super::assembly::UNLIMITED_DEPTH));
    assembly.budget = budget;
    let mut reader = Reader {
        document: &document,
        assembly,
        materials: HashMap::new(),
        media: HashMap::new(),
        groups: HashMap::new(),
        models: HashMap::new(),
    };
    let mut notes = Vec::new();
    reader.scene(&mut notes)?;
    Ok(reader.assembly.finish(notes))
}

/// Reader of a document.
struct Reader<'d, 'f> {
    document: &'d Document,
    assembly: Assembly<'f>,
    /// Materials by their BSDF, emitter, and interior, each by its address.
    materials: HashMap<[usize; 3], usize>,
    /// Media by their address; `None` for those that are not supported.
    media: HashMap<usize, Option<usize>>,
    /// Parts of groups of shapes by their address.
    groups: HashMap<usize, Rc<[Item]>>,
    /// Meshes of files, by file, normals, front and material.
    models: HashMap<(String, u8, usize), Rc<[Item]>>,
}

/// Returns the address of an element, which stays for as long as its document.
fn address(element: &Rc<Element>) -> usize {
    Rc::as_ptr(element) as usize
}

impl<'d> Reader<'d, '_> {
    fn scene(&mut self, notes: &mut Vec<String>) -> Result<(), SceneError> {
        let document = self.document;
        for (feature, element) in &document.ignored {
            self.unsupported(element, feature, "ignored");
        }
        // The camera decides whether the world is reflected.
        let mut sensors = document.children.iter().filter(|child| child.tag == "sensor");
        if let Some(sensor) = sensors.next() {
            self.sensor(sensor, notes)?;
        }
        if let Some(further) = sensors.next() {
            self.unsupported(further, "a second <sensor>", "the first one is used");
        }
        for child in &document.children {
            match child.tag.as_str() {
                "integrator" => self.integrator(child, 0)?,
                "shape" => {
                    for item in self.shape(child, 0)?.iter() {
                        self.assembly.place(item, &document.site(child))?;
                    }
                }
                "emitter" => self.emitter(child)?,
                // What other objects refer to by their ids.
                "bsdf" | "texture" | "medium" | "sensor" | "spectrum" | "rgb" | "phase" | "volume" => {}
                // Numbers and words here have no object.
                _ => self.unsupported(child, &child.label(), "ignored"),
            }
        }
        Ok(())
    }

    /// Returns the place of an element for messages.
    fn site(&self, element: &Element) -> SourceLocation<'d> {
        self.document.site(element)
    }

    /// Warns once of a feature that is not rendered as the file states.
    fn unsupported(&mut self, element: &Element, feature: &str, instead: &str) {
        let site = self.site(element);
        self.assembly.unsupported(feature, instead, &site);
    }

    /// Warns of properties and objects within an object that nothing has looked at.
    fn report_unused(&mut self, object: &Element) {
        for child in object.unused() {
            let what = match child.attribute("name") {
                Some(name) => format!("\"{}\"", shown(name)),
                None => child.label(),
            };
            self.unsupported(child, &format!("{what} of {}", object.label()), "ignored");
        }
    }

    /// Returns the element that a reference stands for, or the element itself.
    fn resolved<'e>(&self, element: &'e Rc<Element>) -> Result<&'e Rc<Element>, SceneError>
    where
        'd: 'e,
    {
        if element.tag != "ref" {
            return Ok(element);
        }
        let id = self.document.required(element, "id")?;
        match self.document.by_id(id) {
            Some(found) => Ok(found),
            None => {
                let message = format!("no object has the id \"{}\"; it must stand in the file", shown(id));
                Err(self.document.error(element, message))
            }
        }
    }
}
