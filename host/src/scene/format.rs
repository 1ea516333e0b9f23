//! The scene file: RON, version 1. `docs/scenes.md` describes it for people.

use super::error::SceneError;
use super::values::{Albedo, Colour, Coordinate, Count, Defocus, FieldOfView, Ior, Length, Point, Share};
use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt;

/// The only version so far.
pub const VERSION: u32 = 1;

/// A whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename = "Scene")]
pub struct SceneFile {
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
    /// The eye.
    pub camera: Camera,
    /// Radiance from infinity.
    pub sky: Sky,
    /// How dielectrics reflect.
    #[serde(default)]
    pub fresnel: Fresnel,
    /// By name.
    #[serde(deserialize_with = "unique_names")]
    pub materials: Vec<(String, Material)>,
    /// In the order of their ids.
    pub objects: Vec<Object>,
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

/// A thin-lens camera; angles in degrees.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Centre of the lens.
    pub look_from: Point,
    /// A point on the optical axis.
    pub look_at: Point,
    /// What is up in the image.
    #[serde(default = "default_up")]
    pub up: Point,
    /// Of the whole image.
    pub vertical_fov: FieldOfView,
    /// Cone angle from a point in focus to the lens; 0 for a pinhole.
    #[serde(default = "default_defocus")]
    pub defocus_angle: Defocus,
    /// From the lens to the plane in focus.
    #[serde(default = "default_focus")]
    pub focus_distance: Length,
}

fn default_up() -> Point {
    (Coordinate(0.0), Coordinate(1.0), Coordinate(0.0))
}

fn default_defocus() -> Defocus {
    Defocus(0.0)
}

fn default_focus() -> Length {
    Length(1.0)
}

/// Radiance from infinity.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Sky {
    /// From straight down to straight up, by the y of the unit direction.
    Gradient {
        /// Straight down.
        bottom: Colour,
        /// Straight up.
        top: Colour,
    },
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

/// A material.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Material {
    /// Diffuse.
    Lambertian {
        /// Reflected share.
        albedo: Albedo,
    },
    /// A mirror, blurred.
    Metal {
        /// Reflected share.
        albedo: Albedo,
        /// Radius of the ball that moves the mirrored direction.
        #[serde(default = "default_fuzz")]
        fuzz: Share,
    },
    /// Clear glass.
    Dielectric {
        /// Index of refraction inside, relative to outside.
        ior: Ior,
    },
}

fn default_fuzz() -> Share {
    Share(0.0)
}

/// Something to see.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Object {
    /// A sphere.
    Sphere {
        /// In scene units.
        center: Point,
        /// In scene units.
        radius: Length,
        /// A name from `materials`.
        material: MaterialName,
    },
}

/// A reference to a material.
#[derive(Clone, Debug)]
pub struct MaterialName(pub String);

thread_local! {
    /// While set, reading an unlisted material name is an error. The reader knows the names only at the end of the
    /// file, and serde the place only while it reads: so a file with an unknown name is read again with the names set.
    static KNOWN: RefCell<Option<BTreeSet<String>>> = const { RefCell::new(None) };
}

impl<'de> Deserialize<'de> for MaterialName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        KNOWN.with_borrow(|known| match known {
            Some(names) if !names.contains(&name) => {
                let mut list: Vec<&str> = names.iter().take(8).map(String::as_str).collect();
                if names.len() > list.len() {
                    list.push("…");
                }
                Err(D::Error::custom(format!(
                    "unknown material \"{name}\"; `materials` has: {}",
                    list.join(", ")
                )))
            }
            _ => Ok(Self(name)),
        })
    }
}

fn supported_version<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    match u32::deserialize(deserializer)? {
        VERSION => Ok(VERSION),
        other => Err(D::Error::custom(format!(
            "version {other} of the scene format; this program reads {VERSION}"
        ))),
    }
}

/// A map that keeps its order and refuses a name that stands twice.
fn unique_names<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(String, Material)>, D::Error> {
    struct Names;
    impl<'de> Visitor<'de> for Names {
        type Value = Vec<(String, Material)>;

        fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
            formatter.write_str("a map from names to materials")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut seen = BTreeSet::new();
            let mut materials = Vec::new();
            while let Some(name) = map.next_key::<String>()? {
                if !seen.insert(name.clone()) {
                    return Err(A::Error::custom(format!("material \"{name}\" stands twice")));
                }
                materials.push((name, map.next_value()?));
            }
            Ok(materials)
        }
    }
    deserializer.deserialize_map(Names)
}

/// Reads a file's text; `file` stands for it in messages.
pub fn parse(text: &str, file: &str) -> Result<SceneFile, SceneError> {
    let scene = read(text, file)?;
    let names: BTreeSet<String> = scene.materials.iter().map(|(name, _)| name.clone()).collect();
    let all_known = scene.objects.iter().all(|Object::Sphere { material, .. }| names.contains(&material.0));
    if all_known {
        return Ok(scene);
    }
    KNOWN.set(Some(names));
    let result = read(text, file);
    KNOWN.set(None);
    result
}

fn read(text: &str, file: &str) -> Result<SceneFile, SceneError> {
    ron::from_str(text).map_err(|error| {
        let place = error.span.start;
        SceneError::at(file, text, place.line, place.col, error.code.to_string())
    })
}
