//! The scene file: RON, version 1. `docs/scenes.md` describes it for people.
//!
//! Serde checks each value while it reads, and each object as a whole after it. Names are looked up once all of the file is read.

mod camera;
mod light;
mod material;
mod name;
mod object;
mod space;
mod transform;

#[cfg(test)]
mod tests;

pub use camera::{Camera, check as check_camera};
pub use light::Light;
pub use material::{ColorSpace, ConductorFresnel, Filter, Material, Texture, Wrap};
pub use name::{Index, Name, Source};
pub use object::{Object, has_area, sides};
pub use transform::{in_range, is_singular};

use super::error::SceneError;
use super::values::{Angle, Colour, Count, Gain};
pub(crate) use name::some;
use name::unique_names;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use space::Space;

/// The only version so far.
pub const VERSION: u32 = 1;

/// A whole file. It borrows the text, to name places in it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene")]
pub struct SceneFile<'a> {
    /// Of the format; see [`VERSION`].
    #[serde(deserialize_with = "supported_version")]
    #[allow(dead_code, reason = "checked while it is read")]
    pub version: u32,
    /// What the scene shows and where it comes from; for people.
    #[serde(default)]
    #[allow(dead_code, reason = "for people")]
    pub about: String,
    /// What to render unless the command line says otherwise.
    pub image: Image,
    /// The eye; without it, the first one of a model.
    #[serde(default, deserialize_with = "some")]
    pub camera: Option<Camera>,
    /// Where to compute.
    #[serde(default, borrow)]
    pub space: Space<'a>,
    /// Radiance from infinity.
    #[serde(default, borrow)]
    pub sky: Sky<'a>,
    /// How dielectrics reflect.
    #[serde(default)]
    pub fresnel: Fresnel,
    /// By name.
    #[serde(default, borrow, deserialize_with = "unique_names")]
    pub textures: Vec<(String, Texture<'a>)>,
    /// By name.
    #[serde(borrow, deserialize_with = "unique_names")]
    pub materials: Vec<(String, Material<'a>)>,
    /// In the order of their ids.
    #[serde(borrow)]
    pub objects: Vec<Object<'a>>,
    /// Without extent.
    #[serde(default)]
    pub lights: Vec<Light>,
    /// Where all this was read from.
    #[serde(skip)]
    pub source: Source<'a>,
}

/// Size and effort.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Image {
    /// Pixels across.
    pub width: Count,
    /// Pixels down.
    pub height: Count,
    /// Samples a pixel.
    #[serde(default = "default_samples")]
    pub samples: Count,
    /// Segments a path, at most.
    #[serde(default = "default_depth")]
    pub depth: Count,
}

fn default_samples() -> Count {
    Count(64)
}

fn default_depth() -> Count {
    Count(50)
}

/// Radiance from infinity.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Sky<'a> {
    /// None.
    #[default]
    Black,
    /// The same from everywhere.
    Uniform {
        /// From everywhere.
        radiance: Colour,
    },
    /// From straight down to straight up, by the y of the unit direction.
    Gradient {
        /// Straight down.
        bottom: Colour,
        /// Straight up.
        top: Colour,
    },
    /// A panorama.
    Image {
        /// Relative to the scene file.
        #[serde(borrow)]
        file: Name<'a>,
        /// Factor on its radiance.
        #[serde(default = "default_gain")]
        scale: Gain,
        /// About +y.
        #[serde(default = "default_rotation")]
        rotation: Angle,
    },
}

fn default_gain() -> Gain {
    Gain(1.0)
}

fn default_rotation() -> Angle {
    Angle(0.0)
}

/// How dielectrics reflect.
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

/// Reads a file's text; `file` stands for it in messages.
pub fn parse<'a>(text: &'a str, file: &'a str) -> Result<SceneFile<'a>, SceneError> {
    let mut scene: SceneFile<'a> = ron::from_str(text).map_err(|error| {
        let place = error.span.start;
        SceneError::at(file, text, place.line, place.col, error.code.to_string())
    })?;
    scene.source = Source { file, text };
    scene.check_names()?;
    Ok(scene)
}

impl SceneFile<'_> {
    /// Whether the file names others.
    pub fn names_files(&self) -> bool {
        let panorama = matches!(self.sky, Sky::Image { .. });
        panorama || !self.textures.is_empty() || self.objects.iter().any(|o| matches!(o, Object::Mesh { .. }))
    }

    /// Checks what names refer to: serde knows a name's place only while it reads, and what has names only afterwards.
    fn check_names(&self) -> Result<(), SceneError> {
        let source = self.source;
        if let Sky::Image { file, .. } = &self.sky {
            source.check_extension(file, &["hdr", "exr", "pfm"], "a panorama")?;
        }
        let textures = Index::new(&self.textures);
        for (_, material) in &self.materials {
            for name in material.textures() {
                textures.find(name, source)?;
            }
            if let Material::MetallicRoughness { metallic_roughness_texture: Some(name), .. } = material
                && self.textures[textures.find(name, source)?].1.color_space == ColorSpace::Srgb
            {
                let message = "holds numbers here, not colours; give it color_space: Linear";
                return Err(source.at(name, format!("texture \"{}\" {message}", name.name)));
            }
        }
        let materials = Index::new(&self.materials);
        for object in &self.objects {
            if let Object::Mesh { file, .. } = object {
                source.check_extension(file, &["gltf", "glb", "obj", "ply"], "a model")?;
            }
            if let Some(name) = object.material() {
                materials.find(name, source)?;
            }
        }
        Ok(())
    }
}
