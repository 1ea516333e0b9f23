//! Viewer of a scene: navigation of the camera, and series of frames.
//!
//! Used by `trisect view`, in a window and without one.

mod layer;
mod navigate;
mod pace;
mod pick;
mod viewer;

pub use layer::{Layer, LayerPicture};
pub use navigate::{NavigationMode, Navigator};
pub use pace::{MOVING_FPS, Pace};
pub use pick::Pick;
pub use trisect_scene::CameraPath;
pub use viewer::{FrameTiming, MIN_SCALE, ViewOptions, Viewer};
