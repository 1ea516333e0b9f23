//! Scenes: read, validated, turned into device records.
//!
//! A reader (RON in `format`, models in [`import`]) makes a [`description::Description`]; `lower` makes records of it.

pub mod description;
mod error;
mod format;
pub mod import;
mod include;
mod lower;
mod memory_budget;
mod model;
mod own_light;
mod records;
mod resolve;
mod ron_edit;
mod scene_document;
mod space;
mod validate;
mod values;
mod warnings;

pub use error::SceneError;
pub(crate) use format::Camera;
pub use import::Includes;
pub(crate) use import::is_model;
pub(crate) use ron_edit::{camera_value, insert_camera, insert_space, point};
pub use scene_document::{ImageSettings, SceneDocument};
pub use space::Rebase;
pub(crate) use space::triple;

use crate::render::Settings;
use description::Description;
use glam::DVec3;
use std::path::Path;
use trisect_shared::environment::EnvironmentTexel;
use trisect_shared::features::{EMITTERS, ENVIRONMENT, Features, MICROFACETS, PLANAR, TEXTURES, TRIANGLES};
use trisect_shared::light::Light;
use trisect_shared::material::{BLENDED, DIELECTRIC, MASKED, Material};
use trisect_shared::math::max_component;
use trisect_shared::planar::Planar;
use trisect_shared::sky::Sky;
use trisect_shared::sphere::Sphere;
use trisect_shared::texture::{NO_TEXTURE, Texel, Texture};
use trisect_shared::triangle::{Triangle, TriangleShading};

/// A thin-lens camera in the world: scene units, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Centre of the lens.
    pub look_from: DVec3,
    /// A point on the optical axis.
    pub look_at: DVec3,
    /// What is up in the image, not along the axis.
    pub up: DVec3,
    /// Of the whole image, in (0, π).
    pub vertical_fov: f64,
    /// Cone angle from a point in focus to the lens, in [0, π); 0 for a pinhole.
    pub defocus_angle: f64,
    /// From the lens to the plane in focus.
    pub focus_distance: f64,
}

impl CameraPose {
    /// Refuses what is none, with what would be right.
    pub fn check(&self) -> Result<(), String> {
        let Self { look_from, look_at, up, vertical_fov, defocus_angle, focus_distance } = *self;
        let far = values::MAX_MAGNITUDE;
        if ![look_from, look_at, up].iter().all(|v| v.abs().cmple(DVec3::splat(far)).all()) {
            return Err(format!("look_from, look_at and up must be numbers within {far:e}"));
        }
        let angle = |a: f64| (0.0..std::f64::consts::PI).contains(&a);
        if !(angle(vertical_fov) && vertical_fov > 0.0 && angle(defocus_angle)) {
            return Err("vertical_fov must lie between 0 and 180 degrees, defocus_angle below 180".to_owned());
        }
        if !(values::MIN_MAGNITUDE..=far).contains(&focus_distance) {
            return Err(format!("focus_distance must lie between {:e} and {far:e}", values::MIN_MAGNITUDE));
        }
        format::check_camera(self)
    }
}

/// A panorama.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Texels across.
    pub width: u32,
    /// Texels down.
    pub height: u32,
    /// About +y, radians, counter-clockwise seen from above.
    pub rotation: f64,
    /// `width * height` texels with their alias table.
    pub texels: Vec<EnvironmentTexel>,
}

/// A validated scene: every number is finite and in range, every index below the length of what it indexes.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where it came from, for messages.
    pub name: String,
    /// The eye.
    pub camera: CameraPose,
    /// Radiance from infinity, where there is no panorama.
    pub sky: Sky,
    /// Radiance from infinity.
    pub environment: Option<Environment>,
    /// Primitives of the first kind, in the file's order: an index here is a primitive's id.
    pub spheres: Vec<Sphere>,
    /// Primitives of the second kind.
    pub flats: Vec<Planar>,
    /// Primitives of the third kind.
    pub triangles: Vec<Triangle>,
    /// One for each triangle.
    pub shading: Vec<TriangleShading>,
    /// By index from the primitives.
    pub materials: Vec<Material>,
    /// By index from the materials.
    pub textures: Vec<Texture>,
    /// Of all textures.
    pub texels: Vec<Texel>,
    /// Lights without extent; their part of the alias table is not filled in.
    pub lights: Vec<Light>,
    /// What was left out or changed, for people.
    pub warnings: Vec<String>,
    /// What to render unless told otherwise.
    settings: Settings,
}

impl Scene {
    /// Reads a scene file, or a model (`.gltf`, `.glb`, `.obj`, `.ply`) with a camera and a light of its own or, where it has none,
    /// such as show all of it.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_in(path, Rebase::IDENTITY)
    }

    /// The same, then moved and scaled to `space`, after the space that the file itself asks for. Its doc says what scales how: the
    /// image stays, since the intensity of point and spot lights scales with the square of lengths, while emitted radiance, the
    /// irradiance of directional lights, the sky and panoramas stay as they are.
    pub fn load_in(path: &Path, space: Rebase) -> Result<Self, SceneError> {
        SceneDocument::load(path)?.lower(space)
    }

    /// Reads a scene from text; `name` stands for the file in messages. Files that it names are sought in the current folder.
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        Self::parse_in(text, name, Rebase::IDENTITY)
    }

    /// The same in another space, as [`Self::load_in`].
    pub fn parse_in(text: &str, name: &str, space: Rebase) -> Result<Self, SceneError> {
        SceneDocument::parse(text, name)?.lower(space)
    }

    /// A model that was read from somewhere else; as with [`Self::load`], it gets what it lacks to be seen.
    pub fn from_model(model: Description, name: &str) -> Result<Self, SceneError> {
        SceneDocument::from_model(model, name)?.lower(Rebase::IDENTITY)
    }

    /// The built-in scene: `scenes/three_spheres.ron`.
    pub fn hello_world() -> Result<Self, SceneError> {
        SceneDocument::hello_world()?.lower(Rebase::IDENTITY)
    }

    /// Primitives of all kinds.
    pub fn primitives(&self) -> usize {
        self.spheres.len() + self.flats.len() + self.triangles.len()
    }

    /// What a kernel must be able to do to render it.
    pub fn features(&self) -> Features {
        let mut features = 0;
        let mut needs = |feature: Features, needed: bool| features |= if needed { feature } else { 0 };
        needs(PLANAR, !self.flats.is_empty());
        needs(TRIANGLES, !self.triangles.is_empty());
        needs(ENVIRONMENT, self.environment.is_some());
        needs(EMITTERS, !self.lights.is_empty());
        for material in &self.materials {
            needs(EMITTERS, max_component(material.emission) > 0.0);
            needs(MICROFACETS, material.kind > DIELECTRIC);
            let textures = [
                material.albedo_texture,
                material.metallic_roughness_texture,
                material.emission_texture,
                material.transmission_texture,
            ];
            needs(TEXTURES, textures.iter().any(|&texture| texture != NO_TEXTURE));
            needs(TEXTURES, material.flags & (MASKED | BLENDED) != 0);
        }
        features
    }

    /// What the file asks for.
    pub fn settings(&self) -> Settings {
        self.settings.clone()
    }
}
