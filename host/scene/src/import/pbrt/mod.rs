//! Reads scenes of pbrt-v4.
//!
//! [`parse`] turns a file into a [`Description`] and its image settings;
//! docs/reference/scene-format/pbrt-and-mitsuba.md lists for users what is read.

mod camera;
mod directives;
mod lights;
mod materials;
mod media;
mod parameters;
mod patches;
mod shapes;
mod spectrum;
mod state;
#[cfg(test)]
mod tests;
mod textures;
mod tokens;

use super::assembly::{Assembly, Item, Value};
use super::budget::Budget;
use super::files::Files;
use super::source_location::shown;
use crate::ImageSettings;
use crate::description::{Description, Material, TextureUse};
use crate::error::SceneError;
use glam::{DAffine3, DVec3};
use parameters::Parameters;
use state::State;
use std::collections::HashMap;
use tokens::{At, Token, Tokens};

/// Image of a scene that states none: width, height, samples and segments of a path.
const IMAGE: (u32, u32, u32, u32) = (1280, 720, 16, 6);

/// Reads a pbrt-v4 scene from `bytes`, and the files that it names from `files`; `name` stands for
/// the file in messages.
///
/// Spectra become linear Rec. 709. A world that the camera shows mirrored, as pbrt's left-handed
/// coordinates are, is reflected in x.
///
/// # Errors
///
/// * [`SceneError::Invalid`] for a file that violates the format, with line and column
/// * [`SceneError::Malformed`] for numbers that are out of range
/// * [`SceneError::Resource`] and [`SceneError::Outside`] for files that cannot or must not be read
/// * [`SceneError::TooLarge`] for data beyond the limits
pub fn parse(
    bytes: &[u8],
    name: &str,
    files: &mut dyn Files,
) -> Result<(Description, ImageSettings), SceneError> {
    let mut budget = Budget::new(bytes.len());
    let tokens = Tokens::new(bytes, name, &mut budget)?;
    let mut assembly = Assembly::new(0, files, IMAGE);
    assembly.budget = budget;
    let mut reader = Reader {
        tokens,
        assembly,
        state: State::default(),
        stack: Vec::new(),
        systems: HashMap::new(),
        textures: HashMap::new(),
        materials: vec![Material::new(Value::number(0.5).into()).named("diffuse")],
        named_materials: HashMap::new(),
        lights: Vec::new(),
        alphas: Vec::new(),
        uses: HashMap::new(),
        media: HashMap::new(),
        models: HashMap::new(),
        objects: HashMap::new(),
        object: None,
        camera: None,
        has_world: false,
        notes: Vec::new(),
    };
    reader.scene()?;
    Ok(reader.assembly.finish(reader.notes))
}

/// Light that shapes emit.
#[derive(Clone, Debug)]
struct AreaLight {
    radiance: DVec3,
    is_two_sided: bool,
}

/// A camera directive; it is used once the film is known.
struct CameraDirective {
    kind: String,
    parameters: Parameters,
    to_world: DAffine3,
    at: At,
}

/// Parts of a shape's material: base material, light, opacity and medium inside, by their indices
/// plus 1.
type MaterialKey = [usize; 4];

/// Reader of a scene.
struct Reader<'f> {
    tokens: Tokens,
    assembly: Assembly<'f>,
    state: State,
    /// States to return to, with the directive and the place that saved each.
    stack: Vec<(&'static str, At, State)>,
    /// Coordinate systems by name.
    systems: HashMap<String, DAffine3>,
    /// Textures by name; those of numbers have names of their own.
    textures: HashMap<(bool, String), Value>,
    materials: Vec<Material>,
    named_materials: HashMap<String, usize>,
    lights: Vec<AreaLight>,
    alphas: Vec<Value>,
    /// Materials of the scene by their parts.
    uses: HashMap<MaterialKey, usize>,
    /// Media by name; `None` for those that are not supported.
    media: HashMap<String, Option<usize>>,
    /// Meshes of files by name, front and material.
    models: HashMap<(String, bool, usize), Vec<Item>>,
    objects: HashMap<String, Vec<Item>>,
    /// Object that is being defined.
    object: Option<(String, Vec<Item>)>,
    camera: Option<CameraDirective>,
    has_world: bool,
    notes: Vec<String>,
}

impl Reader<'_> {
    fn scene(&mut self) -> Result<(), SceneError> {
        while let Some(token) = self.tokens.take()? {
            let at = self.tokens.at;
            match token {
                Token::Word(word) => self.directive(&word, at)?,
                other => {
                    let message = format!("{} is no directive; one must stand here", other.shown());
                    return Err(self.tokens.error(at, message));
                }
            }
        }
        if let Some((begin, at, _)) = self.stack.last() {
            let end = begin.replace("Begin", "End");
            return Err(self.tokens.error(*at, format!("this {begin} has no {end}; it must follow")));
        }
        if !self.has_world {
            let message = "the file has no WorldBegin; it must stand before the first shape";
            return Err(self.tokens.error(self.tokens.at, message));
        }
        Ok(())
    }

    /// Returns an error at a place.
    fn error<T>(&self, at: At, message: impl Into<String>) -> Result<T, SceneError> {
        Err(self.tokens.error(at, message))
    }

    /// Warns once of a feature that is not rendered as the file states.
    fn unsupported(&mut self, at: At, feature: &str, instead: &str) {
        let site = self.tokens.site(at, "");
        let place = site.place.trim_end_matches(", ").to_owned();
        let site = super::source_location::SourceLocation::new(site.file, place);
        self.assembly.unsupported(feature, instead, &site);
    }

    /// Warns of parameters that nothing has used; `what` has them.
    fn report_unused(&mut self, parameters: &Parameters, what: &str) {
        let unused: Vec<(String, At)> =
            parameters.unused().map(|parameter| (shown(&parameter.name), parameter.at)).collect();
        for (name, at) in unused {
            self.unsupported(at, &format!("\"{name}\" of {what}"), "ignored");
        }
    }

    /// Returns the image of a file as a texture that lies over the unit square.
    fn image(&mut self, name: &str, is_linear: bool, at: At) -> Result<TextureUse, SceneError> {
        let site = self.tokens.site(at, "the image");
        let image = self.assembly.image(name, is_linear, &site)?;
        Ok(TextureUse {
            image,
            wrap: [crate::description::Wrap::Repeat; 2],
            filter: crate::description::Filter::Linear,
            transform: glam::DAffine2::IDENTITY,
            second_uvs: false,
        })
    }
}
