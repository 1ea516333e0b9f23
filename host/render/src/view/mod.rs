//! Viewer of a scene: navigation of the camera, and series of frames.
//!
//! Used by `trisect view`, in a window and without one.

mod navigate;
mod pace;
mod viewer;

pub use navigate::{NavigationMode, Navigator};
pub use pace::{MOVING_FPS, Pace};
pub use trisect_scene::CameraPath;
pub use viewer::{FrameTiming, MIN_SCALE, ViewOptions, Viewer};
