//! The scene file: RON, version 1; docs/reference/scene-format/README.md describes it for users.
//!
//! Serde checks each value while it reads, and each object as a whole after that. Names are looked
//! up once the whole file is read.

mod material;
mod medium;
mod name;
mod object;
mod sky;
mod space;
mod transform;

#[cfg(test)]
mod tests;

pub use material::{ColorSpace, Filter, Material, Texture, Wrap};
pub use medium::Medium;
pub use name::{Index, Name, Source};
pub use object::{Object, sides};
pub use sky::Sky;
pub use transform::parse_transform;

use super::camera::Camera;
use super::error::SceneError;
use super::light::PunctualLight;
use super::material::surface::TextureRole;
use super::portal::Portal;
use super::ron_error::message;
use super::surroundings::PANORAMAS;
use super::values::{Count, Length, Point, some};
use name::unique_names;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use space::Space;

pub use super::version::VERSION;

/// A whole scene file. It borrows the text, so that errors can name places in it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene")]
pub struct SceneFile<'a> {
    /// Version of the format; see [`VERSION`].
    #[serde(deserialize_with = "supported_version")]
    #[allow(dead_code, reason = "checked during deserialization")]
    pub version: u32,
    /// Description and source of the scene, for people.
    #[serde(default)]
    #[allow(dead_code, reason = "documentation within the file")]
    pub about: String,
    /// Image settings; the command line overrides them.
    pub image: Image,
    /// Camera; without it, the first camera of a model is used.
    #[serde(default, deserialize_with = "some")]
    pub camera: Option<Camera>,
    /// Space that the renderer computes in.
    #[serde(default, borrow)]
    pub space: Space<'a>,
    /// Radiance from infinity.
    #[serde(default, borrow)]
    pub sky: Sky<'a>,
    /// Ground that catches shadows and fades out.
    #[serde(default, deserialize_with = "some")]
    pub ground: Option<Ground>,
    /// Reflectance model of dielectrics.
    #[serde(default)]
    pub fresnel: Fresnel,
    /// Textures by name.
    #[serde(default, borrow, deserialize_with = "unique_names")]
    pub textures: Vec<(String, Texture<'a>)>,
    /// Participating media by name.
    #[serde(default, borrow, deserialize_with = "unique_names")]
    pub media: Vec<(String, Medium<'a>)>,
    /// Medium around all objects: a name from `media`.
    #[serde(default, borrow, deserialize_with = "some")]
    pub atmosphere: Option<Name<'a>>,
    /// Materials by name.
    #[serde(borrow, deserialize_with = "unique_names")]
    pub materials: Vec<(String, Material<'a>)>,
    /// Objects, in the order of their ids.
    #[serde(borrow)]
    pub objects: Vec<Object<'a>>,
    /// Lights without extent.
    #[serde(default)]
    pub lights: Vec<PunctualLight>,
    /// Openings through which rooms see the sky.
    #[serde(default)]
    pub portals: Vec<Portal>,
    /// The file's name and text.
    #[serde(skip)]
    pub source: Source<'a>,
}

/// Image size and sampling effort.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Image {
    /// Width in pixels.
    pub width: Count,
    /// Height in pixels.
    pub height: Count,
    /// Samples per pixel; default: 64.
    #[serde(default = "default_samples")]
    pub samples: Count,
    /// Maximum number of segments of a path; default: 50.
    #[serde(default = "default_depth")]
    pub depth: Count,
}

fn default_samples() -> Count {
    Count(64)
}

fn default_depth() -> Count {
    Count(50)
}

/// A ground that catches shadows and fades out.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// Centre of the disc in scene units.
    pub center: Point,
    /// Radius of what stands on it: the ground is opaque up to 1.5 times this length.
    pub size: Length,
}

/// Reflectance model of dielectrics.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub enum Fresnel {
    /// Fresnel's equations.
    #[default]
    Exact,
    /// Schlick's approximation with the incident cosine on both sides, as in the book.
    Schlick,
}

fn supported_version<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    match u32::deserialize(deserializer)? {
        VERSION => Ok(VERSION),
        other => Err(D::Error::custom(format!(
            "version {other} of the scene format; this program reads {VERSION}"
        ))),
    }
}

/// Parses the text of a scene file; `file` stands for it in messages.
pub fn parse<'a>(text: &'a str, file: &'a str) -> Result<SceneFile<'a>, SceneError> {
    let mut scene: SceneFile<'a> = ron::from_str(text).map_err(|error| {
        let place = error.span.start;
        SceneError::at(file, text, place.line, place.col, message(&error.code))
    })?;
    scene.source = Source { file, text };
    scene.check_names()?;
    Ok(scene)
}

impl SceneFile<'_> {
    /// Returns whether the scene refers to other files.
    pub fn names_files(&self) -> bool {
        let panorama = matches!(self.sky, Sky::Image { .. });
        let grid = self.media.iter().any(|(_, medium)| medium.grid.is_some());
        panorama
            || grid
            || !self.textures.is_empty()
            || self.objects.iter().any(|o| matches!(o, Object::Mesh { .. }))
    }

    /// Checks that each name refers to an entry, and that files have known extensions. This follows
    /// reading, because a name may stand before the entry that it refers to.
    fn check_names(&self) -> Result<(), SceneError> {
        let source = self.source;
        if let Sky::Image { file, .. } = &self.sky {
            source.check_extension(file, &PANORAMAS, "a panorama")?;
        }
        let textures = Index::new(&self.textures);
        let media = Index::new(&self.media);
        for (_, medium) in &self.media {
            if let Some(grid) = &medium.grid {
                source.check_extension(&grid.file, &["vol"], "a grid of densities")?;
            }
        }
        if let Some(name) = &self.atmosphere {
            media.find(name, source)?;
        }
        for (_, Material { material, medium }) in &self.materials {
            if let Some(name) = medium {
                media.find(name, source)?;
            }
            for (name, role) in material.textures() {
                let (_, texture) = &self.textures[textures.find(name, source)?];
                if role == TextureRole::Numbers && texture.color_space == ColorSpace::Srgb {
                    let message = "holds numbers here, not colours; give it color_space: Linear";
                    return Err(source.at(name, format!("texture \"{}\" {message}", name.name)));
                }
            }
        }
        let materials = Index::new(&self.materials);
        for object in &self.objects {
            if let Object::Mesh { file, .. } = object {
                source.check_extension(file, &["gltf", "glb", "obj", "ply", "stl"], "a model")?;
            }
            if let Some(name) = object.material() {
                materials.find(name, source)?;
            }
        }
        Ok(())
    }
}
