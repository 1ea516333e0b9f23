//! Viewer of a scene: navigation of the camera, series of frames, and files of camera paths.
//!
//! Used by `trisect view`, in a window and without one.

mod navigate;
mod path;
mod viewer;

pub use navigate::{NavigationMode, Navigator};
pub use path::CameraPath;
pub use viewer::{FrameTiming, MIN_SCALE, ViewOptions, Viewer};
