//! A scene under construction, for the readers of pbrt and Mitsuba files: what both formats need
//! and models do not have.

mod form;
mod metals;
mod panorama;
mod place;
mod spectrum;
mod surfaces;
mod textures;
mod transform;
mod value;
mod view;

pub(super) use form::{Form, grid, oriented, smooth, surface_of_revolution};
pub(super) use metals::{glass, metal};
pub(super) use panorama::{octahedral, spherical};
pub(super) use place::{Item, Part, turned_inside_out};
pub(super) use spectrum::{blackbody, emitted, reflected};
pub(super) use surfaces::{
    Coating, conductor, glass_surface, plastic, power_preserving_cone, roughness_of, thin_glass, tinted_metal,
};
pub(super) use transform::{look_at, rotation};
pub(super) use value::Value;
pub(super) use view::{Projection, View, reflection};

use super::budget::Budget;
use super::files::Files;
use super::images::Images;
use super::source_location::SourceLocation;
use super::warnings::Warnings;
use crate::description::{Description, Material, PunctualLight, Sky};
use crate::error::SceneError;
use crate::{Fresnel, ImageSettings};
use glam::{DAffine3, DVec3};
use std::collections::{HashMap, HashSet};

/// Segments of a path where the file sets no limit.
pub(super) const UNLIMITED_DEPTH: u32 = 128;

/// A scene under construction.
pub(super) struct Assembly<'f> {
    /// Content so far.
    pub scene: Description,
    /// Images that textures read.
    pub images: Images,
    /// Warnings so far.
    pub warnings: Warnings,
    /// Memory and triangles that the scene may still take.
    pub budget: Budget,
    /// Files that the scene may name.
    pub files: &'f mut dyn Files,
    /// Image settings so far.
    pub settings: ImageSettings,
    /// Map from the file's world to the scene's: the identity, or a reflection.
    pub world: DAffine3,
    /// Features that were reported.
    reported: HashSet<String>,
    /// Names of the models that extended the budget.
    models: HashSet<String>,
    /// Meshes of analytic shapes that cannot be analytic where they stand.
    forms: HashMap<form::Key, Option<usize>>,
}

impl<'f> Assembly<'f> {
    /// Returns an empty scene for a file of `input` bytes.
    pub fn new(input: usize, files: &'f mut dyn Files, settings: (u32, u32, u32, u32)) -> Self {
        let (width, height, samples, depth) = settings;
        Self {
            scene: Description::default(),
            images: Images::default(),
            warnings: Warnings::default(),
            budget: Budget::new(input),
            files,
            settings: ImageSettings { width, height, samples, depth, fresnel: Fresnel::Exact },
            world: DAffine3::IDENTITY,
            reported: HashSet::new(),
            models: HashSet::new(),
            forms: HashMap::new(),
        }
    }

    /// Warns once of a feature that is not rendered as the file states; `instead` says what is
    /// done.
    pub fn unsupported(&mut self, feature: &str, instead: &str, site: &SourceLocation) {
        if self.reported.len() < 1000 && self.reported.insert(feature.to_owned()) {
            let SourceLocation { file, place } = site;
            self.warnings.once(format!("{feature}: {instead} ({file}: {place})"));
        }
    }

    /// Extends the budget for a model of `bytes` bytes, unless it has done so before.
    pub fn extend_budget(&mut self, name: &str, bytes: usize) {
        if self.models.insert(name.to_owned()) {
            self.budget.extend(bytes);
        }
    }

    /// Adds a material after checking its numbers.
    pub fn add_material(&mut self, material: Material, site: &SourceLocation) -> Result<usize, SceneError> {
        material
            .check(self.images.all.len())
            .map_err(|fault| site.malformed(fault, "numbers must be in the ranges of the renderer"))?;
        self.budget.take(size_of::<Material>() as u64, site)?;
        self.scene.materials.push(material);
        Ok(self.scene.materials.len() - 1)
    }

    /// Adds a light after moving it to the scene's world and checking its numbers. A light that is
    /// black is left out.
    pub fn add_light(&mut self, mut light: PunctualLight, site: &SourceLocation) -> Result<(), SceneError> {
        let parts = light.parts_mut();
        if let Some((position, _)) = parts.placed {
            *position = self.world.transform_point3(*position);
        }
        if let Some(direction) = parts.direction {
            let turned = self.world.transform_vector3(*direction);
            *direction = crate::values::unit(turned).unwrap_or(DVec3::NEG_Y);
        }
        light
            .check()
            .map_err(|fault| site.malformed(fault, "numbers must be in the ranges of the renderer"))?;
        self.budget.take(size_of::<PunctualLight>() as u64, site)?;
        self.scene.lights.push(light);
        Ok(())
    }

    /// Adds uniform light from infinity.
    pub fn add_uniform_sky(&mut self, radiance: DVec3, site: &SourceLocation) -> Result<(), SceneError> {
        if !(radiance.min_element() >= 0.0 && radiance.max_element() <= crate::values::MAX_MAGNITUDE) {
            return Err(site.malformed("its radiance is out of range", "it must be from 0 to 1e18"));
        }
        match &mut self.scene.sky {
            None => self.scene.sky = Some(Sky::Gradient { bottom: radiance, top: radiance }),
            Some(Sky::Gradient { bottom, top }) => {
                *bottom = (*bottom + radiance).min(DVec3::splat(crate::values::MAX_MAGNITUDE));
                *top = *bottom;
            }
            Some(_) => self.unsupported("a second light from infinity", "left out", site),
        }
        Ok(())
    }

    /// Returns the description and the settings of the finished scene.
    pub fn finish(self, notes: Vec<String>) -> (Description, ImageSettings) {
        let mut scene = self.scene;
        scene.images = self.images.all;
        scene.warnings = self.warnings.finish();
        scene.notes = notes;
        (scene, self.settings)
    }
}
