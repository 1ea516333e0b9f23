//! Camera paths: poses of the camera at key frames, in the coordinates of the scene file, read from
//! a RON file. `trisect render --camera-path` and `view --headless` render them.

use crate::{Camera, CameraPose, SceneError};
use serde::Deserialize;
use std::path::Path;
use trisect_system::input;

/// Version of the file format, the only one so far.
const VERSION: u32 = 1;

/// Poses at frames, interpolated linearly in between.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keys: Vec<(u32, CameraPose)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "CameraPath")]
struct File {
    version: u32,
    keys: Vec<Key>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Key {
    /// Frame number, from 0.
    frame: u32,
    camera: Camera,
}

impl CameraPath {
    /// Returns the path of a camera at rest.
    pub fn rest(pose: CameraPose) -> Self {
        Self { keys: vec![(0, pose)] }
    }

    /// Reads a RON file `CameraPath(version: 1, keys: [(frame: 0, camera: (look_from: …)), …])`.
    /// Cameras have the fields and units of scene files; frames are in ascending order.
    ///
    /// # Errors
    ///
    /// [`SceneError`] with the file, the place and a remedy.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let text = input::read_text(path).map_err(|error| SceneError::read(path, error))?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Parses the text of a file, which is called `name` in messages.
    ///
    /// # Errors
    ///
    /// [`SceneError`], as [`load`](Self::load) returns it.
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneError> {
        let file: File = ron::from_str(text).map_err(|error| {
            let place = error.span.start;
            SceneError::at(name, text, place.line, place.col, crate::ron_error::message(&error.code))
        })?;
        let refused = |message: String| SceneError::Inconsistent { file: name.to_owned(), message };
        if file.version != VERSION {
            return Err(refused(format!(
                "unsupported version {} of the camera path format; this program reads version {VERSION}",
                file.version
            )));
        }
        let keys: Vec<_> = file.keys.iter().map(|key| (key.frame, key.camera.pose())).collect();
        if keys.is_empty() {
            return Err(refused("keys: there are none; give at least one, at frame 0".to_owned()));
        }
        if let Some(pair) = keys.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            return Err(refused(format!(
                "keys: frame {} stands before frame {}; put them in ascending order",
                pair[0].0, pair[1].0
            )));
        }
        let is_parallel = |key: &(u32, CameraPose)| key.1.parallel_height > 0.0;
        if let Some(pair) = keys.windows(2).find(|pair| is_parallel(&pair[0]) != is_parallel(&pair[1])) {
            let kind = |key| match is_parallel(key) {
                true => "a parallel projection (height)",
                false => "a perspective (vertical_fov)",
            };
            let ((first, second), (one, other)) = ((pair[0].0, pair[1].0), (kind(&pair[0]), kind(&pair[1])));
            return Err(refused(format!(
                "keys: the camera of frame {second} is {other}, and that of frame {first} {one}; there is \
                 nothing in between: give all keys cameras of one kind, or write a path for each kind"
            )));
        }
        Ok(Self { keys })
    }

    /// Returns the frame of the last key.
    pub fn last(&self) -> u32 {
        self.keys.last().map_or(0, |key| key.0)
    }

    /// Returns the pose at a frame, as [`pose_at`](Self::pose_at) does.
    ///
    /// # Errors
    ///
    /// Those of [`pose_at`](Self::pose_at).
    pub fn pose(&self, frame: u32) -> Result<CameraPose, SceneError> {
        self.pose_at(f64::from(frame))
    }

    /// Returns the pose at a time, in frames. Before the first key it is that of the first, after
    /// the last key that of the last; between two keys each number is interpolated linearly.
    ///
    /// # Errors
    ///
    /// [`SceneError::Inconsistent`] for an invalid interpolated pose, such as a camera at the point
    /// that it looks at.
    pub fn pose_at(&self, frame: f64) -> Result<CameraPose, SceneError> {
        let after = self.keys.partition_point(|key| f64::from(key.0) <= frame);
        let (before, after) = (after.saturating_sub(1), after.min(self.keys.len() - 1));
        let ((from, a), (to, b)) = (self.keys[before], self.keys[after]);
        if before == after {
            return Ok(a);
        }
        let share = (frame - f64::from(from)) / f64::from(to - from);
        let pose = a.mix(&b, share);
        pose.check().map_err(|message| SceneError::Inconsistent {
            file: format!("camera path, frame {frame}"),
            message: format!("{message}; add a key between frames {from} and {to}"),
        })?;
        Ok(pose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: &str = "CameraPath(version: 1, keys: [
        (frame: 2, camera: (look_from: (0, 0, 4), look_at: (0, 0, 0), vertical_fov: 40)),
        (frame: 6, camera: (look_from: (2, 0, 4), look_at: (0, 1, 0), vertical_fov: 60)),
    ])";

    #[test]
    fn straight_between_keys() {
        let path = CameraPath::parse(PATH, "path.ron").unwrap();
        let x = |frame| path.pose(frame).unwrap().look_from.x;
        assert_eq!([0, 2, 3, 4, 6, 9].map(x), [0.0, 0.0, 0.5, 1.0, 2.0, 2.0]);
        assert_eq!(path.pose_at(2.5).unwrap().look_from.x, 0.25);
        assert!((path.pose(4).unwrap().vertical_fov.to_degrees() - 50.0).abs() < 1e-9);
        assert_eq!(path.last(), 6);
    }

    #[test]
    fn what_is_no_path() {
        let said = |text: &str| CameraPath::parse(text, "path.ron").unwrap_err().to_string();
        assert!(said("CameraPath(version: 2, keys: [])").contains("version 2"));
        assert!(said("CameraPath(version: 1, keys: [])").contains("there are none"));
        assert!(said(&PATH.replace("frame: 6", "frame: 2")).contains("ascending"));
        let line = said(&PATH.replace("vertical_fov: 60", "vertical_fov: 0"));
        assert!(line.starts_with("path.ron:3:"), "{line}");
        assert!(said(&PATH.replace("look_at: (0, 1, 0)", "look_at: (2, 0, 4)")).contains("same point"));
        assert!(said("").starts_with("path.ron:1:1"));
        let mixed = PATH.replace("vertical_fov: 60", "height: 2");
        let error = CameraPath::parse(&mixed, "path.ron").unwrap_err();
        assert!(matches!(&error, SceneError::Inconsistent { file, .. } if file == "path.ron"), "{error:?}");
        for words in ["frame 6 is a parallel", "frame 2 a perspective", "cameras of one kind"] {
            assert!(error.to_string().contains(words), "{error}");
        }
        // Two parallel projections have one in between.
        let parallel = mixed.replace("vertical_fov: 40", "height: 1");
        let path = CameraPath::parse(&parallel, "path.ron").unwrap();
        assert_eq!(path.pose(4).unwrap().parallel_height, 1.5);
    }

    #[test]
    fn halfway_poses_are_checked() {
        let text =
            PATH.replace("look_from: (2, 0, 4)", "look_from: (0, 0, -4)").replace("(0, 1, 0)", "(0, 0, 0)");
        let path = CameraPath::parse(&text, "path.ron").unwrap();
        let error = path.pose(4).unwrap_err().to_string();
        assert!(error.contains("frame 4") && error.contains("add a key between frames 2 and 6"), "{error}");
    }
}
