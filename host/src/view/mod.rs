//! Looking around in a scene: moving the camera, frames that follow each other, and files of camera paths.

mod navigate;
mod path;
mod viewer;

pub use navigate::{NavigationMode, Navigator};
pub use path::CameraPath;
pub use viewer::{FrameTiming, MIN_SCALE, ViewOptions, Viewer};
