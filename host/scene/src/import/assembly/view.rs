//! Cameras of imported scenes.

use crate::CameraPose;
use glam::{DAffine3, DVec3};

/// Projection of a camera.
#[derive(Clone, Copy, Debug)]
pub enum Projection {
    /// Tangent of half the vertical angle.
    Perspective { half_height: f64 },
    /// Half the height of the view, in the camera's units.
    Parallel { half_height: f64 },
}

/// A camera by its axes in the world.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Map from the camera's coordinates to the world: z is the direction of the view, y is up.
    pub to_world: DAffine3,
    /// Direction of the camera's coordinates that is right in the image: x or -x.
    pub right: DVec3,
    /// Projection of the view.
    pub projection: Projection,
    /// Radius of the lens in the camera's units; 0 for a pinhole.
    pub lens_radius: f64,
    /// Distance of the plane in focus in the camera's units.
    pub focus_distance: f64,
}

/// Returns the reflection that makes a left-handed world right-handed.
pub fn reflection() -> DAffine3 {
    DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))
}

impl View {
    /// Returns whether the image shows the world as in a mirror, so that the world must be
    /// reflected for a camera that does not.
    pub fn is_mirrored(&self) -> bool {
        let right = self.to_world.transform_vector3(self.right);
        let (up, ahead) = (self.to_world.matrix3.y_axis, self.to_world.matrix3.z_axis);
        right.dot(up.cross(ahead)) > 0.0
    }

    /// Returns the pose in a world that `world` maps the file's to.
    ///
    /// # Errors
    ///
    /// A message that says what would be valid.
    pub fn pose(&self, world: &DAffine3) -> Result<CameraPose, String> {
        let map = *world * self.to_world;
        let ahead = map.matrix3.z_axis;
        let length = ahead.length();
        let mut pose = CameraPose {
            look_from: map.translation,
            look_at: map.translation + ahead / length,
            up: map.matrix3.y_axis.normalize_or_zero(),
            ..CameraPose::PINHOLE
        };
        match self.projection {
            Projection::Perspective { half_height } => pose.vertical_fov = 2.0 * half_height.atan(),
            Projection::Parallel { half_height } => {
                pose.parallel_height = 2.0 * half_height * map.matrix3.y_axis.length();
            }
        }
        if self.lens_radius > 0.0 {
            pose.focus_distance = self.focus_distance * length;
            pose.defocus_angle = 2.0 * (self.lens_radius / self.focus_distance).atan();
        }
        pose.check()?;
        Ok(pose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(to_world: DAffine3) -> View {
        let projection = Projection::Perspective { half_height: 0.5 };
        View { to_world, right: DVec3::X, projection, lens_radius: 0.1, focus_distance: 2.0 }
    }

    #[test]
    fn left_handed_worlds_are_reflected() {
        // A view along +z with +x at the right and +y up is left-handed.
        let left = view(DAffine3::IDENTITY);
        assert!(left.is_mirrored());
        let pose = left.pose(&reflection()).unwrap();
        assert_eq!((pose.look_at, pose.up), (DVec3::Z, DVec3::Y));
        assert!(!view(reflection()).is_mirrored());
        assert!((pose.vertical_fov - 2.0 * 0.5f64.atan()).abs() < 1e-15);
    }

    #[test]
    fn lenses_scale_with_the_camera() {
        let pose = view(DAffine3::from_scale(DVec3::splat(3.0))).pose(&DAffine3::IDENTITY).unwrap();
        assert!((pose.focus_distance - 6.0).abs() < 1e-12);
        let radius = pose.focus_distance * (0.5 * pose.defocus_angle).tan();
        assert!((radius - 0.3).abs() < 1e-12);
    }
}
