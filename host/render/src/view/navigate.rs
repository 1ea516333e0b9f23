//! Interactive navigation of a camera: orbit and fly.

use glam::{DQuat, DVec3};
use trisect_scene::CameraPose;

/// Minimum angle in radians between the viewing direction and straight up or down; beyond it the
/// image would turn over.
const POLE: f64 = 0.02;

/// Minimum and maximum distance to the centre of an orbit, relative to the distance at the start,
/// and likewise of the height of a parallel view.
const DISTANCES: (f64, f64) = (1e-4, 1e4);

/// Mode of moving a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NavigationMode {
    /// Around the point that the camera looks at.
    Orbit,
    /// Through the scene, in the viewing direction.
    Fly,
}

/// Camera that the user moves. It does not roll: `up` stays up.
#[derive(Clone, Debug, PartialEq)]
pub struct Navigator {
    /// Mode of moving.
    pub mode: NavigationMode,
    start: CameraPose,
    pose: CameraPose,
}

impl Navigator {
    /// Returns a navigator that starts at a valid pose.
    pub fn new(pose: CameraPose) -> Self {
        let up = pose.up.normalize_or(DVec3::Y);
        let pose = CameraPose { up, ..pose };
        Self { mode: NavigationMode::Orbit, start: pose, pose }
    }

    /// Returns the current pose.
    pub fn pose(&self) -> CameraPose {
        self.pose
    }

    /// Moves the camera back to the start.
    pub fn reset(&mut self) {
        self.pose = self.start;
    }

    /// Returns the vector from the camera to the point that it looks at.
    fn towards(&self) -> DVec3 {
        self.pose.look_at - self.pose.look_from
    }

    /// Returns the unit direction to the right in the image.
    fn right(&self) -> DVec3 {
        self.towards().cross(self.pose.up).normalize_or(DVec3::X)
    }

    /// Returns the vector `towards` turned by radians to the right and up, at most to the poles.
    fn turned(&self, right: f64, up: f64) -> DVec3 {
        let towards = self.towards();
        let height = towards.normalize().dot(self.pose.up).clamp(-1.0, 1.0).asin();
        let limit = std::f64::consts::FRAC_PI_2 - POLE;
        let up = (height + up).clamp(-limit.max(height.abs()), limit.max(height.abs())) - height;
        let turned = DQuat::from_axis_angle(self.right(), up) * towards;
        DQuat::from_axis_angle(self.pose.up, -right) * turned
    }

    /// Turns the viewing direction by radians to the right and up. In an orbit the camera moves the
    /// opposite way around the point, so that the scene turns as if it was held.
    pub fn turn(&mut self, right: f64, up: f64) {
        let towards = self.turned(right, up);
        match self.mode {
            NavigationMode::Orbit => self.place(self.pose.look_at - towards, self.pose.look_at),
            NavigationMode::Fly => self.place(self.pose.look_from, self.pose.look_from + towards),
        };
    }

    /// Returns whether the camera is a parallel projection, whose distance does not change what is
    /// seen.
    pub fn is_parallel(&self) -> bool {
        self.pose.parallel_height > 0.0
    }

    /// Shifts camera and point to the right and up, in units of their distance; a parallel view in
    /// units of its height.
    pub fn pan(&mut self, right: f64, up: f64) {
        let upwards = self.right().cross(self.towards()).normalize_or(self.pose.up);
        let unit = if self.is_parallel() { self.pose.parallel_height } else { self.towards().length() };
        let shift = (self.right() * right + upwards * up) * unit;
        self.place(self.pose.look_from + shift, self.pose.look_at + shift);
    }

    /// Divides the distance to the point by e^`closer`. The plane in focus stays on the point if it
    /// was there. Of a parallel view it divides the height, and the camera stays.
    pub fn dolly(&mut self, closer: f64) {
        if self.is_parallel() {
            return self.zoom(closer);
        }
        let first = (self.start.look_at - self.start.look_from).length();
        let now = self.towards().length();
        let wanted = (now * (-closer).exp()).clamp(first * DISTANCES.0, first * DISTANCES.1);
        let by = wanted / now;
        let focused = (self.pose.focus_distance / now - 1.0).abs() < 1e-6;
        if self.place(self.pose.look_at - self.towards() * by, self.pose.look_at) && focused {
            self.pose.focus_distance = wanted;
        }
    }

    /// Divides the height of a parallel view by e^`closer`.
    fn zoom(&mut self, closer: f64) {
        let first = self.start.parallel_height;
        let wanted = self.pose.parallel_height * (-closer).exp();
        let parallel_height = wanted.clamp(first * DISTANCES.0, first * DISTANCES.1);
        let pose = CameraPose { parallel_height, ..self.pose };
        if pose.check().is_ok() {
            self.pose = pose;
        }
    }

    /// Moves forwards, to the right and up, in units of the distance at the start.
    pub fn fly(&mut self, forwards: f64, right: f64, up: f64) {
        let first = (self.start.look_at - self.start.look_from).length();
        let ahead = self.towards().normalize_or(DVec3::NEG_Z);
        let shift = (ahead * forwards + self.right() * right + self.pose.up * up) * first;
        self.place(self.pose.look_from + shift, self.pose.look_at + shift);
    }

    /// Takes the new pose if it is valid and returns whether it is; otherwise, as for overflowing
    /// numbers, the camera stays.
    fn place(&mut self, look_from: DVec3, look_at: DVec3) -> bool {
        let pose = CameraPose { look_from, look_at, ..self.pose };
        let good = pose.check().is_ok();
        if good {
            self.pose = pose;
        }
        good
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start() -> Navigator {
        Navigator::new(CameraPose {
            look_from: DVec3::new(0.0, 0.0, 5.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y * 3.0,
            vertical_fov: 1.0,
            focus_distance: 5.0,
            ..CameraPose::PINHOLE
        })
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-9
    }

    #[test]
    fn an_orbit_keeps_its_distance_and_does_not_turn_over() {
        let mut camera = start();
        camera.turn(std::f64::consts::FRAC_PI_2, 0.0);
        assert!(near(camera.pose().look_from, DVec3::new(-5.0, 0.0, 0.0)), "{:?}", camera.pose());
        camera.turn(0.0, -10.0);
        let pose = camera.pose();
        assert!(
            (pose.look_from.length() - 5.0).abs() < 1e-9 && pose.look_from.y > 4.99 && pose.check().is_ok()
        );
        camera.reset();
        assert_eq!(camera, start());
    }

    #[test]
    fn ways() {
        let mut camera = start();
        camera.pan(0.1, 0.2);
        assert!(near(camera.pose().look_from, DVec3::new(0.5, 1.0, 5.0)));
        assert!(near(camera.pose().look_at, DVec3::new(0.5, 1.0, 0.0)));
        let mut camera = start();
        camera.dolly(2.0f64.ln());
        assert!(near(camera.pose().look_from, DVec3::new(0.0, 0.0, 2.5)));
        assert!((camera.pose().focus_distance - 2.5).abs() < 1e-12);
        (0..100).for_each(|_| camera.dolly(1.0));
        assert!(camera.pose().look_from.z > 1e-4 && camera.pose().check().is_ok());
        let mut camera = start();
        camera.mode = NavigationMode::Fly;
        camera.fly(0.2, 0.4, -0.2);
        assert!(near(camera.pose().look_from, DVec3::new(2.0, -1.0, 4.0)));
        camera.turn(std::f64::consts::PI, 0.0);
        assert!(near(camera.pose().look_from, DVec3::new(2.0, -1.0, 4.0)));
        assert!(near(camera.pose().look_at, DVec3::new(2.0, -1.0, 9.0)));
    }

    /// A parallel view is zoomed by its height, which its distance does not do, and a pan by the
    /// height of the window moves it by its height.
    #[test]
    fn a_parallel_view_is_zoomed() {
        let parallel = CameraPose { parallel_height: 2.0, ..start().pose() };
        let mut camera = Navigator::new(parallel);
        camera.dolly(2.0f64.ln());
        assert!((camera.pose().parallel_height - 1.0).abs() < 1e-12);
        assert_eq!(CameraPose { parallel_height: 2.0, ..camera.pose() }, Navigator::new(parallel).pose());
        camera.pan(0.5, 1.0);
        assert!(near(camera.pose().look_from, DVec3::new(0.5, 1.0, 5.0)), "{:?}", camera.pose());
        assert!(near(camera.pose().look_at, DVec3::new(0.5, 1.0, 0.0)));
        for (closer, height) in [(1.0, 2e-4), (-1.0, 2e4)] {
            (0..100).for_each(|_| camera.dolly(closer));
            assert!((camera.pose().parallel_height / height - 1.0).abs() < 1e-9);
        }
        camera.dolly(f64::NAN);
        assert!(camera.pose().check().is_ok());
        camera.reset();
        assert!(camera.is_parallel() && camera == Navigator::new(parallel));
        // Negative control: in a perspective the height stays 0.
        let mut camera = start();
        camera.dolly(1.0);
        assert!(!camera.is_parallel());
    }

    #[test]
    fn no_pose_beyond_numbers() {
        let mut camera = start();
        (0..200).for_each(|_| camera.fly(1e300, f64::MAX, f64::NAN));
        assert_eq!(camera, start());
        camera.turn(f64::NAN, 0.0);
        camera.dolly(f64::NAN);
        camera.pan(f64::INFINITY, 0.0);
        assert_eq!(camera, start());
    }
}
