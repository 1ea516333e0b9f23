//! Completes a model that is rendered without a scene file: adds the camera and the sky that it
//! lacks.

use super::ImageSettings;
use super::description::{Description, ShapeKind, Sky};
use super::lower::camera_for;
use super::mesh_boxes::{self, MeshBoxes};
use super::own_light::OwnLight;
use crate::Fresnel;
use glam::DVec3;

/// A model with the camera and the sky that it lacked.
pub(super) struct Completed {
    pub description: Description,
    pub image: ImageSettings,
    /// Decisions about the model, for people.
    pub notes: Vec<String>,
}

/// Gives a model a camera that sees all of it, if it has no camera, and a sky of radiance 1, unless
/// its own lights carry the image.
pub(super) fn complete(mut model: Description) -> Completed {
    let mut notes = std::mem::take(&mut model.notes);
    let image = ImageSettings { width: 640, height: 360, samples: 64, depth: 50, fresnel: Fresnel::Exact };
    let has_faces = model.instances.iter().filter_map(|instance| model.meshes.get(instance.mesh));
    let has_faces = has_faces.into_iter().any(|mesh| !mesh.triangles.is_empty());
    if !has_faces && model.shapes.is_empty() {
        model.warnings.push("the model has no triangles: there is nothing to see".to_owned());
    }
    if model.cameras.is_empty() {
        let (center, radius) = ball(&model);
        model.cameras.push(("all".to_owned(), camera_for(center, radius)));
        model.warnings.push("no camera: the view shows all of the model".to_owned());
    }
    if model.sky.is_none() {
        let reason = match OwnLight::of(&model) {
            OwnLight::Nothing => Some("no light: the sky has radiance 1"),
            OwnLight::Little => {
                Some("the model's own lights do not carry the image: a sky of radiance 1 is added to them")
            }
            OwnLight::Enough => None,
        };
        match reason {
            Some(reason) => {
                model.sky = Some(Sky::Gradient { bottom: DVec3::ONE, top: DVec3::ONE });
                model.warnings.push(reason.to_owned());
            }
            None => notes.push("lit by the model's own lights: no sky is added".to_owned()),
        }
    }
    Completed { description: model, image, notes }
}

/// Returns centre and radius of a ball around everything; radius 1 if there is nothing.
fn ball(model: &Description) -> (DVec3, f64) {
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
    if !(low.is_finite() && high.is_finite()) {
        return (DVec3::ZERO, 1.0);
    }
    let radius = 0.5 * (high - low).length();
    (0.5 * (low + high), if radius > 0.0 { radius } else { 1.0 })
}
