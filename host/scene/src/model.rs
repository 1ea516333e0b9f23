//! Completes a model that is rendered without a scene file: adds the camera, the light and the
//! ground that it lacks.

use super::ImageSettings;
use super::description::{Description, Ground, PunctualLight, ShapeKind, Sky};
use super::error::SceneError;
use super::ground::END;
use super::limits::MAX_VERTEX;
use super::lower::camera_for;
use super::mesh_boxes::{self, MeshBoxes};
use super::own_light::OwnLight;
use super::surroundings::Surroundings;
use crate::{CameraPose, Fresnel};
use glam::DVec3;
use std::path::PathBuf;

/// Minimum size of a model that gets a ground of itself: its triangles have area in single
/// precision.
const MIN_GROUND: f64 = 1e-12;

/// Factor on the studio of a model with a sun, so that both together are about as bright as the
/// studio alone.
const SUNLIT_STUDIO: f64 = 0.4;

/// A model with the camera, the light and the ground that it lacked.
pub(super) struct Completed {
    pub description: Description,
    pub image: ImageSettings,
    /// Decisions about the model, for people.
    pub notes: Vec<String>,
}

/// Parts that a model lacks: a camera that sees all of it; the studio's light, unless its own
/// lights carry the image; a sun; and a ground, if it has neither camera nor light.
#[derive(Clone, Debug)]
pub(super) struct Additions {
    camera: Option<CameraPose>,
    sky: Option<Sky>,
    /// File that the sky was read from.
    file: Option<PathBuf>,
    sun: Option<PunctualLight>,
    ground: Option<Ground>,
    warnings: Vec<String>,
    notes: Vec<String>,
}

impl Additions {
    /// Returns what a model lacks; `surroundings` override it.
    ///
    /// # Errors
    ///
    /// [`SceneError`] for a panorama that cannot be read.
    pub fn of(model: &Description, surroundings: &Surroundings) -> Result<Self, SceneError> {
        let (mut warnings, mut notes) = (Vec::new(), Vec::new());
        let has_faces = model.instances.iter().filter_map(|instance| model.meshes.get(instance.mesh));
        let has_faces = has_faces.into_iter().any(|mesh| !mesh.triangles.is_empty());
        if !has_faces && model.shapes.is_empty() {
            warnings.push("the model has no triangles: there is nothing to see".to_owned());
        }
        let extent = Extent::of(model);
        let camera = model.cameras.is_empty().then(|| {
            let (center, radius) = extent.ball();
            notes.push(format!("{}the view shows all of the model", crate::camera_choice::NO_CAMERA));
            camera_for(center, radius)
        });
        let own = OwnLight::of(model);
        let is_lit = model.sky.is_some() || own == OwnLight::Enough;
        let (mut sky, mut file) = (None, None);
        if let Some(environment) = &surroundings.environment {
            let read = environment.sky(surroundings.sun)?;
            (sky, file) = (Some(read.0), read.1);
        } else if model.sky.is_none() {
            let scale = if surroundings.sun.is_some() { SUNLIT_STUDIO } else { 1.0 };
            let note = match own {
                OwnLight::Nothing => "no light: the built-in studio lights the model",
                OwnLight::Little => {
                    "the model's own lights do not carry the image: the built-in studio is added to them"
                }
                OwnLight::Enough => "lit by the model's own lights: no sky is added",
            };
            sky = (own != OwnLight::Enough).then_some(Sky::Studio { scale, rotation: 0.0 });
            notes.push(note.to_owned());
        }
        let mut ground = None;
        if surroundings.ground.unwrap_or(has_faces && camera.is_some() && !is_lit) {
            ground = ground_below(model, &extent, &mut notes);
        }
        let sun = surroundings.sun_light();
        Ok(Self { camera, sky, file, sun, ground, warnings, notes })
    }
}

/// Returns a camera that shows all of a scene.
pub(super) fn view_of_all(scene: &Description) -> CameraPose {
    let (center, radius) = Extent::of(scene).ball();
    camera_for(center, radius)
}

/// Gives a model what it lacks; `surroundings` override it.
///
/// # Errors
///
/// Those of [`Additions::of`].
pub(super) fn complete(model: Description, surroundings: &Surroundings) -> Result<Completed, SceneError> {
    let additions = Additions::of(&model, surroundings)?;
    Ok(complete_with(model, &additions))
}

/// Gives a model what was chosen for it at another time.
pub(super) fn complete_with(mut model: Description, additions: &Additions) -> Completed {
    let Additions { camera, sky, file, sun, ground, warnings, notes: more } = additions.clone();
    let mut notes = std::mem::take(&mut model.notes);
    let image = ImageSettings { width: 640, height: 360, samples: 64, depth: 50, fresnel: Fresnel::Exact };
    model.cameras.extend(camera.map(|camera| ("all".to_owned(), camera)));
    model.sky = sky.or(model.sky);
    model.files.extend(file);
    model.lights.extend(sun);
    model.ground = ground;
    model.warnings.extend(warnings);
    notes.extend(more);
    Completed { description: model, image, notes }
}

/// Returns a ground below the model, and notes what is unusual of it.
fn ground_below(model: &Description, extent: &Extent, notes: &mut Vec<String>) -> Option<Ground> {
    let (center, size) = extent.ball();
    let lowest = extent.low.y;
    let reach = center.abs().max_element() + END * size;
    if !(lowest.is_finite() && size >= MIN_GROUND && reach <= MAX_VERTEX) {
        notes.push("no ground: the model is too small or too far from the origin for one".to_owned());
        return None;
    }
    let ground = Ground::below(center, size, lowest);
    if model.cameras.first().is_some_and(|(_, camera)| camera.look_from.y < ground.center.y) {
        notes.push(
            "the model's camera is below the ground, which hides the model; `ground` off shows it".to_owned(),
        );
    }
    Some(ground)
}

/// Box around everything in the world; empty if there is nothing.
struct Extent {
    low: DVec3,
    high: DVec3,
}

impl Extent {
    fn of(model: &Description) -> Self {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut add = |p: DVec3| (low, high) = (low.min(p), high.max(p));
        let (boxes, is_large) = (MeshBoxes::of(model), mesh_boxes::is_large(model));
        for instance in &model.instances {
            boxes.points(model, instance, is_large).for_each(&mut add);
        }
        for shape in &model.shapes {
            match shape.kind {
                ShapeKind::Sphere { center, radius } => {
                    add(center - radius);
                    add(center + radius);
                }
                ShapeKind::Quad { corner, u, v } => {
                    [corner, corner + u, corner + v, corner + u + v].into_iter().for_each(&mut add);
                }
                ShapeKind::Disc { center, radius, .. } if !shape.kind.is_plane() => {
                    add(center - radius);
                    add(center + radius);
                }
                ShapeKind::Disc { .. } => {}
            }
        }
        Self { low, high }
    }

    /// Returns centre and radius of a ball around everything; radius 1 if there is nothing.
    fn ball(&self) -> (DVec3, f64) {
        if !(self.low.is_finite() && self.high.is_finite()) {
            return (DVec3::ZERO, 1.0);
        }
        let radius = 0.5 * (self.high - self.low).length();
        (0.5 * (self.low + self.high), if radius > 0.0 { radius } else { 1.0 })
    }
}

#[cfg(test)]
mod tests;
