//! Completes a model that is rendered without a scene file: adds the camera, the light and the
//! ground that it lacks.

use super::ImageSettings;
use super::description::{Description, Ground, ShapeKind, Sky};
use super::error::SceneError;
use super::ground::END;
use super::limits::MAX_VERTEX;
use super::lower::camera_for;
use super::mesh_boxes::{self, MeshBoxes};
use super::own_light::OwnLight;
use super::surroundings::Surroundings;
use crate::Fresnel;
use glam::DVec3;

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

/// Gives a model a camera that sees all of it, if it has no camera; the studio's light, unless its
/// own lights carry the image; and a ground, if it has neither. `surroundings` override that.
pub(super) fn complete(mut model: Description, surroundings: &Surroundings) -> Result<Completed, SceneError> {
    let mut notes = std::mem::take(&mut model.notes);
    let image = ImageSettings { width: 640, height: 360, samples: 64, depth: 50, fresnel: Fresnel::Exact };
    let has_faces = model.instances.iter().filter_map(|instance| model.meshes.get(instance.mesh));
    let has_faces = has_faces.into_iter().any(|mesh| !mesh.triangles.is_empty());
    if !has_faces && model.shapes.is_empty() {
        model.warnings.push("the model has no triangles: there is nothing to see".to_owned());
    }
    let extent = Extent::of(&model);
    let has_camera = !model.cameras.is_empty();
    if !has_camera {
        let (center, radius) = extent.ball();
        model.cameras.push(("all".to_owned(), camera_for(center, radius)));
        notes.push("no camera: the view shows all of the model".to_owned());
    }
    let is_lit = light(&mut model, surroundings, &mut notes)?;
    let ground = surroundings.ground.unwrap_or(has_faces && !has_camera && !is_lit);
    if ground && let Some(note) = add_ground(&mut model, &extent, has_camera) {
        notes.push(note);
    }
    Ok(Completed { description: model, image, notes })
}

/// Gives the model its sky and sun. Returns whether it has light of its own that carries the image.
fn light(
    model: &mut Description,
    surroundings: &Surroundings,
    notes: &mut Vec<String>,
) -> Result<bool, SceneError> {
    let own = OwnLight::of(model);
    let is_lit = model.sky.is_some() || own == OwnLight::Enough;
    if surroundings.environment.is_some() {
        surroundings.apply_environment(model)?;
    } else if model.sky.is_none() {
        let scale = if surroundings.sun.is_some() { SUNLIT_STUDIO } else { 1.0 };
        let studio = Some(Sky::Studio { scale, rotation: 0.0 });
        let (sky, note) = match own {
            OwnLight::Nothing => (studio, "no light: the built-in studio lights the model"),
            OwnLight::Little => (
                studio,
                "the model's own lights do not carry the image: the built-in studio is added to them",
            ),
            OwnLight::Enough => (None, "lit by the model's own lights: no sky is added"),
        };
        model.sky = sky;
        notes.push(note.to_owned());
    }
    model.lights.extend(surroundings.sun.map(|sun| sun.light()));
    Ok(is_lit)
}

/// Adds a ground below the model. Returns a note about what is unusual of it.
fn add_ground(model: &mut Description, extent: &Extent, has_camera: bool) -> Option<String> {
    let (center, size) = extent.ball();
    let lowest = extent.low.y;
    let reach = center.abs().max_element() + END * size;
    if !(lowest.is_finite() && size >= MIN_GROUND && reach <= MAX_VERTEX) {
        return Some("no ground: the model is too small or too far from the origin for one".to_owned());
    }
    let ground = Ground::below(center, size, lowest);
    model.ground = Some(ground);
    let camera = model.cameras.first().filter(|_| has_camera);
    let is_below = camera.is_some_and(|(_, camera)| camera.look_from.y < ground.center.y);
    is_below.then(|| {
        "the model's camera is below the ground, which hides the model; `ground` off shows it".to_owned()
    })
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
            if let ShapeKind::Sphere { center, radius } = shape.kind {
                add(center - radius);
                add(center + radius);
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
