//! Resolution of frames while the camera moves.

use super::viewer::{MIN_SCALE, ViewOptions};
use trisect_scene::CameraPose;

/// Frames a second that [`Pace`] keeps by default while the camera moves.
pub const MOVING_FPS: f64 = 10.0;

/// Least and greatest share of the time that a frame may take without another resolution: a new one
/// discards the frames before it.
const TOLERATED: std::ops::RangeInclusive<f64> = 0.6..=1.0;

/// Share of the time that a new resolution is chosen for.
const AIM: f64 = 0.8;

/// Chooses the scale of each frame: that of the options while the camera rests, and a lower one
/// while it moves, if frames would else take too long.
#[derive(Clone, Debug)]
pub struct Pace {
    /// Frames a second to keep; 0: all frames have the scale of the options.
    goal: f64,
    /// Seconds of the last frame, and its scale.
    took: Option<(f64, f64)>,
    /// Pose of the last frame, and its scale if the camera moved.
    last: Option<(CameraPose, Option<f64>)>,
}

impl Pace {
    /// Creates a pace that keeps `goal` frames a second; 0 never lowers the resolution.
    pub fn new(goal: f64) -> Self {
        Self { goal, took: None, last: None }
    }

    /// Sets the frames a second to keep.
    pub fn set_goal(&mut self, goal: f64) {
        self.goal = goal;
    }

    /// Returns the scale of the next frame, with this pose of the camera.
    pub fn scale(&mut self, look: &ViewOptions, pose: &CameraPose) -> f64 {
        let (before, moving) = match &self.last {
            Some((last, scale)) if last != pose => (*scale, true),
            _ => (None, false),
        };
        let scale =
            if moving && self.goal > 0.0 { self.moving_scale(look.scale, before) } else { look.scale };
        self.last = Some((*pose, moving.then_some(scale)));
        scale
    }

    /// Returns the scale for a moving camera, whose last frame had the scale `before` if it moved
    /// then, too.
    fn moving_scale(&self, full: f64, before: Option<f64>) -> f64 {
        let Some((seconds, scale)) = self.took else { return full };
        let share_of = |scale_now: f64| seconds * (scale_now / scale).powi(2) * self.goal;
        let kept = before.unwrap_or(full).min(full);
        let share = share_of(kept);
        if TOLERATED.contains(&share) || kept == full && share < 1.0 {
            return kept;
        }
        (kept * (AIM / share).sqrt()).clamp(MIN_SCALE.min(full), full)
    }

    /// Learns the seconds that a frame with this scale took.
    pub fn learn(&mut self, scale: f64, seconds: f64) {
        if seconds > 0.0 && scale > 0.0 {
            self.took = Some((seconds, scale));
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "this is how a test fails")]

    use super::*;
    use crate::render::Settings;
    use trisect_scene::Scene;

    /// A device: seconds of a frame of the whole size, without those that each frame takes.
    fn frames(goal: f64, (each, whole): (f64, f64), moving: impl Fn(u32) -> bool) -> Vec<(f64, f64)> {
        let scene = Scene::hello_world().unwrap();
        let look = ViewOptions::new(Settings::of(&scene), None);
        let (mut pace, mut pose) = (Pace::new(goal), scene.camera);
        let mut all = Vec::new();
        for frame in 0..40 {
            if moving(frame) {
                pose.look_from.x += 0.1;
            }
            let scale = pace.scale(&look, &pose);
            let seconds = each + whole * scale * scale;
            pace.learn(scale, seconds);
            all.push((scale, seconds));
        }
        all
    }

    #[test]
    fn a_moving_camera_keeps_the_pace() {
        for (each, whole) in [(0.0, 0.3), (0.01, 1.0), (0.03, 4.0), (0.0, 0.12)] {
            let all = frames(10.0, (each, whole), |frame| (5..30).contains(&frame));
            assert!(all[..5].iter().chain(&all[30..]).all(|frame| frame.0 == 1.0), "{whole}: {all:?}");
            // One frame may be needed to learn what each frame takes whatever its size.
            assert!(all[8..30].iter().all(|frame| frame.1 <= 0.111), "{whole}: {all:?}");
            assert!(all[8..30].iter().all(|frame| frame.1 > 0.05), "{whole}: {all:?}");
            let changes = all[5..30].windows(2).filter(|pair| pair[0].0 != pair[1].0).count();
            assert!(changes <= 3, "{whole}: {changes} resolutions while moving");
        }
    }

    /// Negative control: without a goal the same device falls behind.
    #[test]
    fn without_a_goal_or_need_nothing_changes() {
        assert!(frames(0.0, (0.0, 1.0), |_| true).iter().all(|frame| *frame == (1.0, 1.0)));
        assert!(frames(10.0, (0.0, 0.09), |_| true).iter().all(|frame| frame.0 == 1.0));
    }

    /// A device far too slow gets the least resolution, and no number is invalid.
    #[test]
    fn the_least_resolution_is_the_end() {
        let all = frames(10.0, (5.0, 1000.0), |_| true);
        assert!(all.iter().all(|frame| (MIN_SCALE..=1.0).contains(&frame.0)));
        assert_eq!(all[39].0, MIN_SCALE);
    }
}
