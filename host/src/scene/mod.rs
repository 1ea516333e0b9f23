//! Scenes: read, validated, turned into device records.

mod error;
mod format;
mod lower;
mod values;

pub use error::SceneError;

use crate::render::Settings;
use glam::DVec3;
use std::path::Path;
use trisect_shared::material::Material;
use trisect_shared::sky::Sky;
use trisect_shared::sphere::Sphere;

/// The scene that `trisect render` draws when none is named.
const HELLO_WORLD: &str = include_str!("../../../scenes/three_spheres.ron");

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

/// A validated scene: every number is finite and in range, every material index is below the number of materials.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where it came from, for messages.
    pub name: String,
    /// The eye.
    pub camera: CameraPose,
    /// Radiance from infinity.
    pub sky: Sky,
    /// The primitives, in the file's order: an index here is a primitive's id.
    pub spheres: Vec<Sphere>,
    /// By index from the primitives.
    pub materials: Vec<Material>,
    /// What to render unless told otherwise.
    settings: Settings,
}

impl Scene {
    /// Reads a scene file.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Reads a scene from text; `name` stands for the file in messages.
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        lower::lower(format::parse(text, name)?, name)
    }

    /// The built-in scene: `scenes/three_spheres.ron`.
    pub fn hello_world() -> Result<Self, SceneError> {
        Self::parse(HELLO_WORLD, "scenes/three_spheres.ron (built in)")
    }

    /// Checks what kernels rely on when they read without bounds checks: each primitive's material exists. A loaded scene passes;
    /// one that was changed since may not.
    pub(crate) fn prove(&self) -> Result<(), SceneError> {
        let materials = self.materials.len();
        match self.spheres.iter().position(|sphere| sphere.material as usize >= materials) {
            None => Ok(()),
            Some(index) => Err(SceneError::Inconsistent {
                file: self.name.clone(),
                message: format!(
                    "object {index} has material {}, there are {materials}",
                    self.spheres[index].material
                ),
            }),
        }
    }

    /// What the file asks for.
    pub fn settings(&self) -> Settings {
        self.settings.clone()
    }
}
