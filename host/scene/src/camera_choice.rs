//! Choice of a scene's camera, and changes of its pose, in place of the file's own.

use crate::camera::focus_on;
use crate::description::Description;
use crate::{CameraPose, SceneDocument, SceneError};
use glam::DVec3;

/// Maximum relative difference of two distances of focus that are one: what rounding makes.
const SAME_FOCUS: f64 = 1e-9;

/// Choice of a scene's camera, and changes of its pose; lengths in scene units, angles in radians.
/// What is `None` stays as the file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraChoice {
    /// Name of the camera, or its number from 0 on; `None` is the first.
    pub name: Option<String>,
    /// Centre of the lens.
    pub look_from: Option<DVec3>,
    /// A point on the optical axis.
    pub look_at: Option<DVec3>,
    /// Up direction of the image.
    pub up: Option<DVec3>,
    /// Vertical angle of the whole image, which makes a parallel projection a perspective.
    pub vertical_fov: Option<f64>,
    /// Cone angle from a point in focus to the lens; 0 for a pinhole.
    pub defocus_angle: Option<f64>,
    /// Distance from the lens to the plane in focus. If `None`, a camera that focuses on what it
    /// looks at continues to do so.
    pub focus_distance: Option<f64>,
}

impl CameraChoice {
    /// Returns the changed pose of a camera.
    fn change(&self, pose: &CameraPose) -> CameraPose {
        let Self { name: _, look_from, look_at, up, vertical_fov, defocus_angle, focus_distance } = self;
        let (from, at) = (look_from.unwrap_or(pose.look_from), look_at.unwrap_or(pose.look_at));
        let before = focus_on(pose.look_at, pose.look_from);
        let follows = (pose.focus_distance / before - 1.0).abs() < SAME_FOCUS;
        let kept = if follows { focus_on(at, from) } else { pose.focus_distance };
        CameraPose {
            look_from: from,
            look_at: at,
            up: up.unwrap_or(pose.up),
            vertical_fov: vertical_fov.unwrap_or(pose.vertical_fov),
            defocus_angle: defocus_angle.unwrap_or(pose.defocus_angle),
            focus_distance: focus_distance.unwrap_or(kept),
            parallel_height: if vertical_fov.is_some() { 0.0 } else { pose.parallel_height },
        }
    }

    fn apply(&self, scene: &mut Description) -> Result<(), String> {
        if *self == Self::default() {
            return Ok(());
        }
        let index = match &self.name {
            None => 0,
            Some(name) => {
                let named = scene.cameras.iter().position(|(of, _)| of == name);
                let index = named.or_else(|| name.parse().ok()).filter(|index| *index < scene.cameras.len());
                index.ok_or_else(|| unknown(name, scene))?
            }
        };
        if index >= scene.cameras.len() {
            return Ok(());
        }
        let (name, pose) = scene.cameras.remove(index);
        let pose = self.change(&pose);
        pose.check().map_err(|problem| format!("camera \"{name}\" with the given changes: {problem}"))?;
        scene.cameras.insert(0, (name, pose));
        Ok(())
    }
}

fn unknown(name: &str, scene: &Description) -> String {
    let names: Vec<String> =
        scene.cameras.iter().enumerate().map(|(index, (name, _))| format!("{index} \"{name}\"")).collect();
    format!("unknown camera \"{name}\"; available: {}", names.join(", "))
}

/// Start of the note that a scene without a camera gets a view of all of it.
pub(crate) const NO_CAMERA: &str = "no camera: ";

impl SceneDocument {
    /// Chooses the camera, and changes its pose.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for an unknown camera, or a pose that is not valid.
    pub fn choose_camera(&mut self, choice: &CameraChoice) -> Result<(), SceneError> {
        let inconsistent = |message| SceneError::Inconsistent { file: self.name.clone(), message };
        choice.apply(&mut self.description).map_err(inconsistent)?;
        if choice.look_from.is_some() {
            // The view is no longer that of all.
            self.notes.retain(|note| !note.starts_with(NO_CAMERA));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;

    fn document() -> SceneDocument {
        let mut document = SceneDocument::hello_world().unwrap();
        let other = CameraPose { look_from: DVec3::Z, parallel_height: 2.0, ..CameraPose::PINHOLE };
        document.description.cameras.push(("side".to_owned(), other));
        document
    }

    #[test]
    fn cameras_by_name_and_number() {
        for name in ["side", "1"] {
            let mut document = document();
            let choice = CameraChoice { name: Some(name.to_owned()), ..CameraChoice::default() };
            document.choose_camera(&choice).unwrap();
            let [(first, pose), (second, _)] = document.description.cameras.as_slice() else { panic!() };
            assert_eq!((first.as_str(), second.as_str()), ("side", "camera"));
            assert_eq!(pose.parallel_height, 2.0);
        }
        for name in ["top", "2", "-1", ""] {
            let choice = CameraChoice { name: Some(name.to_owned()), ..CameraChoice::default() };
            let error = document().choose_camera(&choice).unwrap_err().to_string();
            assert!(error.contains("available: 0 \"camera\", 1 \"side\""), "{error}");
        }
    }

    /// A plane in focus at `look_at` stays there, and another one keeps its distance.
    #[test]
    fn the_focus_follows_what_it_was_on() {
        let pose = CameraPose { look_from: DVec3::Z * 5.0, look_at: DVec3::ZERO, ..CameraPose::PINHOLE };
        let moved = |focus_distance: f64, choice: &CameraChoice| {
            choice.change(&CameraPose { focus_distance, ..pose }).focus_distance
        };
        let away = CameraChoice { look_from: Some(DVec3::Z * 7.0), ..CameraChoice::default() };
        assert_eq!((moved(5.0, &away), moved(5.0 * (1.0 + 1e-15), &away)), (7.0, 7.0));
        assert_eq!(moved(4.0, &away), 4.0);
        let stated = CameraChoice { focus_distance: Some(3.0), ..away };
        assert_eq!(moved(5.0, &stated), 3.0);
    }

    #[test]
    fn poses_change_and_are_checked() {
        let mut document = document();
        let before = document.description.cameras[0].1;
        let choice =
            CameraChoice { look_from: Some(DVec3::ONE), vertical_fov: Some(0.5), ..CameraChoice::default() };
        document.choose_camera(&choice).unwrap();
        let after = document.description.cameras[0].1;
        assert_eq!(after, CameraPose { look_from: DVec3::ONE, vertical_fov: 0.5, ..before });
        let bad = CameraChoice { look_from: Some(before.look_at), ..CameraChoice::default() };
        let error = document.choose_camera(&bad).unwrap_err().to_string();
        assert!(
            error.contains("with the given changes: look_from and look_at are the same point"),
            "{error}"
        );
        // A field of view makes a perspective.
        let side = CameraChoice { name: Some("side".to_owned()), ..choice };
        document.choose_camera(&side).unwrap();
        assert_eq!(document.description.cameras[0].1.parallel_height, 0.0);
    }
}
