//! Completes a model that is rendered without a scene file: adds the camera and the sky that it
//! lacks.

use super::ImageSettings;
use super::description::{Description, ShapeKind, Sky};
use super::lower::camera_for;
use super::own_light::OwnLight;
use crate::{CameraPose, Fresnel};
use glam::DVec3;

/// A model with the camera and the sky that it lacked.
pub(super) struct Completed {
    pub description: Description,
    pub image: ImageSettings,
    /// Decisions about the model, for people.
    pub notes: Vec<String>,
}

/// The camera and the sky that a model lacks.
#[derive(Clone, Debug)]
pub(super) struct Additions {
    camera: Option<CameraPose>,
    sky: Option<Sky>,
    warnings: Vec<String>,
    notes: Vec<String>,
}

impl Additions {
    /// Returns a camera that sees all of a model, if it has no camera, and a sky of radiance 1,
    /// unless its own lights carry the image.
    pub fn of(model: &Description) -> Self {
        let (mut warnings, mut notes) = (Vec::new(), Vec::new());
        let has_faces = model.instances.iter().filter_map(|instance| model.meshes.get(instance.mesh));
        let has_faces = has_faces.into_iter().any(|mesh| !mesh.triangles.is_empty());
        if !has_faces && model.shapes.is_empty() {
            warnings.push("the model has no triangles: there is nothing to see".to_owned());
        }
        let camera = model.cameras.is_empty().then(|| {
            let (center, radius) = ball(model);
            warnings.push("no camera: the view shows all of the model".to_owned());
            camera_for(center, radius)
        });
        let mut sky = None;
        if model.sky.is_none() {
            let reason = match OwnLight::of(model) {
                OwnLight::Nothing => Some("no light: the sky has radiance 1"),
                OwnLight::Little => Some(
                    "the model's own lights do not carry the image: a sky of radiance 1 is added to them",
                ),
                OwnLight::Enough => None,
            };
            match reason {
                Some(reason) => {
                    sky = Some(Sky::Gradient { bottom: DVec3::ONE, top: DVec3::ONE });
                    warnings.push(reason.to_owned());
                }
                None => notes.push("lit by the model's own lights: no sky is added".to_owned()),
            }
        }
        Self { camera, sky, warnings, notes }
    }
}

/// Gives a model the camera and the sky that it lacks.
pub(super) fn complete(model: Description) -> Completed {
    let additions = Additions::of(&model);
    complete_with(model, &additions)
}

/// Gives a model a camera and a sky, as they were chosen for the model at another time.
pub(super) fn complete_with(mut model: Description, additions: &Additions) -> Completed {
    let Additions { camera, sky, warnings, notes: more } = additions.clone();
    let mut notes = std::mem::take(&mut model.notes);
    let image = ImageSettings { width: 640, height: 360, samples: 64, depth: 50, fresnel: Fresnel::Exact };
    model.cameras.extend(camera.map(|camera| ("all".to_owned(), camera)));
    model.sky = model.sky.or(sky);
    model.warnings.extend(warnings);
    notes.extend(more);
    Completed { description: model, image, notes }
}

/// Returns centre and radius of a ball around everything; radius 1 if there is nothing.
fn ball(model: &Description) -> (DVec3, f64) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut add = |p: DVec3| (low, high) = (low.min(p), high.max(p));
    for instance in &model.instances {
        let Some(mesh) = model.meshes.get(instance.mesh) else { continue };
        for &[x, y, z] in &mesh.positions {
            add(instance.transform.transform_point3(DVec3::new(f64::from(x), f64::from(y), f64::from(z))));
        }
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
