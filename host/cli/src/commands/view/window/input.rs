//! Mouse and keyboard: moves the camera and reports pressed keys.

use egui::{InputState, Key, PointerButton, Response};
use trisect::view::{NavigationMode, Navigator};

/// Radians of an orbit for a drag across the image's height; in fly mode the view turns by half.
const TURN: f64 = std::f64::consts::PI;

/// Speed of a held key per second, as the methods of [`Navigator`] take it: radians for turns, and
/// relative to a distance for the other movements.
const SPEED: f64 = 0.8;

/// Points of the wheel that divide the distance by e, or the height of a parallel view; in fly
/// mode, that move by the distance at the start.
const WHEEL: f64 = 400.0;

/// Keys pressed since the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Keys {
    pub quit: bool,
    pub compare: bool,
    pub panel: bool,
    pub save_image: bool,
    pub save_radiance: bool,
    pub save_camera: bool,
    pub help: bool,
    pub next_layer: bool,
}

/// Moves the camera by the mouse over the image. `scroll` is in points.
pub fn mouse(response: &Response, scroll: f32, shift: bool, navigator: &mut Navigator) {
    let height = f64::from(response.rect.height().max(1.0));
    let drag = response.drag_delta();
    let (right, down) = (f64::from(drag.x) / height, f64::from(drag.y) / height);
    let pans =
        shift || response.dragged_by(PointerButton::Secondary) || response.dragged_by(PointerButton::Middle);
    if response.dragged() && (right, down) != (0.0, 0.0) {
        drag_camera(navigator, (right, down), pans);
    }
    if response.hovered() && scroll != 0.0 {
        turn_wheel(navigator, f64::from(scroll) / WHEEL);
    }
}

/// Moves the camera forwards by the wheel, or zooms a parallel view, which a move would not change.
fn turn_wheel(navigator: &mut Navigator, forwards: f64) {
    match navigator.mode {
        NavigationMode::Fly if !navigator.is_parallel() => navigator.fly(forwards, 0.0, 0.0),
        _ => navigator.dolly(forwards),
    }
}

/// Moves the camera by a drag to the right and down, in heights of the image. The scene follows the
/// pointer as if it was held; in fly mode the view does.
fn drag_camera(navigator: &mut Navigator, (right, down): (f64, f64), pans: bool) {
    match (pans, navigator.mode) {
        (true, _) => navigator.pan(-right, down),
        (false, NavigationMode::Orbit) => navigator.turn(right * TURN, -down * TURN),
        (false, NavigationMode::Fly) => navigator.turn(right * TURN / 2.0, -down * TURN / 2.0),
    }
}

/// Moves the camera by the keys that are held during `seconds`. Returns whether any is.
pub fn held(input: &InputState, seconds: f64, navigator: &mut Navigator) -> bool {
    let axis = |more: Key, less: Key| f64::from(input.key_down(more)) - f64::from(input.key_down(less));
    let step = SPEED * seconds * if input.modifiers.shift { 4.0 } else { 1.0 };
    let (ahead, right, up) = (axis(Key::W, Key::S), axis(Key::D, Key::A), axis(Key::E, Key::Q));
    let turn = (axis(Key::ArrowRight, Key::ArrowLeft), axis(Key::ArrowUp, Key::ArrowDown));
    let moves = (ahead, right, up) != (0.0, 0.0, 0.0);
    let turns = turn != (0.0, 0.0);
    if moves {
        match navigator.mode {
            NavigationMode::Orbit => {
                navigator.dolly(ahead * step);
                navigator.pan(right * step, up * step);
            }
            NavigationMode::Fly => navigator.fly(ahead * step, right * step, up * step),
        }
    }
    if turns {
        navigator.turn(turn.0 * step, turn.1 * step);
    }
    moves || turns
}

/// Handles keys that act once: M and R here, the others for the caller.
pub fn pressed(input: &InputState, navigator: &mut Navigator) -> Keys {
    let key = |key| input.key_pressed(key) && !input.modifiers.command;
    if key(Key::M) {
        navigator.mode =
            if navigator.mode == NavigationMode::Orbit { NavigationMode::Fly } else { NavigationMode::Orbit };
    }
    if key(Key::R) {
        navigator.reset();
    }
    Keys {
        quit: key(Key::Escape),
        compare: key(Key::B),
        panel: key(Key::H),
        save_image: key(Key::I),
        save_radiance: key(Key::X),
        save_camera: key(Key::C),
        help: key(Key::Questionmark) || key(Key::F1) || key(Key::Slash) && input.modifiers.shift,
        next_layer: key(Key::L),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use trisect::scene::CameraPose;

    /// Returns the position, right and up in the image, to which a drag moves the point that is
    /// `ahead` (towards the camera) of the point looked at.
    fn moved(mode: NavigationMode, drag: (f64, f64), pans: bool, ahead: f64) -> (f64, f64) {
        let mut navigator = Navigator::new(CameraPose {
            look_from: DVec3::new(0.0, 0.0, 5.0),
            look_at: DVec3::ZERO,
            vertical_fov: 1.0,
            focus_distance: 5.0,
            ..CameraPose::PINHOLE
        });
        navigator.mode = mode;
        drag_camera(&mut navigator, drag, pans);
        let pose = navigator.pose();
        let towards = (pose.look_at - pose.look_from).normalize();
        let right = towards.cross(pose.up).normalize();
        let seen = DVec3::new(0.0, 0.0, ahead) - pose.look_from;
        (seen.dot(right), seen.dot(right.cross(towards)))
    }

    #[test]
    fn the_wheel_zooms_a_parallel_view() {
        for mode in [NavigationMode::Orbit, NavigationMode::Fly] {
            let parallel = CameraPose { parallel_height: 2.0, ..CameraPose::PINHOLE };
            let mut navigator = Navigator::new(parallel);
            navigator.mode = mode;
            turn_wheel(&mut navigator, 2.0f64.ln());
            assert!((navigator.pose().parallel_height - 1.0).abs() < 1e-12, "{mode:?}");
            assert_eq!(navigator.pose().look_from, parallel.look_from);
            // A drag across the window's height shifts the view by its height: the scene stays
            // under the pointer.
            drag_camera(&mut navigator, (1.0, 0.0), true);
            assert!((navigator.pose().look_from - DVec3::new(-1.0, 0.0, 0.0)).length() < 1e-12);
            // Negative control: a perspective comes closer.
            let mut navigator = Navigator::new(CameraPose::PINHOLE);
            navigator.mode = mode;
            turn_wheel(&mut navigator, 2.0f64.ln());
            assert!(navigator.pose().look_from.z < -0.4, "{mode:?}");
        }
    }

    #[test]
    fn the_scene_follows_the_pointer() {
        let (right, down) = ((0.1, 0.0), (0.0, 0.1));
        // The front of an object, 1 before the point, goes where the pointer goes.
        assert!(moved(NavigationMode::Orbit, right, false, 1.0).0 > 0.1);
        assert!(moved(NavigationMode::Orbit, down, false, 1.0).1 < -0.1);
        for mode in [NavigationMode::Orbit, NavigationMode::Fly] {
            assert!(moved(mode, right, true, 0.0).0 > 0.1 && moved(mode, down, true, 0.0).1 < -0.1);
        }
        // In fly mode the view follows the pointer, so the scene goes the other way.
        assert!(moved(NavigationMode::Fly, right, false, 0.0).0 < -0.1);
    }
}
